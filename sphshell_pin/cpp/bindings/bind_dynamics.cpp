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

// An array (n, 3) of NumPy's.
using RowPoints = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

// Of a homogeneous transform, whose last row is not looked at.
SE3 to_se3(const Eigen::Matrix4d& m) {
  return SE3(Eigen::Matrix3d(m.topLeftCorner<3, 3>()), Vec3(m.topRightCorner<3, 1>()));
}

// One geometry of three: a source, a ball of a positive radius, or a shell.
std::unique_ptr<Pair> make_pair(std::string name, int joint_i, const Eigen::Matrix4d& placement_i,
                                int joint_j, const Eigen::Matrix4d& placement_j, double radius,
                                double ball, std::shared_ptr<Shell> shell, nb::object source,
                                int method, const NormalLaw& law, const FrictionLaw* friction,
                                bool plane) {
  auto pair = std::make_unique<Pair>();
  pair->name = std::move(name);
  pair->joint_i = joint_i;
  pair->joint_j = joint_j;
  pair->placement_i = to_se3(placement_i);
  pair->placement_j = to_se3(placement_j);
  pair->radius = radius;
  if (!source.is_none())
    pair->geometry = SourcePoints{{}, PythonSource(std::move(source))};
  else if (ball > 0)
    pair->geometry = Ball{{}, ball};
  else if (plane)
    pair->geometry = PlaneBelow{{}, std::move(shell)};
  else
    pair->geometry = ShellSurface{{}, std::move(shell), static_cast<Method>(method)};
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

// Lets Python's garbage collector see what the object holds, so that cycles through callbacks are
// freed.
template <class T, int (*visit_parts)(const T&, visitproc, void*)>
PyType_Slot* slots() {
  static PyType_Slot all[] = {{Py_tp_traverse, reinterpret_cast<void*>(&traverse<T, visit_parts>)},
                              {0, nullptr}};
  return all;
}

// A method of q and v, which are checked: what answer(scene, evaluate, q, v) makes of a scene
// there.
template <class T, class Answer>
void def_at_state(nb::class_<T>& bound, const char* name, Answer answer) {
  bound.def(
      name,
      [answer](T& self, nb::handle given_q, nb::handle given_v) {
        const auto [q, v, tau] = self.arguments(given_q, given_v, nb::none());
        return self.at(q, v, [&, &q = q, &v = v](SceneData& scene, auto&& evaluate) {
          return answer(scene, evaluate, q, v);
        });
      },
      "q"_a, "v"_a.none() = nb::none());
}

// What a scene answers at one state, with a memory of its own or without.
template <class T>
void bind_evaluations(nb::class_<T>& bound) {
  def_at_state(bound, "external_forces", [](SceneData& scene, auto&& evaluate, auto&&...) {
    evaluate();
    const Forces none(scene.touching() ? 0 : scene.external().size(), pinocchio::Force::Zero());
    return to_python(scene.touching() ? scene.external() : none);
  });
  def_at_state(bound, "joint_forces",
               [](SceneData& scene, auto&& evaluate, const VectorX&, const VectorX& v) {
                 evaluate();
                 const JointForces& joints = scene.joints();
                 return to_array(joints.act() ? joints.torque() : VectorX(VectorX::Zero(v.size())));
               });
  def_at_state(bound, "contacts",
               [](SceneData& scene, auto&& evaluate, const VectorX& q, const VectorX& v) {
                 std::vector<ContactRow> rows;
                 evaluate();
                 scene.log(q, v, rows);
                 return to_bytes(std::move(rows));
               });
  def_at_state(bound, "contact_derivatives",
               [](SceneData&, auto&& evaluate, const VectorX& q, const VectorX& v) {
                 Linearization& linearization = evaluate.linearization();
                 evaluate();
                 MatrixX by_q, by_v;
                 linearization.forces(q, v, by_q, by_v);
                 return std::pair(to_array(by_q), to_array(by_v));
               });
}

}  // namespace
}  // namespace sphshell

void bind_derivatives(nanobind::module_& m, nanobind::class_<sphshell::Evaluations>& scene,
                      nanobind::class_<sphshell::OwnState>& state);

void bind_dynamics(nanobind::module_& m) {
  using namespace sphshell;
  // A pair is described in Python (dynamics/scene/pairs.py), which has checked all of it.
  nb::class_<Pair>(m, "Pair", nb::type_slots(slots<Pair, visit_pair>()))
      .def_rw("relaxation", &Pair::relaxation)
      .def_rw("group", &Pair::group)
      .def(nb::new_(&make_pair), "name"_a, "joint_i"_a, "placement_i"_a, "joint_j"_a,
           "placement_j"_a, "radius"_a, "ball"_a, "shell"_a.none(), "source"_a.none(), "method"_a,
           "law"_a, "friction"_a.none(), "plane"_a);

  // NumPy's structured types of the rows that come as plain memory.
  m.def("contact_row_type", [] { return row_type<ContactRow>(kContactRowFields); });
  m.def("patch_row_type", [] { return row_type<PatchRow>(kPatchRowFields); });

  // Joint components: arrays (nv) of damping and limits, then stops and dry friction one by one.
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
          "damping"_a, "least_effort"_a, "most_effort"_a, "speed"_a)
      .def(
          "add_stop",
          [](JointEffects& self, int q, int v, double end, double sign, const NormalLaw& law) {
            self.stops.push_back({q, v, end, sign, law});
          },
          "q"_a, "v"_a, "end"_a, "sign"_a, "law"_a)
      .def(
          "add_friction",
          [](JointEffects& self, int v, double limit, double stiffness, double damping,
             double relaxation) {
            self.friction.push_back({v, limit, stiffness, damping, relaxation});
          },
          "v"_a, "limit"_a, "stiffness"_a, "damping"_a, "relaxation"_a);

  m.def("model_fault", [](nb::handle model) { return model_fault(model_of(model)); }, "model"_a);

  // Evaluations at single states, from any thread.
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
          "model"_a, "shown"_a, "pairs"_a, "joints"_a.none(), "convert"_a)
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
          "q"_a, "v"_a, "z"_a, "tau"_a, "repeat"_a = 1);

  // A state that remembers contacts and bristles, for a loop of the user's own.
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
          "model"_a, "shown"_a, "pairs"_a, "joints"_a.none(), "convert"_a)
      .def("copy", [](const OwnState& self) { return new OwnState(self); })
      .def(
          "advance",
          [](OwnState& self, nb::handle q, nb::handle v, double dt) {
            const StateArgument given = self.arguments(q, v, nb::none());
            self.advance(given.q, given.v, dt);
          },
          "q"_a, "v"_a.none(), "dt"_a);
  bind_derivatives(m, scene, state);

  // Controllers by their parameters, checked in dynamics/control/.
  nb::class_<Controller>(m, "Controller");
  nb::class_<GravityCompensation, Controller>(m, "GravityCompensation")
      .def(nb::init<VectorX>(), "actuated"_a);
  nb::class_<JointPd, Controller>(m, "JointPd")
      .def(nb::init<VectorX, VectorX, VectorX, bool, VectorX>(), "kp"_a, "kd"_a, "q_ref"_a,
           "gravity"_a, "actuated"_a);
  nb::class_<PythonController, Controller>(
      m, "PythonController", nb::type_slots(slots<PythonController, visit_controller>()))
      .def(nb::init<nb::object>(), "callable"_a);
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
      nb::kw_only(), "along"_a, "points"_a, "tangents"_a, "normals"_a, "times"_a, "places"_a,
      "speeds"_a, "accelerations"_a, "jerks"_a, "kinks"_a);
  nb::class_<CartesianImpedance, Controller>(m, "CartesianImpedance")
      .def(
          "__init__",
          [](CartesianImpedance* self, int num_joints, int joint, const Eigen::Matrix4d& frame,
             int path_joint, const Eigen::Matrix4d& path_placement, const PathSettings& path,
             double stiffness, double damping, double normal_force, double rotational_stiffness,
             double rotational_damping, VectorX posture_stiffness, VectorX joint_damping,
             VectorX q_ref, VectorX actuated, bool decoupled) {
            ImpedanceSettings s;
            // Field by field, as the order of an aggregate's fields is easily mistaken.
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
          "num_joints"_a, "joint"_a, "frame"_a, "path_joint"_a, "path_placement"_a, "path"_a,
          "stiffness"_a, "damping"_a, "normal_force"_a, "rotational_stiffness"_a,
          "rotational_damping"_a, "posture_stiffness"_a, "joint_damping"_a, "q_ref"_a, "actuated"_a,
          "decoupled"_a);

  // Times in seconds; by keyword only.
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
          nb::kw_only(), "integrator"_a, "dt"_a, "rtol"_a, "atol"_a, "duration"_a, "start_time"_a,
          "control_dt"_a, "record_dt"_a, "patches"_a, "torques"_a);

  nb::class_<OneUser>(m, "OneUser").def(nb::init<std::string>(), "what"_a);
  // Entered and left in one instruction of Python each, so that Ctrl-C cannot come between.
  nb::class_<PythonUse>(m, "Use")
      .def(nb::init<OneUser&, std::string>(), "user"_a, "doing"_a, nb::keep_alive<1, 2>())
      .def("__enter__", &PythonUse::enter)
      .def("__exit__", [](PythonUse& self, nb::args) { self.leave(); });

  // One run that goes on in pieces; each method is for one user at a time.
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
          "model"_a, "pairs"_a, "joints"_a.none(), "controller"_a.none(), "q0"_a, "v0"_a,
          "settings"_a, "sensors"_a)
      .def(
          "differentiate",
          [](Run& self, const std::vector<const Parameter*>& parameters, bool by_q0, bool by_v0) {
            const Use use(self.user, "differentiate");
            self.simulation.differentiate({copies(parameters), by_q0, by_v0});
          },
          "parameters"_a, "by_q0"_a, "by_v0"_a)
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
          "wall_seconds"_a, "until"_a = std::numeric_limits<double>::infinity())
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
          "pairs"_a, "joints"_a.none(), "controller"_a.none())
      .def(
          "take_over",
          [](Run& self, const Run& before) {
            const Use use(self.user, "take_over");
            self.simulation.take_over(before.simulation);
          },
          "before"_a)
      .def(
          "push",
          [](Run& self, int joint, const Vec3& point, const Vec3& force, const Vec3& anchor,
             double stiffness, double damping, int frame) {
            const Use use(self.user, "push");
            self.simulation.push(joint, point, {force, anchor, stiffness, damping}, frame);
          },
          "joint"_a, "point"_a, "force_world"_a, "anchor_world"_a, "stiffness"_a, "damping"_a,
          "frame"_a)
      .def(
          "record_patches",
          [](Run& self, bool on) {
            const Use use(self.user, "record");
            self.simulation.record_patches(on);
          },
          "on"_a)
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
      // State and figures at any time during the run.
      .def_prop_ro("counts", [](Run& self) { return to_dict(alone<&Simulation::counts>(self)); })
      .def_prop_ro("last_step", &alone<&Simulation::last_step>)
      .def_prop_ro("wall_time", &alone<&Simulation::wall_time>)
      .def_prop_ro("summaries",
                   [](Run& self) { return to_list(alone<&Simulation::summaries>(self)); })
      .def_prop_ro("limits", [](Run& self) { return to_list(alone<&Simulation::limits>(self)); });
}
