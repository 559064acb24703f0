#include "bindings/interop.hpp"

#include <memory>

#include "bindings/evaluations.hpp"
#include "bindings/records.hpp"
#include "dynamics/derivatives/sensitivities.hpp"
#include "dynamics/integrators/table.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace sphshell {
namespace {

class HeldTorques : public Torques {
 public:
  explicit HeldTorques(const VectorX& tau) : tau_(tau) {}
  const VectorX& torque(double, const VectorX&, const VectorX&) override { return tau_; }
  bool follow_state() const override { return false; }
  bool follow_time() const override { return false; }

 private:
  const VectorX& tau_;
};

// Explicit fixed steps hold bristles back; the scene of a pool is left as it was.
class Relaxed {
 public:
  Relaxed(SceneData& scene, double time) : scene_(scene), before_(scene.least_relaxation()) {
    scene.relax_in(time);
  }
  ~Relaxed() { scene_.relax_in(before_); }

 private:
  SceneData& scene_;
  double before_;
};

template <class T>
void bind(nb::class_<T>& bound) {
  bound
      .def(
          "dynamics_derivatives",
          [](T& self, nb::handle given_q, nb::handle given_v, nb::handle given_tau,
             const std::vector<const Parameter*>& parameters, int repeat) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, given_tau);
            return self.at(
                q, v, [&, &q = q, &v = v, &tau = tau](SceneData& scene, auto&& evaluate) {
                  Linearization& linearization = evaluate.linearization();
                  linearization.set_parameters(copies(parameters));
                  const VectorX z = self.bristles(scene);
                  MatrixX jacobian;
                  VectorX acceleration;
                  for (int i = 0; i < repeat; ++i) {
                    evaluate();
                    acceleration = scene.acceleration(q, v, tau);
                    linearization.rates(q, v, z, tau, jacobian);
                  }
                  linearization.set_parameters({});
                  const Eigen::Index nv = v.size();
                  return nb::make_tuple(
                      read_only_array(acceleration),
                      read_only_array(MatrixX(jacobian.topLeftCorner(nv, nv))),
                      read_only_array(MatrixX(jacobian.block(0, nv, nv, nv))),
                      read_only_array(MatrixX(linearization.inverse_mass())),
                      read_only_array(MatrixX(linearization.by_parameters().topRows(nv))));
                });
          },
          nb::arg("q"), nb::arg("v").none(), nb::arg("tau").none(), nb::arg("parameters"),
          nb::arg("repeat") = 1)
      .def(
          "contact_force_derivatives",
          [](T& self, nb::handle given_q, nb::handle given_v,
             const std::vector<const Parameter*>& parameters) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, nb::none());
            return self.at(q, v, [&, &q = q, &v = v](SceneData& scene, auto&& evaluate) {
              Linearization& linearization = evaluate.linearization();
              linearization.set_parameters(copies(parameters));
              evaluate();
              ContactForceSlopes out;
              linearization.contact_forces(q, v, out);
              linearization.set_parameters({});
              std::vector<ContactRow> rows;
              scene.log(q, v, rows);
              return nb::make_tuple(
                  to_bytes(std::move(rows)), read_only_array(MatrixX(out.force_world)),
                  read_only_array(MatrixX(out.normal_force)), read_only_array(MatrixX(out.depth)));
            });
          },
          nb::arg("q"), nb::arg("v").none(), nb::arg("parameters"))
      .def(
          "step_derivatives",
          [](T& self, const std::string& integrator, double dt, nb::handle given_q,
             nb::handle given_v, nb::handle given_tau,
             const std::vector<const Parameter*>& parameters) {
            const auto [q, v, tau] = self.arguments(given_q, given_v, given_tau);
            return self.at(
                q, v, [&, &q = q, &v = v, &tau = tau](SceneData& scene, auto&& evaluate) {
                  const std::unique_ptr<Stepper> stepper = make_stepper(integrator, scene);
                  const Relaxed relaxed(scene, stepper->is_implicit() ? 0 : dt);
                  StepSlopes slopes(scene, copies(parameters));
                  HeldTorques torques(tau);
                  Chart chart(scene, torques);
                  evaluate();
                  const State start{0, q, v, self.bristles(scene), {}};
                  State end;
                  chart.begin(start);
                  scene.evaluate(q, v, start.z, true);
                  stepper->begin(chart);
                  stepper->step(chart, dt, end);
                  const Eigen::Index nv = v.size(),
                                     first = static_cast<Eigen::Index>(parameters.size()),
                                     all = first + 3 * nv;
                  Tangent tangent{MatrixX::Zero(nv, all), MatrixX::Zero(nv, all),
                                  MatrixX::Zero(start.z.size(), all)};
                  MatrixX torque = MatrixX::Zero(nv, all);
                  tangent.q.middleCols(first, nv).setIdentity();
                  tangent.v.middleCols(first + nv, nv).setIdentity();
                  torque.rightCols(nv).setIdentity();
                  slopes.carry(chart, *stepper, dt, torque, tangent);
                  scene.restart();
                  MatrixX by(2 * nv, all);
                  by << tangent.q, tangent.v;
                  return nb::make_tuple(read_only_array(end.q), read_only_array(end.v),
                                        read_only_array(MatrixX(by.middleCols(first, 2 * nv))),
                                        read_only_array(MatrixX(by.rightCols(nv))),
                                        read_only_array(MatrixX(by.leftCols(first))));
                });
          },
          nb::arg("integrator"), nb::arg("dt"), nb::arg("q"), nb::arg("v").none(),
          nb::arg("tau").none(), nb::arg("parameters"));
}

}  // namespace
}  // namespace sphshell

void bind_derivatives(nanobind::module_& m, nanobind::class_<sphshell::Evaluations>& scene,
                      nanobind::class_<sphshell::OwnState>& state) {
  using namespace sphshell;
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
          nb::arg("pair"), nb::arg("kind"), nb::arg("axis") = 0,
          nb::arg("less").none() = nb::none(), nb::arg("more").none() = nb::none(),
          nb::arg("step") = 0.0, nb::arg("scale") = 1.0);
  bind(scene);
  bind(state);
}
