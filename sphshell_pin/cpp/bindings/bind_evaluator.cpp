#include "bindings/interop.hpp"

#include <vector>

#include "bindings/evaluations.hpp"
#include "dynamics/contact_row.hpp"
#include "dynamics/linearization.hpp"

#include <nanobind/eigen/dense.h>

// Names of its own, as files may be compiled together.
namespace sphshell::evaluator {
namespace {

using Out = Eigen::Ref<VectorX>;
using Columns = Eigen::Ref<MatrixX>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Rows = Eigen::Ref<RowMajor>;

constexpr int kForce = 4;  // numbers of a pair: normal force, force in the world

// Evaluates at q, v with bristles unstretched.
void evaluate(SceneData& scene, const VectorX& q, const VectorX& v) {
  scene.restart();
  scene.evaluate(q, v, VectorX::Zero(scene.bristle_size()));
}

void check_forces(const SceneData& scene, const Rows& forces, Eigen::Index columns) {
  check_count("rows of forces", forces.rows(),
              kForce * static_cast<Eigen::Index>(scene.pairs().size()));
  check_count("columns of forces", forces.cols(), columns);
}

// Fills acceleration (nv), and forces (4 pairs, 1).
void evaluate_into(Evaluations& self, const VectorX& q, const VectorX& v, const VectorX& tau,
                   Out acceleration, Rows forces) {
  self.at(q, v, [&](SceneData& scene, auto&&) {
    check_count("tau", tau.size(), v.size());
    check_count("acceleration", acceleration.size(), v.size());
    check_forces(scene, forces, 1);
    evaluate(scene, q, v);
    acceleration = scene.acceleration(q, v, tau);
    forces.setZero();
    if (!scene.touching()) return;
    std::vector<ContactRow> rows;
    scene.log(q, v, rows);
    for (const ContactRow& row : rows) {
      auto force = forces.col(0).segment<kForce>(kForce * row.pair);
      force[0] += row.normal_force;
      force.tail<3>() += row.normal_force * Eigen::Map<const Vec3>(row.normal) +
                         Eigen::Map<const Vec3>(row.friction_force);
    }
  });
}

// Fills by_state (nv, 2 nv), by_tau (nv, nv), and forces_by_state (4 pairs, 2 nv).
void differentiate_into(Evaluations& self, const VectorX& q, const VectorX& v, const VectorX& tau,
                        Columns by_state, Columns by_tau, Rows forces_by_state) {
  self.at(q, v, [&](SceneData& scene, auto&&) {
    const Eigen::Index nv = v.size();
    check_count("tau", tau.size(), nv);
    check_count("rows of by_state", by_state.rows(), nv);
    check_count("columns of by_state", by_state.cols(), 2 * nv);
    check_count("rows of by_tau", by_tau.rows(), nv);
    check_count("columns of by_tau", by_tau.cols(), nv);
    check_forces(scene, forces_by_state, 2 * nv);
    Linearization linearization(scene);
    evaluate(scene, q, v);
    MatrixX jacobian;
    linearization.rates(q, v, VectorX::Zero(scene.bristle_size()), tau, jacobian);
    by_state = jacobian.topLeftCorner(nv, 2 * nv);
    by_tau = linearization.inverse_mass();
    forces_by_state.setZero();
    if (!scene.touching()) return;
    std::vector<ContactRow> rows;
    scene.log(q, v, rows);
    ContactForceSlopes slopes;
    linearization.contact_forces(q, v, slopes);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      auto force = forces_by_state.middleRows<kForce>(kForce * rows[k].pair);
      force.row(0) += slopes.normal_force.row(k).head(2 * nv);
      force.bottomRows<3>() += slopes.force_world.middleRows<3>(3 * k).leftCols(2 * nv);
    }
  });
}

}  // namespace
}  // namespace sphshell::evaluator

void bind_evaluator(nanobind::module_& m) {
  using namespace sphshell;
  using namespace sphshell::evaluator;
  m.def("evaluate_into", &evaluate_into, nb::arg("scene"), nb::arg("q"), nb::arg("v"),
        nb::arg("tau"), nb::arg("acceleration").noconvert(), nb::arg("forces").noconvert());
  m.def("differentiate_into", &differentiate_into, nb::arg("scene"), nb::arg("q"), nb::arg("v"),
        nb::arg("tau"), nb::arg("by_state").noconvert(), nb::arg("by_tau").noconvert(),
        nb::arg("forces_by_state").noconvert());
}
