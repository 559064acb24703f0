#include "bindings/evaluations.hpp"
#include "bindings/held_step.hpp"

// Names of its own, as files may be compiled together.
namespace sphshell::evaluator {
namespace {

using Out = Eigen::Ref<VectorX>;
using Columns = Eigen::Ref<MatrixX>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Rows = Eigen::Ref<RowMajor>;

constexpr int kForce = 4;  // numbers of a pair: normal force, force in the world

// Arrays are written in place: their sizes must be right.
template <class Matrix>
void check_shape(const char* name, const Matrix& x, Eigen::Index rows, Eigen::Index columns) {
  if (x.rows() == rows && x.cols() == columns) return;
  raise_own("InvalidParameter", name, nb::make_tuple(x.rows(), x.cols()),
            "must have shape (" + std::to_string(rows) + ", " + std::to_string(columns) + ")");
}

// Clears the forces of each pair: 4 pairs rows.
void clear(const SceneData& scene, Rows forces, Eigen::Index columns) {
  check_shape("forces", forces, kForce * static_cast<Eigen::Index>(scene.pairs().size()), columns);
  forces.setZero();
}

// Adds up the forces of each pair, in one column.
void sum_forces(const At& at, Rows forces) {
  clear(at.scene, forces, 1);
  if (!at.scene.touching()) return;
  for (const ContactRow& row : at.rows()) {
    auto force = forces.col(0).segment<kForce>(kForce * row.pair);
    force[0] += row.normal_force;
    force.tail<3>() += row.normal_force * Eigen::Map<const Vec3>(row.normal) +
                       Eigen::Map<const Vec3>(row.friction_force);
  }
}

// The same of their derivatives by q and v: 2 nv columns.
void sum_slopes(Linearization& linearization, const At& at, Rows slopes) {
  const Eigen::Index columns = 2 * at.v.size();
  clear(at.scene, slopes, columns);
  if (!at.scene.touching()) return;
  const std::vector<ContactRow> rows = at.rows();
  ContactForceSlopes found;
  linearization.contact_forces(at.q, at.v, found);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    auto force = slopes.middleRows<kForce>(kForce * rows[k].pair);
    force.row(0) += found.normal_force.row(k).head(columns);
    force.bottomRows<3>() += found.force_world.middleRows<3>(3 * k).leftCols(columns);
  }
}

// Fills acceleration (nv), and the forces.
void evaluate_into(Evaluations& self, const VectorX& q, const VectorX& v, const VectorX& tau,
                   Out acceleration, Rows forces) {
  self.at(q, v, [&](const At& at) {
    check_count("tau", tau.size(), v.size());
    check_count("acceleration", acceleration.size(), v.size());
    at.evaluate();
    acceleration = at.scene.acceleration(q, v, tau);
    sum_forces(at, forces);
  });
}

// Fills by_state (nv, 2 nv), by_tau (nv, nv), and those of the forces.
void differentiate_into(Evaluations& self, const VectorX& q, const VectorX& v, const VectorX& tau,
                        Columns by_state, Columns by_tau, Rows forces_by_state) {
  self.at(q, v, [&](const At& at) {
    const Eigen::Index nv = v.size();
    check_count("tau", tau.size(), nv);
    check_shape("by_state", by_state, nv, 2 * nv);
    check_shape("by_tau", by_tau, nv, nv);
    Linearization& linearization = at.state.linearization();
    at.evaluate();
    MatrixX jacobian;
    // Rows of accelerations, columns of (u, v): those of bristles are left out.
    linearization.rates(q, v, at.state.bristles(), tau, jacobian);
    by_state = jacobian.topLeftCorner(nv, 2 * nv);
    by_tau = linearization.inverse_mass();
    sum_slopes(linearization, at, forces_by_state);
  });
}

// Fills next (nq + nv), where a step leads, and the forces at its start.
void step_into(Evaluations& self, const std::string& integrator, double dt, const VectorX& q,
               const VectorX& v, const VectorX& tau, Out next, Rows forces) {
  self.at(q, v, [&](const At& at) {
    check_count("tau", tau.size(), v.size());
    check_count("next", next.size(), q.size() + v.size());
    HeldStep step(at, integrator, dt, tau);
    sum_forces(at, forces);
    const State& end = step.take();
    next << end.q, end.v;
  });
}

// Fills by_state (2 nv, 2 nv), by_tau (2 nv, nv), and those of the forces at the start.
void differentiate_step_into(Evaluations& self, const std::string& integrator, double dt,
                             const VectorX& q, const VectorX& v, const VectorX& tau,
                             Columns by_state, Columns by_tau, Rows forces_by_state) {
  self.at(q, v, [&](const At& at) {
    const Eigen::Index nv = v.size();
    check_count("tau", tau.size(), nv);
    check_shape("by_state", by_state, 2 * nv, 2 * nv);
    check_shape("by_tau", by_tau, 2 * nv, nv);
    StepSlopes slopes(at.scene, {});
    HeldStep step(at, integrator, dt, tau);
    sum_slopes(slopes.linearization(), at, forces_by_state);
    step.take();
    const MatrixX by = step.derivatives(slopes).topRows(2 * nv);
    by_state = by.leftCols(2 * nv);
    by_tau = by.rightCols(nv);
  });
}

// A frame of the model, at `placement` in a joint, against a reference in the world.
struct Frame {
  int joint;
  pinocchio::SE3 placement, reference;

  pinocchio::SE3 place(const Multibody& body) const { return body.world_from(joint, placement); }
};

// Fills residual: (3), the place against that of the reference, or (6), log6 of the placement in
// the reference.
void frame_into(Evaluations& self, const Frame& frame, const VectorX& q, Out residual) {
  self.at(q, VectorX::Zero(self.model().nv), [&](const At& at) {
    at.scene.body().need(frame.joint);
    at.scene.body().kinematics(q);
    const pinocchio::SE3 world_from_frame = frame.place(at.scene.body());
    if (residual.size() == 3)
      residual = world_from_frame.translation() - frame.reference.translation();
    else
      residual = pinocchio::log6(frame.reference.actInv(world_from_frame)).toVector();
  });
}

// Fills by_q (3 or 6, nv), in the tangent space of q.
void differentiate_frame_into(Evaluations& self, const Frame& frame, const VectorX& q,
                              Columns by_q) {
  const VectorX v = VectorX::Zero(self.model().nv);
  check_count("columns of by_q", by_q.cols(), v.size());
  self.at(q, v, [&](const At& at) {
    Multibody& body = at.scene.body();
    at.state.linearization();  // prepares the axes
    body.need(frame.joint);
    body.place_axes(q);
    const pinocchio::SE3 world_from_frame = frame.place(body);
    Chain chain(body.model(), 0, frame.joint);
    // Twists in the frame.
    chain.place(body, world_from_frame, v);
    Matrix6 slope = Matrix6::Identity();
    if (by_q.rows() == 3)
      slope.topLeftCorner<3, 3>() = world_from_frame.rotation();
    else
      // d log6(M exp(x)) / dx at x = 0, with twists in the frame itself.
      pinocchio::Jlog6(frame.reference.actInv(world_from_frame), slope);
    by_q.setZero();
    for (int k = 0; k < chain.size(); ++k)
      by_q.col(chain.velocity(k)) += slope.topRows(by_q.rows()) * chain.axes().col(k);
  });
}

}  // namespace
}  // namespace sphshell::evaluator

void bind_evaluator(nanobind::module_& m) {
  using namespace sphshell;
  using namespace sphshell::evaluator;
  // Outputs are written where the optimizer wants them: noconvert() refuses what would have to be
  // copied.
  m.def("evaluate_into", &evaluate_into, "scene"_a, "q"_a, "v"_a, "tau"_a,
        "acceleration"_a.noconvert(), "forces"_a.noconvert());
  m.def("differentiate_into", &differentiate_into, "scene"_a, "q"_a, "v"_a, "tau"_a,
        "by_state"_a.noconvert(), "by_tau"_a.noconvert(), "forces_by_state"_a.noconvert());
  nb::class_<Frame>(m, "Frame")
      .def(nb::init<int, pinocchio::SE3, pinocchio::SE3>(), "joint"_a, "placement"_a,
           "reference"_a);
  m.def("frame_into", &frame_into, "scene"_a, "frame"_a, "q"_a, "residual"_a.noconvert());
  m.def("differentiate_frame_into", &differentiate_frame_into, "scene"_a, "frame"_a, "q"_a,
        "by_q"_a.noconvert());
  m.def("step_into", &step_into, "scene"_a, "integrator"_a, "dt"_a, "q"_a, "v"_a, "tau"_a,
        "next"_a.noconvert(), "forces"_a.noconvert());
  m.def("differentiate_step_into", &differentiate_step_into, "scene"_a, "integrator"_a, "dt"_a,
        "q"_a, "v"_a, "tau"_a, "by_state"_a.noconvert(), "by_tau"_a.noconvert(),
        "forces_by_state"_a.noconvert());
}
