#include "bindings/callbacks.hpp"
#include "bindings/evaluations.hpp"
#include "bindings/records.hpp"
#include "dynamics/compiled/compiled_robot.hpp"
#include "dynamics/scene/model_fault.hpp"
#include "dynamics/run/touches.hpp"

#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

namespace sphshell {

static void look_at(const Evaluations& evaluations, Visitor& visitor) {
  evaluations.for_each_pairs([&](const auto& pairs) { look_at(pairs, visitor); });
}

static void look_at(const OwnState& own, Visitor& visitor) {
  look_at(own.state.scene().pairs(), visitor);
}

}  // namespace sphshell

using namespace sphshell;

namespace {

// One geometry of four: a source, a ball of a positive radius, a plane, or a shell.
Geometry geometry_of(double ball, std::shared_ptr<Shell> shell, nb::object source, int method,
                     bool plane) {
  if (!source.is_none()) return SourcePoints{{}, PythonSource(std::move(source))};
  if (ball > 0) return Ball{{}, ball};
  if (plane) return PlaneBelow{{}, std::move(shell)};
  return ShellSurface{{}, std::move(shell), static_cast<Method>(method)};
}

// A run for one user at a time.
struct Run {
  OneUser user{"run"};
  Simulation simulation;

  Run(const pinocchio::Model& model, Task task) : simulation(model, std::move(task)) {}
};

// What Python enters with `with`.
struct PythonUse {
  OneUser& user;
  const std::string doing;
};

// Calls a member of a run, for one user at a time.
template <class Member, class... Args>
auto call_alone(Run& self, const char* doing, Member member, Args&&... args) {
  const Use use(self.user, doing);
  using Answer = std::invoke_result_t<Member, Simulation&, Args...>;
  if constexpr (std::is_void_v<Answer>)
    std::invoke(member, self.simulation, std::forward<Args>(args)...);
  else
    return as_python(std::invoke(member, self.simulation, std::forward<Args>(args)...));
}

// A method of a run.
template <class Answer, class... Args>
auto alone(const char* doing, Answer (Simulation::*method)(Args...)) {
  return [=](Run& self, Args... args) {
    return call_alone(self, doing, method, std::forward<Args>(args)...);
  };
}

// One that returns a record.
auto record(const char* doing, Record (Simulation::*method)()) {
  return [=](Run& self) {
    const Use use(self.user, doing);
    const auto& model = self.simulation.model();
    return to_dict((self.simulation.*method)(), model.nq, model.nv);
  };
}

// A run holds its controller by the object that Python has of it.
void look_at(const Run& run, Visitor& visitor) {
  if (const Controller* controller = run.simulation.controller()) visitor(nb::find(*controller));
  look_at(run.simulation.pairs(), visitor);
}

// A method of q and v: what answer(at) makes of a scene there.
template <class T, class Answer>
void def_at_state(nb::class_<T>& bound, const char* name, Answer answer) {
  bound.def(
      name,
      [answer](T& self, nb::handle q, nb::handle v) {
        return at_given(self, q, v, nb::none(), [&](const At& at, auto&&) { return answer(at); });
      },
      "q"_a, "v"_a.none() = nb::none());
}

// What a scene answers at one state, with a memory of its own or without.
template <class T>
void bind_evaluations(nb::class_<T>& bound) {
  bound.def(nb::init<nb::object, nb::object, std::vector<Pair>, JointForces::Effects, nb::object>(),
            "model"_a, "shown"_a, "pairs"_a, "joints"_a.none(), "convert"_a);
  def_at_state(bound, "external_forces", [](const At& at) {
    at.evaluate();
    const Forces& all = at.scene.external();
    return to_python(at.scene.touching() ? all : Forces(all.size(), pinocchio::Force::Zero()));
  });
  def_at_state(bound, "joint_forces", [](const At& at) {
    at.evaluate();
    const JointForces& joints = at.scene.joints();
    return to_array(joints.act() ? joints.torque() : VectorX(VectorX::Zero(at.v.size())));
  });
  def_at_state(bound, "contacts", [](const At& at) {
    at.evaluate();
    return to_bytes(at.rows());
  });
  def_at_state(bound, "contact_derivatives", [](const At& at) {
    Linearization& linearization = at.state.linearization();
    at.evaluate();
    MatrixX by_q, by_v;
    linearization.forces(at.q, at.v, by_q, by_v);
    return std::pair(to_array(by_q), to_array(by_v));
  });
}

// answer(at) where a scene without memory was evaluated with the bristles z; for tests of both.
template <class Answer>
auto with_bristles(Answer answer) {
  return [answer](Evaluations& self, const VectorX& q, const VectorX& v, const VectorX& z,
                  const VectorX& tau) {
    return self.at(q, v, [&](const At& at) {
      check_count("z", z.size(), at.scene.bristle_size());
      check_count("tau", tau.size(), v.size());
      Linearization& linearization = at.state.linearization();
      at.scene.evaluate_anew(q, v, z);
      return to_array(answer(at, linearization, z, tau));
    });
  };
}

}  // namespace

void bind_derivatives(nb::module_& m, nb::class_<Evaluations>& scene, nb::class_<OwnState>& state);

void bind_dynamics(nb::module_& m) {
  // A pair is described in Python (dynamics/scene/pairs.py), which has checked all of it.
  nb::class_<Pair>(m, "Pair", slots<Pair>())
      .def_rw("relaxation", &Pair::relaxation)
      .def_rw("group", &Pair::group)
      .def(
          "__init__",
          [](Pair* self, std::string name, int joint_i, const SE3& placement_i, int joint_j,
             const SE3& placement_j, double radius, double ball, std::shared_ptr<Shell> shell,
             nb::object source, int method, const NormalLaw& law, const FrictionLaw* friction,
             bool plane) {
            new (self) Pair{std::move(name),
                            "",
                            joint_i,
                            joint_j,
                            placement_i,
                            placement_j,
                            radius,
                            geometry_of(ball, std::move(shell), std::move(source), method, plane),
                            law,
                            friction ? *friction : FrictionLaw()};
          },
          "name"_a, "joint_i"_a, "placement_i"_a, "joint_j"_a, "placement_j"_a, "radius"_a,
          "ball"_a, "shell"_a.none(), "source"_a.none(), "method"_a, "law"_a, "friction"_a.none(),
          "plane"_a);

  // NumPy's structured types of the rows that come as plain memory.
  m.def("contact_row_type", [] { return row_type<ContactRow>(kContactRowFields); });
  m.def("patch_row_type", [] { return row_type<PatchRow>(kPatchRowFields); });

  // Joint components: arrays (nv) of damping and limits, then stops and dry friction one by one.
  nb::class_<CompiledRobot>(m, "CompiledRobot")
      .def("__init__", [](CompiledRobot* self, const std::string& path, nb::handle model) {
        new (self) CompiledRobot(path, model_of(model));
      });
  nb::class_<JointEffects>(m, "JointEffects")
      .def(nb::init<VectorX, VectorX, VectorX, VectorX>())
      .def("add_stop", [](JointEffects& self, int q, int v, double end, double sign,
                          const NormalLaw& law) { self.stops.push_back({q, v, end, sign, law}); })
      .def("add_friction",
           [](JointEffects& self, int v, double limit, double stiffness, double damping,
              double relaxation) {
             self.friction.push_back({v, limit, stiffness, damping, relaxation});
           })
      .def("use", [](JointEffects& self, std::shared_ptr<CompiledRobot> compiled) {
        self.compiled = std::move(compiled);
      });

  m.def("model_fault", [](nb::handle model) -> nb::object {
    const std::optional<ModelFault> fault = model_fault(model_of(model));
    if (!fault) return nb::none();
    return nb::make_tuple(fault->name, fault->value, fault->must);
  });

  m.def("touches_at",
        [](nb::handle model, const std::vector<Pair>& pairs, const VectorX& q, const VectorX& v) {
          check_state(model_of(model), q, v);
          Multibody body(model_of(model));
          std::vector<std::tuple<double, double, double, double>> out;
          for (const Touch& one : touches_at(body, pairs, q, v))
            out.emplace_back(one.gap, one.mass, one.slip_mass, one.speed);
          return out;
        });

  // Evaluations at single states, from any thread.
  nb::class_<Evaluations> scene(m, "Scene", slots<Evaluations>());
  bind_evaluations(scene);
  scene.def_prop_ro("bristle_size", &Evaluations::bristle_size)
      .def("rates", with_bristles([](const At& at, auto&&, auto&& z, const VectorX& tau) {
             VectorX out(at.v.size() + z.size());
             out << at.scene.acceleration(at.q, at.v, tau), at.scene.bristle_rates();
             return out;
           }))
      .def("rate_jacobian", with_bristles([](const At& at, Linearization& linearization,
                                             const VectorX& z, const VectorX& tau) {
             MatrixX out;
             linearization.rates(at.q, at.v, z, tau, out);
             return out;
           }));

  // A state that remembers contacts and bristles, for a loop of the user's own.
  nb::class_<OwnState> state(m, "SceneState", slots<OwnState>());
  bind_evaluations(state);
  state.def("copy", [](const OwnState& self) { return new OwnState(self); })
      .def("save",
           [](OwnState& self) {
             const Use use(self.user, "save");
             return to_array(self.state.save());
           })
      .def("restore",
           [](OwnState& self, const VectorX& from) {
             const Use use(self.user, "restore");
             return self.state.restore(from.data(), static_cast<std::size_t>(from.size()));
           })
      .def(
          "advance",
          [](OwnState& self, nb::handle q, nb::handle v, double dt) {
            const StateArgument given = self.arguments(q, v, nb::none());
            self.advance(given.q, given.v, dt);
          },
          "q"_a, "v"_a.none(), "dt"_a);
  bind_derivatives(m, scene, state);

  // Controllers by kind and fields, which dynamics/control/ has checked.
  nb::class_<Controller>(m, "Controller")
      .def(nb::new_([](const std::string& kind, std::map<std::string, VectorX> fields) {
        return make_controller(kind, {std::move(fields)});
      }));
  nb::class_<PythonController, Controller>(m, "PythonController", slots<PythonController>())
      .def(nb::init<nb::object>());

  // What a sensor measures is set at construction, the way of the signal by attributes.
  nb::class_<Sensor>(m, "Sensor")
      .def("__init__",
           [](Sensor* self, const std::string& kind, std::map<std::string, VectorX> fields) {
             new (self) Sensor{make_measured(kind, {std::move(fields)})};
           })
      .def_prop_ro("size", &Sensor::size)
      .def_rw("rate", &Sensor::rate)
      .def_rw("delay", &Sensor::delay)
      .def_rw("cutoff", &Sensor::cutoff)
      .def_rw("range", &Sensor::range)
      .def_rw("noise", &Sensor::noise)
      .def_rw("seed", &Sensor::seed);
  m.def("normal_noise", &normal_noise);

  // Times in seconds; by keyword only.
  nb::class_<RunSettings>(m, "RunSettings")
      .def(nb::init<std::string, double, double, double, double, double, double, double, bool, bool,
                    bool>(),
           nb::kw_only(), "integrator"_a, "dt"_a, "rtol"_a, "atol"_a, "duration"_a, "start_time"_a,
           "control_dt"_a, "record_dt"_a, "patches"_a, "torques"_a, "states"_a);

  nb::class_<OneUser>(m, "OneUser").def(nb::init<std::string>());
  // Entered and left in one instruction of Python each, so that Ctrl-C cannot come between.
  nb::class_<PythonUse>(m, "Use")
      .def(nb::init<OneUser&, std::string>(), nb::keep_alive<1, 2>())
      .def("__enter__", [](PythonUse& self) { self.user.enter(self.doing.c_str()); })
      .def("__exit__", [](PythonUse& self, nb::args) { self.user.leave(); });

  // One run that goes on in pieces; each method is for one user at a time.
  nb::class_<Run> run(m, "Simulation", slots<Run>());
  run.def(
         "__init__",
         [](Run* self, nb::handle model, std::vector<Pair> pairs, JointForces::Effects joints,
            std::shared_ptr<Controller> controller, VectorX q0, VectorX v0,
            const RunSettings& settings, std::vector<Sensor> sensors) {
           check_state(model_of(model), q0, v0);
           new (self) Run(model_of(model),
                          {std::move(pairs), std::move(joints), settings, std::move(controller),
                           std::move(q0), std::move(v0), std::move(sensors)});
         },
         "model"_a, "pairs"_a, "joints"_a.none(), "controller"_a.none(), "q0"_a, "v0"_a,
         "settings"_a, "sensors"_a)
      .def("differentiate",
           [](Run& self, std::vector<Parameter> parameters, bool by_q0, bool by_v0) {
             const SensitivitySettings settings{std::move(parameters), by_q0, by_v0};
             call_alone(self, "differentiate", &Simulation::differentiate, settings);
           })
      .def("take_sensitivities", alone("take", &Simulation::take_sensitivities))
      .def(
          "advance",
          [](Run& self, double wall_seconds, double until) {
            const Use use(self.user, "advance");
            const ReleaseGil released;
            return as_python(self.simulation.advance(wall_seconds, until));
          },
          "wall_seconds"_a, "until"_a = std::numeric_limits<double>::infinity())
      .def("deep_start", alone("start", &Simulation::deep_start))
      .def("change", alone("change", &Simulation::change), "pairs"_a, "joints"_a.none(),
           "controller"_a.none())
      .def("take_over",
           [](Run& self, const Run& before) {
             call_alone(self, "take_over", &Simulation::take_over, before.simulation);
           })
      .def("push",
           [](Run& self, int joint, const Vec3& point, const Vec3& force_world,
              const Vec3& anchor_world, double stiffness, double damping, int frame) {
             const PointForce push{force_world, anchor_world, stiffness, damping};
             call_alone(self, "push", &Simulation::push, joint, point, push, frame);
           })
      .def("record_patches", alone("record", &Simulation::record_patches))
      .def("resume", alone("resume", &Simulation::resume))
      .def("record_torques", alone("record_torques", &Simulation::record_torques))
      .def("take", record("take", &Simulation::take))
      .def("snapshot", record("snapshot", &Simulation::snapshot))
      .def_prop_ro(
          "controller_remembers",
          [](Run& self) { return call_alone(self, "state", &Simulation::controller_remembers); })
      .def_prop_ro("progress",
                   [](Run& self) { return call_alone(self, "state", &Simulation::progress); });
  // State and figures at any time during the run.
  bind_figures(run, [](Run& self) {
    const Use use(self.user, "state");
    return self.simulation.figures();
  });
}
