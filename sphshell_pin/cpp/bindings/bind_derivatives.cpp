#include "bindings/evaluations.hpp"
#include "bindings/held_step.hpp"
#include "bindings/records.hpp"

#include <nanobind/stl/vector.h>

using namespace sphshell;

template <class T>
static void bind(nb::class_<T>& bound) {
  bound
      .def(
          "dynamics_derivatives",
          [](T& self, nb::handle given_q, nb::handle given_v, nb::handle given_tau,
             std::vector<Parameter> parameters, int repeat) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, given_tau);
            return self.at(
                q, v, [&, &q = q, &v = v, &tau = tau](SceneData& scene, auto&& evaluate) {
                  Linearization& linearization = evaluate.linearization();
                  linearization.set_parameters(std::move(parameters));
                  const VectorX z = self.bristles(scene);
                  MatrixX jacobian;
                  VectorX acceleration;
                  // Repeated for timing alone.
                  for (int i = 0; i < repeat; ++i) {
                    evaluate();
                    acceleration = scene.acceleration(q, v, tau);
                    linearization.rates(q, v, z, tau, jacobian);
                  }
                  linearization.set_parameters({});
                  const Eigen::Index nv = v.size();
                  return nb::make_tuple(read_only_array(acceleration),
                                        read_only_array(jacobian.topLeftCorner(nv, nv)),
                                        read_only_array(jacobian.block(0, nv, nv, nv)),
                                        read_only_array(linearization.inverse_mass()),
                                        read_only_array(linearization.by_parameters().topRows(nv)));
                });
          },
          "q"_a, "v"_a.none(), "tau"_a.none(), "parameters"_a, "repeat"_a = 1)
      .def(
          "contact_force_derivatives",
          [](T& self, nb::handle given_q, nb::handle given_v, std::vector<Parameter> parameters) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, nb::none());
            return self.at(q, v, [&, &q = q, &v = v](SceneData& scene, auto&& evaluate) {
              Linearization& linearization = evaluate.linearization();
              linearization.set_parameters(std::move(parameters));
              evaluate();
              ContactForceSlopes out;
              linearization.contact_forces(q, v, out);
              linearization.set_parameters({});
              std::vector<ContactRow> rows;
              scene.log(q, v, rows);
              return nb::make_tuple(to_bytes(std::move(rows)), read_only_array(out.force_world),
                                    read_only_array(out.normal_force), read_only_array(out.depth));
            });
          },
          "q"_a, "v"_a.none(), "parameters"_a)
      .def(
          "step_derivatives",
          [](T& self, const std::string& integrator, double dt, nb::handle given_q,
             nb::handle given_v, nb::handle given_tau, std::vector<Parameter> parameters) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, given_tau);
            return self.at(q, v, [&, &q = q, &v = v, &tau = tau](SceneData& scene, auto&&) {
              const Eigen::Index nv = v.size(), first = Eigen::Index(parameters.size());
              // Made before the scene is evaluated: it asks contacts for their derivatives.
              StepSlopes slopes(scene, std::move(parameters));
              HeldStep step(scene, integrator, dt, q, v, self.bristles(scene), tau);
              const State& end = step.take();
              const MatrixX by = step.derivatives(slopes).topRows(2 * nv);
              return nb::make_tuple(read_only_array(end.q), read_only_array(end.v),
                                    read_only_array(by.middleCols(first, 2 * nv)),
                                    read_only_array(by.rightCols(nv)),
                                    read_only_array(by.leftCols(first)));
            });
          },
          "integrator"_a, "dt"_a, "q"_a, "v"_a.none(), "tau"_a.none(), "parameters"_a);
}

void bind_derivatives(nb::module_& m, nb::class_<Evaluations>& scene, nb::class_<OwnState>& state) {
  // A parameter as two pairs, with the number less and more a step; of what moves a body, kind and
  // axis alone.
  nb::class_<Parameter>(m, "Parameter")
      .def(
          "__init__",
          [](Parameter* self, int pair, int kind, int axis, const Pair* less, const Pair* more,
             double step, double scale) {
            new (self) Parameter{pair,
                                 static_cast<Parameter::Kind>(kind),
                                 axis,
                                 less ? *less : Pair(),
                                 more ? *more : Pair(),
                                 step,
                                 scale};
          },
          "pair"_a, "kind"_a, "axis"_a = 0, "less"_a.none() = nb::none(),
          "more"_a.none() = nb::none(), "step"_a = 0.0, "scale"_a = 1.0);
  bind(scene);
  bind(state);
}
