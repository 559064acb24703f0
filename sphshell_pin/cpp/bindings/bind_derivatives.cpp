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
          [](T& self, nb::handle q, nb::handle v, nb::handle tau, std::vector<Parameter> parameters,
             int repeat) {
            return at_given(self, q, v, tau, [&](const At& at, const VectorX& tau) {
              Linearization& linearization = at.state.linearization();
              linearization.set_parameters(std::move(parameters));
              MatrixX jacobian;
              VectorX acceleration;
              // Repeated for timing alone.
              for (int i = 0; i < repeat; ++i) {
                at.evaluate();
                acceleration = at.scene.acceleration(at.q, at.v, tau);
                linearization.rates(at.q, at.v, at.state.bristles(), tau, jacobian);
              }
              linearization.set_parameters({});
              const Eigen::Index nv = at.v.size();
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
          [](T& self, nb::handle q, nb::handle v, std::vector<Parameter> parameters) {
            return at_given(self, q, v, nb::none(), [&](const At& at, auto&&) {
              Linearization& linearization = at.state.linearization();
              linearization.set_parameters(std::move(parameters));
              at.evaluate();
              ContactForceSlopes out;
              linearization.contact_forces(at.q, at.v, out);
              linearization.set_parameters({});
              return nb::make_tuple(to_bytes(at.rows()), read_only_array(out.force_world),
                                    read_only_array(out.normal_force), read_only_array(out.depth));
            });
          },
          "q"_a, "v"_a.none(), "parameters"_a)
      .def(
          "step_derivatives",
          [](T& self, const std::string& integrator, double dt, nb::handle q, nb::handle v,
             nb::handle tau, std::vector<Parameter> parameters) {
            return at_given(self, q, v, tau, [&](const At& at, const VectorX& tau) {
              const Eigen::Index nv = at.v.size(), first = Eigen::Index(parameters.size());
              // Made before the scene is evaluated: it asks contacts for their derivatives.
              StepSlopes slopes(at.scene, std::move(parameters));
              HeldStep step(at, integrator, dt, tau);
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
