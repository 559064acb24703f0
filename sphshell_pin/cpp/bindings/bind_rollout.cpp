#include "bindings/evaluations.hpp"
#include "bindings/gil.hpp"
#include "bindings/records.hpp"
#include "dynamics/run/rollout.hpp"

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

using namespace sphshell;

// Energy stored and lost less the controller's work, from the first row to the last [J].
static double residual(const std::vector<double>& energy) {
  constexpr int n = Record::kEnergies;
  if (energy.empty()) return 0;
  double sum = 0;
  const double *first = energy.data(), *last = energy.data() + energy.size() - n;
  for (int i = 0; i < n; ++i) sum += (i == n - 1 ? -1 : 1) * (last[i] - first[i]);
  return sum;
}

// The pairs whose sphere went through their shell.
static nb::list through(const Outcome& outcome) {
  nb::list pairs;
  for (const Event& event : outcome.record.events)
    if (event.kind == Event::Kind::Through) pairs.append(event.pair);
  return pairs;
}

void bind_rollout(nb::module_& m) {
  // What a run of a rollout leaves behind; its record is converted only when it is asked for.
  nb::class_<Outcome> outcome(m, "Outcome");
  outcome.def_prop_ro("status", [](const Outcome& self) { return as_python(self.status); })
      .def_ro("fault", &Outcome::fault)
      .def_prop_ro("deep_start", [](const Outcome& self) { return as_python(self.deep_start); })
      .def_prop_ro("residual", [](const Outcome& self) { return residual(self.record.energy); })
      .def_prop_ro("through", &through);
  bind_figures<Outcome>(outcome,
                        [](const Outcome& self, auto figure) { return as_python(self.*figure); });

  // Runs of one model on threads of their own.
  nb::class_<Rollout>(m, "Rollout")
      .def("__init__", [](Rollout* self, nb::handle model,
                          int threads) { new (self) Rollout(model_of(model), threads); })
      .def(
          "add",
          [](Rollout& self, std::vector<Pair> pairs, JointForces::Effects joints,
             std::shared_ptr<Controller> controller, VectorX q0, VectorX v0,
             const RunSettings& settings, std::vector<Sensor> sensors) {
            check_state(self.model(), q0, v0);
            self.add({std::move(pairs), std::move(joints), settings, std::move(controller),
                      std::move(q0), std::move(v0), std::move(sensors)});
          },
          "pairs"_a, "joints"_a.none(), "controller"_a.none(), "q0"_a, "v0"_a, "settings"_a,
          "sensors"_a)
      // Threads may want the interpreter for a user's routine.
      .def("wait",
           [](Rollout& self, std::size_t left, double seconds) {
             self.give_back();
             const ReleaseGil released;
             // What finished runs lent is released first, under the interpreter's lock.
             return self.wait(left, seconds);
           })
      .def("stop",
           [](Rollout& self) {
             {
               const ReleaseGil released;
               self.stop();
             }
             self.give_back();
           })
      .def("__len__", [](const Rollout& self) { return self.outcomes().size(); })
      .def(
          "outcome",
          [](const Rollout& self, std::size_t number) -> const Outcome& {
            return self.outcomes().at(number);
          },
          nb::rv_policy::reference_internal)
      .def("record", [](const Rollout& self, std::size_t number) {
        const auto& model = self.model();
        return to_dict(self.outcomes().at(number).record, model.nq, model.nv);
      });
}
