#include "bindings/interop.hpp"

#include <memory>

#include "bindings/gil.hpp"
#include "bindings/own_errors.hpp"
#include "bindings/records.hpp"
#include "dynamics/rollout.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace sphshell {
namespace {

// Energy stored and lost less the controller's work, from the first row to the last [J].
double residual(const std::vector<double>& energy) {
  constexpr int n = Record::kEnergies;
  if (energy.empty()) return 0;
  double sum = 0;
  const double *first = energy.data(), *last = energy.data() + energy.size() - n;
  for (int i = 0; i < n; ++i) sum += (i == n - 1 ? -1 : 1) * (last[i] - first[i]);
  return sum;
}

nb::dict to_dict(const Outcome& outcome) {
  nb::dict out;
  nb::list through;
  for (const Event& event : outcome.record.events)
    if (event.kind == Event::Kind::Through) through.append(event.pair);
  out["through"] = through;
  out["residual"] = residual(outcome.record.energy);
  out["status"] = static_cast<int>(outcome.status);
  out["fault"] = outcome.fault;
  out["time"] = outcome.time;
  out["last_step"] = outcome.last_step;
  out["wall_time"] = outcome.wall_time;
  out["steps"] = outcome.steps;
  out["rejected"] = outcome.rejected;
  out["evaluations"] = outcome.evaluations;
  out["q"] = outcome.q;
  out["v"] = outcome.v;
  out["summaries"] = to_list(outcome.summaries);
  return out;
}

}  // namespace
}  // namespace sphshell

void bind_rollout(nanobind::module_& m) {
  using namespace sphshell;
  nb::class_<Rollout>(m, "Rollout")
      .def(
          "__init__",
          [](Rollout* self, nb::handle model, int threads) {
            new (self) Rollout(model_of(model), threads);
          },
          nb::arg("model"), nb::arg("threads"))
      .def(
          "add",
          [](Rollout& self, const std::vector<const Pair*>& pairs,
             std::shared_ptr<Controller> controller, VectorX q0, VectorX v0,
             const RunSettings& settings) {
            check_count("q0", q0.size(), self.model().nq);
            check_count("v0", v0.size(), self.model().nv);
            self.add(
                {copies(pairs), settings, std::move(controller), std::move(q0), std::move(v0)});
          },
          nb::arg("pairs"), nb::arg("controller").none(), nb::arg("q0"), nb::arg("v0"),
          nb::arg("settings"))
      // Threads may want the interpreter for a user's routine.
      .def(
          "wait",
          [](Rollout& self, std::size_t left, double seconds) {
            self.give_back();
            const ReleaseGil released;
            return self.wait(left, seconds);
          },
          nb::arg("left"), nb::arg("seconds"))
      .def("stop",
           [](Rollout& self) {
             {
               const ReleaseGil released;
               self.stop();
             }
             self.give_back();
           })
      .def("__len__", [](const Rollout& self) { return self.outcomes().size(); })
      .def("outcome", [](const Rollout& self,
                         std::size_t number) { return to_dict(self.outcomes().at(number)); })
      .def("record", [](const Rollout& self, std::size_t number) {
        const auto& model = self.model();
        return to_dict(self.outcomes().at(number).record, model.nq, model.nv);
      });
}
