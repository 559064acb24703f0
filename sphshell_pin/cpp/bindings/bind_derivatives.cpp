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
          [](T& self, const VectorX& q, const VectorX& v, const VectorX& tau,
             const std::vector<const Parameter*>& parameters, int repeat) {
            return self.at(q, v, [&](SceneData& scene, auto&& evaluate) {
              check_count("tau", tau.size(), v.size());
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
              return nb::make_tuple(to_array(acceleration),
                                    to_array(MatrixX(jacobian.topLeftCorner(nv, nv))),
                                    to_array(MatrixX(jacobian.block(0, nv, nv, nv))),
                                    to_array(MatrixX(linearization.inverse_mass())),
                                    to_array(MatrixX(linearization.by_parameters().topRows(nv))));
            });
          },
          nb::arg("q"), nb::arg("v"), nb::arg("tau"), nb::arg("parameters"), nb::arg("repeat") = 1)
      .def("contact_force_derivatives",
           [](T& self, const VectorX& q, const VectorX& v,
              const std::vector<const Parameter*>& parameters) {
             return self.at(q, v, [&](SceneData& scene, auto&& evaluate) {
               Linearization& linearization = evaluate.linearization();
               linearization.set_parameters(copies(parameters));
               evaluate();
               ContactForceSlopes out;
               linearization.contact_forces(q, v, out);
               linearization.set_parameters({});
               std::vector<ContactRow> rows;
               scene.log(q, v, rows);
               return nb::make_tuple(to_bytes(std::move(rows)), to_array(MatrixX(out.force_world)),
                                     to_array(MatrixX(out.normal_force)),
                                     to_array(MatrixX(out.depth)));
             });
           })
      .def("step_derivatives", [](T& self, const std::string& integrator, double dt,
                                  const VectorX& q, const VectorX& v, const VectorX& tau,
                                  const std::vector<const Parameter*>& parameters) {
        return self.at(q, v, [&](SceneData& scene, auto&& evaluate) {
          check_count("tau", tau.size(), v.size());
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
          const Eigen::Index nv = v.size(), first = static_cast<Eigen::Index>(parameters.size()),
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
          return nb::make_tuple(
              to_array(end.q), to_array(end.v), to_array(MatrixX(by.middleCols(first, 2 * nv))),
              to_array(MatrixX(by.rightCols(nv))), to_array(MatrixX(by.leftCols(first))));
        });
      });
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
