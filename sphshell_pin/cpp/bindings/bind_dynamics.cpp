#include "bindings/interop.hpp"

#include <limits>
#include <memory>

#include "bindings/arrays.hpp"
#include "bindings/callbacks.hpp"
#include "bindings/evaluations.hpp"
#include "bindings/records.hpp"
#include "dynamics/scene/model_fault.hpp"
#include "dynamics/derivatives/linearization.hpp"
#include "dynamics/run/simulation.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

namespace sphshell {
namespace {

using RowPoints = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

SE3 to_se3(const Eigen::Matrix4d& m) {
  return SE3(Eigen::Matrix3d(m.topLeftCorner<3, 3>()), Vec3(m.topRightCorner<3, 1>()));
}

std::unique_ptr<Pair> make_pair(std::string name, int joint_i, const Eigen::Matrix4d& placement_i,
                                int joint_j, const Eigen::Matrix4d& placement_j, double radius,
                                double ball, std::shared_ptr<Shell> shell, nb::object source,
                                int method, const NormalLaw& law, const FrictionLaw* friction) {
  auto pair = std::make_unique<Pair>();
  pair->name = std::move(name);
  pair->joint_i = joint_i;
  pair->joint_j = joint_j;
  pair->placement_i = to_se3(placement_i);
  pair->placement_j = to_se3(placement_j);
  pair->radius = radius;
  pair->ball = ball;
  pair->shell = std::move(shell);
  if (!source.is_none()) pair->source = PythonSource(std::move(source));
  pair->method = static_cast<Method>(method);
  pair->law = law;
  if (friction) pair->friction = *friction;
  return pair;
}

std::vector<Vec3> to_points(const RowPoints& rows) {
  std::vector<Vec3> out;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) out.push_back(rows.row(i).transpose());
  return out;
}

// A run for one user at a time.
struct Run {
  OneUser user{"run"};
  Simulation simulation;

  Run(const pinocchio::Model& model, std::vector<Pair> pairs, JointForces::Effects joints,
      const RunSettings& settings, std::shared_ptr<Controller> controller, VectorX q0, VectorX v0,
      std::vector<Sensor> sensors)
      : simulation(model, std::move(pairs), std::move(joints), settings, std::move(controller),
                   std::move(q0), std::move(v0), std::move(sensors)) {}
};

// What Python enters with `with`.
class PythonUse {
 public:
  PythonUse(OneUser& user, std::string doing) : user_(user), doing_(std::move(doing)) {}
  void enter() { user_.enter(doing_.c_str()); }
  void leave() { user_.leave(); }

 private:
  OneUser& user_;
  const std::string doing_;
};

// A property, for one user at a time.
template <auto get>
auto alone(Run& run) {
  const Use use(run.user, "state");
  return std::decay_t<decltype((run.simulation.*get)())>((run.simulation.*get)());
}

int visit_evaluations(const Evaluations& evaluations, visitproc visit, void* arg) {
  return evaluations.for_each_pairs(
      [&](const std::vector<Pair>& pairs) { return visit_sources(pairs, visit, arg); });
}

int visit_state(const OwnState& own, visitproc visit, void* arg) {
  return visit_sources(own.state.scene().pairs(), visit, arg);
}

int visit_controller(const PythonController& controller, visitproc visit, void* arg) {
  Py_VISIT(controller.callable().ptr());
  return 0;
}

// A run holds its controller by the object that Python has of it.
int visit_run(const Run& run, visitproc visit, void* arg) {
  if (const Controller* controller = run.simulation.controller())
    Py_VISIT(nb::find(*controller).ptr());
  return visit_sources(run.simulation.pairs(), visit, arg);
}

template <class T, int (*visit_parts)(const T&, visitproc, void*)>
PyType_Slot* slots() {
  static PyType_Slot all[] = {{Py_tp_traverse, reinterpret_cast<void*>(&traverse<T, visit_parts>)},
                              {0, nullptr}};
  return all;
}

// What a scene answers at one state, with a memory of its own or without.
template <class T>
void bind_evaluations(nb::class_<T>& bound) {
  bound
      .def(
          "external_forces",
          [](T& self, nb::handle given_q, nb::handle given_v) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, nb::none());
            return self.at(q, v, [&, &q = q, &v = v](SceneData& scene, auto&& evaluate) {
              evaluate();
              const Forces none(scene.touching() ? 0 : scene.external().size(),
                                pinocchio::Force::Zero());
              return to_python(scene.touching() ? scene.external() : none);
            });
          },
          nb::arg("q"), nb::arg("v").none() = nb::none())
      .def(
          "joint_forces",
          [](T& self, nb::handle given_q, nb::handle given_v) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, nb::none());
            return self.at(q, v, [&, &q = q, &v = v](SceneData& scene, auto&& evaluate) {
              evaluate();
              const JointForces& joints = scene.joints();
              return to_array(joints.act() ? joints.torque() : VectorX(VectorX::Zero(v.size())));
            });
          },
          nb::arg("q"), nb::arg("v").none() = nb::none())
      .def(
          "contacts",
          [](T& self, nb::handle given_q, nb::handle given_v) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, nb::none());
            return self.at(q, v, [&, &q = q, &v = v](SceneData& scene, auto&& evaluate) {
              std::vector<ContactRow> rows;
              evaluate();
              scene.log(q, v, rows);
              return to_bytes(std::move(rows));
            });
          },
          nb::arg("q"), nb::arg("v").none() = nb::none())
      .def(
          "contact_derivatives",
          [](T& self, nb::handle given_q, nb::handle given_v) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, nb::none());
            return self.at(q, v, [&, &q = q, &v = v](SceneData&, auto&& evaluate) {
              Linearization& linearization = evaluate.linearization();
              evaluate();
              MatrixX by_q, by_v;
              linearization.forces(q, v, by_q, by_v);
              return std::pair(to_array(by_q), to_array(by_v));
            });
          },
          nb::arg("q"), nb::arg("v").none() = nb::none());
}

}  // namespace
}  // namespace sphshell

void bind_derivatives(nanobind::module_& m, nanobind::class_<sphshell::Evaluations>& scene,
                      nanobind::class_<sphshell::OwnState>& state);

void bind_dynamics(nanobind::module_& m) {
  using namespace sphshell;
  nb::class_<Pair>(m, "Pair", nb::type_slots(slots<Pair, visit_pair>()))
      .def_rw("relaxation", &Pair::relaxation)
      .def_rw("group", &Pair::group)
      .def(nb::new_(&make_pair), nb::arg("name"), nb::arg("joint_i"), nb::arg("placement_i"),
           nb::arg("joint_j"), nb::arg("placement_j"), nb::arg("radius"), nb::arg("ball"),
           nb::arg("shell").none(), nb::arg("source").none(), nb::arg("method"), nb::arg("law"),
           nb::arg("friction").none());

  m.def("contact_row_type", [] { return row_type<ContactRow>(kContactRowFields); });
  m.def("patch_row_type", [] { return row_type<PatchRow>(kPatchRowFields); });

  nb::class_<JointEffects>(m, "JointEffects")
      .def(
          "__init__",
          [](JointEffects* self, VectorX damping, VectorX least_effort, VectorX most_effort,
             VectorX speed) {
            new (self) JointEffects{{},
                                    {},
                                    std::move(damping),
                                    std::move(least_effort),
                                    std::move(most_effort),
                                    std::move(speed)};
          },
          nb::arg("damping"), nb::arg("least_effort"), nb::arg("most_effort"), nb::arg("speed"))
      .def(
          "add_stop",
          [](JointEffects& self, int q, int v, double end, double sign, const NormalLaw& law) {
            self.stops.push_back({q, v, end, sign, law});
          },
          nb::arg("q"), nb::arg("v"), nb::arg("end"), nb::arg("sign"), nb::arg("law"))
      .def(
          "add_friction",
          [](JointEffects& self, int v, double limit, double stiffness, double damping,
             double relaxation) {
            self.friction.push_back({v, limit, stiffness, damping, relaxation});
          },
          nb::arg("v"), nb::arg("limit"), nb::arg("stiffness"), nb::arg("damping"),
          nb::arg("relaxation"));

  m.def(
      "model_fault", [](nb::handle model) { return model_fault(model_of(model)); },
      nb::arg("model"));

  nb::class_<Evaluations> scene(m, "Scene",
                                nb::type_slots(slots<Evaluations, visit_evaluations>()));
  bind_evaluations(scene);
  scene
      .def(
          "__init__",
          [](Evaluations* self, nb::object model, nb::object shown,
             const std::vector<const Pair*>& pairs, std::shared_ptr<JointEffects> joints,
             nb::object convert) {
            new (self) Evaluations(model_of(model), copies(pairs), std::move(joints),
                                   {model, std::move(shown), std::move(convert)});
          },
          nb::arg("model"), nb::arg("shown"), nb::arg("pairs"), nb::arg("joints").none(),
          nb::arg("convert"))
      .def_prop_ro("bristle_size", &Evaluations::bristle_size)
      .def("rates",
           [](Evaluations& self, const VectorX& q, const VectorX& v, const VectorX& z,
              const VectorX& tau) {
             return self.at(q, v, [&](SceneData& scene, auto&&) {
               check_count("z", z.size(), scene.bristle_size());
               check_count("tau", tau.size(), v.size());
               scene.restart();
               scene.evaluate(q, v, z);
               VectorX out(v.size() + z.size());
               out << scene.acceleration(q, v, tau), scene.bristle_rates();
               return to_array(out);
             });
           })
      .def(
          "rate_jacobian",
          [](Evaluations& self, const VectorX& q, const VectorX& v, const VectorX& z,
             const VectorX& tau, int repeat) {
            return self.at(q, v, [&](SceneData& scene, auto&& evaluate) {
              check_count("z", z.size(), scene.bristle_size());
              check_count("tau", tau.size(), v.size());
              Linearization& linearization = evaluate.linearization();
              scene.restart();
              scene.evaluate(q, v, z);
              MatrixX jacobian;
              for (int i = 0; i < repeat; ++i) linearization.rates(q, v, z, tau, jacobian);
              return to_array(jacobian);
            });
          },
          nb::arg("q"), nb::arg("v"), nb::arg("z"), nb::arg("tau"), nb::arg("repeat") = 1);

  nb::class_<OwnState> state(m, "SceneState", nb::type_slots(slots<OwnState, visit_state>()));
  bind_evaluations(state);
  state
      .def(
          "__init__",
          [](OwnState* self, nb::object model, nb::object shown,
             const std::vector<const Pair*>& pairs, std::shared_ptr<JointEffects> joints,
             nb::object convert) {
            new (self) OwnState(model_of(model), copies(pairs), std::move(joints),
                                {model, std::move(shown), std::move(convert)});
          },
          nb::arg("model"), nb::arg("shown"), nb::arg("pairs"), nb::arg("joints").none(),
          nb::arg("convert"))
      .def("copy", [](const OwnState& self) { return new OwnState(self); })
      .def(
          "advance",
          [](OwnState& self, nb::handle q, nb::handle v, double dt) {
            const StateArgument given = self.arguments(q, v, nb::none());
            self.advance(given.q, given.v, dt);
          },
          nb::arg("q"), nb::arg("v").none(), nb::arg("dt"));
  bind_derivatives(m, scene, state);

  nb::class_<Controller>(m, "Controller");
  nb::class_<GravityCompensation, Controller>(m, "GravityCompensation")
      .def(nb::init<VectorX>(), nb::arg("actuated"));
  nb::class_<JointPd, Controller>(m, "JointPd")
      .def(nb::init<VectorX, VectorX, VectorX, bool, VectorX>(), nb::arg("kp"), nb::arg("kd"),
           nb::arg("q_ref"), nb::arg("gravity"), nb::arg("actuated"));
  nb::class_<PythonController, Controller>(
      m, "PythonController", nb::type_slots(slots<PythonController, visit_controller>()))
      .def(nb::init<nb::object>(), nb::arg("callable"));
  nb::class_<PathSettings>(m, "Path").def(
      "__init__",
      [](PathSettings* self, std::vector<double> along, const RowPoints& points,
         const RowPoints& tangents, const RowPoints& normals, std::vector<double> times,
         std::vector<double> places, std::vector<double> speeds, std::vector<double> accelerations,
         std::vector<double> jerks, std::vector<double> kinks) {
        new (self) PathSettings{std::move(along),   to_points(points),        to_points(tangents),
                                to_points(normals), std::move(times),         std::move(places),
                                std::move(speeds),  std::move(accelerations), std::move(jerks),
                                std::move(kinks)};
      },
      nb::kw_only(), nb::arg("along"), nb::arg("points"), nb::arg("tangents"), nb::arg("normals"),
      nb::arg("times"), nb::arg("places"), nb::arg("speeds"), nb::arg("accelerations"),
      nb::arg("jerks"), nb::arg("kinks"));
  nb::class_<CartesianImpedance, Controller>(m, "CartesianImpedance")
      .def(
          "__init__",
          [](CartesianImpedance* self, int num_joints, int joint, const Eigen::Matrix4d& frame,
             int path_joint, const Eigen::Matrix4d& path_placement, const PathSettings& path,
             double stiffness, double damping, double normal_force, double rotational_stiffness,
             double rotational_damping, VectorX posture_stiffness, VectorX joint_damping,
             VectorX q_ref, VectorX actuated, bool decoupled) {
            ImpedanceSettings s;
            s.joint = joint;
            s.frame = to_se3(frame);
            s.path_joint = path_joint;
            s.path_placement = to_se3(path_placement);
            s.path = path;
            s.stiffness = stiffness;
            s.damping = damping;
            s.normal_force = normal_force;
            s.rotational_stiffness = rotational_stiffness;
            s.rotational_damping = rotational_damping;
            s.posture_stiffness = std::move(posture_stiffness);
            s.joint_damping = std::move(joint_damping);
            s.q_ref = std::move(q_ref);
            s.actuated = std::move(actuated);
            s.decoupled = decoupled;
            new (self) CartesianImpedance(std::move(s), num_joints);
          },
          nb::arg("num_joints"), nb::arg("joint"), nb::arg("frame"), nb::arg("path_joint"),
          nb::arg("path_placement"), nb::arg("path"), nb::arg("stiffness"), nb::arg("damping"),
          nb::arg("normal_force"), nb::arg("rotational_stiffness"), nb::arg("rotational_damping"),
          nb::arg("posture_stiffness"), nb::arg("joint_damping"), nb::arg("q_ref"),
          nb::arg("actuated"), nb::arg("decoupled"));

  nb::class_<RunSettings>(m, "RunSettings")
      .def(
          "__init__",
          [](RunSettings* self, std::string integrator, double dt, double rtol, double atol,
             double duration, double start_time, double control_dt, double record_dt, bool patches,
             bool torques) {
            new (self) RunSettings{{std::move(integrator), dt, rtol, atol},
                                   duration,
                                   start_time,
                                   control_dt,
                                   record_dt,
                                   patches,
                                   torques};
          },
          nb::kw_only(), nb::arg("integrator"), nb::arg("dt"), nb::arg("rtol"), nb::arg("atol"),
          nb::arg("duration"), nb::arg("start_time"), nb::arg("control_dt"), nb::arg("record_dt"),
          nb::arg("patches"), nb::arg("torques"));

  nb::class_<OneUser>(m, "OneUser").def(nb::init<std::string>(), nb::arg("what"));
  // Entered and left in one instruction of Python each, so that Ctrl-C cannot come between.
  nb::class_<PythonUse>(m, "Use")
      .def(nb::init<OneUser&, std::string>(), nb::arg("user"), nb::arg("doing"),
           nb::keep_alive<1, 2>())
      .def("__enter__", &PythonUse::enter)
      .def("__exit__", [](PythonUse& self, nb::args) { self.leave(); });

  nb::class_<Run>(m, "Simulation", nb::type_slots(slots<Run, visit_run>()))
      .def(
          "__init__",
          [](Run* self, nb::handle model, const std::vector<const Pair*>& pairs,
             std::shared_ptr<JointEffects> joints, std::shared_ptr<Controller> controller,
             VectorX q0, VectorX v0, const RunSettings& settings,
             const std::vector<const Sensor*>& sensors) {
            const pinocchio::Model& own = model_of(model);
            check_count("q0", q0.size(), own.nq);
            check_count("v0", v0.size(), own.nv);
            new (self) Run(own, copies(pairs), std::move(joints), settings, std::move(controller),
                           std::move(q0), std::move(v0), copies(sensors));
          },
          nb::arg("model"), nb::arg("pairs"), nb::arg("joints").none(),
          nb::arg("controller").none(), nb::arg("q0"), nb::arg("v0"), nb::arg("settings"),
          nb::arg("sensors"))
      .def(
          "differentiate",
          [](Run& self, const std::vector<const Parameter*>& parameters, bool by_q0, bool by_v0) {
            const Use use(self.user, "differentiate");
            self.simulation.differentiate({copies(parameters), by_q0, by_v0});
          },
          nb::arg("parameters"), nb::arg("by_q0"), nb::arg("by_v0"))
      .def("take_sensitivities",
           [](Run& self) {
             const Use use(self.user, "take");
             return to_dict(self.simulation.take_sensitivities());
           })
      .def(
          "advance",
          [](Run& self, double wall_seconds, double until) {
            const Use use(self.user, "advance");
            const ReleaseGil released;
            return static_cast<int>(self.simulation.advance(wall_seconds, until));
          },
          nb::arg("wall_seconds"), nb::arg("until") = std::numeric_limits<double>::infinity())
      .def("deep_start",
           [](Run& self) {
             const Use use(self.user, "start");
             return to_python(self.simulation.deep_start());
           })
      .def(
          "change",
          [](Run& self, const std::vector<const Pair*>& pairs, std::shared_ptr<JointEffects> joints,
             std::shared_ptr<Controller> controller) {
            const Use use(self.user, "change");
            self.simulation.change(copies(pairs), std::move(joints), std::move(controller));
          },
          nb::arg("pairs"), nb::arg("joints").none(), nb::arg("controller").none())
      .def(
          "take_over",
          [](Run& self, const Run& before) {
            const Use use(self.user, "take_over");
            self.simulation.take_over(before.simulation);
          },
          nb::arg("before"))
      .def(
          "push",
          [](Run& self, int joint, const Vec3& point, const Vec3& force, const Vec3& anchor,
             double stiffness, double damping, int frame) {
            const Use use(self.user, "push");
            self.simulation.push(joint, point, {force, anchor, stiffness, damping}, frame);
          },
          nb::arg("joint"), nb::arg("point"), nb::arg("force_world"), nb::arg("anchor_world"),
          nb::arg("stiffness"), nb::arg("damping"), nb::arg("frame"))
      .def(
          "record_patches",
          [](Run& self, bool on) {
            const Use use(self.user, "record");
            self.simulation.record_patches(on);
          },
          nb::arg("on"))
      .def("take",
           [](Run& self) {
             const Use use(self.user, "take");
             const auto& model = self.simulation.model();
             return to_dict(self.simulation.take(), model.nq, model.nv);
           })
      .def("record_torques",
           [](Run& self) {
             const Use use(self.user, "record_torques");
             self.simulation.record_torques();
           })
      .def("snapshot",
           [](Run& self) {
             const Use use(self.user, "snapshot");
             const auto& model = self.simulation.model();
             return to_dict(self.simulation.snapshot(), model.nq, model.nv);
           })
      .def_prop_ro("controller_remembers", &alone<&Simulation::controller_remembers>)
      .def_prop_ro("progress", &alone<&Simulation::progress>)
      .def_prop_ro("time", &alone<&Simulation::time>)
      .def_prop_ro(
          "q", [](Run& self) { return to_array(alone<&Simulation::q>(self)); },
          nb::rv_policy::automatic)
      .def_prop_ro(
          "v", [](Run& self) { return to_array(alone<&Simulation::v>(self)); },
          nb::rv_policy::automatic)
      .def_prop_ro("counts", [](Run& self) { return to_dict(alone<&Simulation::counts>(self)); })
      .def_prop_ro("last_step", &alone<&Simulation::last_step>)
      .def_prop_ro("wall_time", &alone<&Simulation::wall_time>)
      .def_prop_ro("summaries",
                   [](Run& self) { return to_list(alone<&Simulation::summaries>(self)); })
      .def_prop_ro("limits", [](Run& self) { return to_list(alone<&Simulation::limits>(self)); });
}
