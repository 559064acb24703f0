#include "dynamics/scene/multibody.hpp"

#include <algorithm>
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include "dynamics/compiled/compiled_robot.hpp"

namespace sphshell {
namespace {

constexpr double kDifference = 1e-5;  // step of central differences in q [m or rad]

// Segments of rotations, of planar and of rigid motion, also within composite joints.
void find_curved(const pinocchio::JointModel& joint, std::vector<CurvedSegment>& out) {
  if (const auto* whole = boost::get<pinocchio::JointModelComposite>(&joint)) {
    for (const auto& part : whole->joints) find_curved(part, out);
    return;
  }
  for (const auto& [kind, linear, angular] : {std::tuple("JointModelFreeFlyer", 3, 3),
                                              {"JointModelSpherical", 0, 3},
                                              {"JointModelPlanar", 2, 1}})
    if (joint.shortname() == kind) out.push_back({linear, angular, joint.idx_v(), joint.idx_q()});
}

// Of one joint, as Pinocchio takes them one after the other: its placement and velocity; its axes.
template <template <class, int, template <class, int> class, class...> class Step, class... Vector>
using StepOf = Step<double, 0, pinocchio::JointCollectionDefaultTpl, Vector...>;
using Axes = StepOf<pinocchio::impl::JointJacobiansForwardStep, VectorX, Matrix6X>;

// Compiled code writes placements, velocities and forces as numbers in a row.
static_assert(sizeof(pinocchio::SE3) == 12 * sizeof(double));
static_assert(sizeof(pinocchio::Motion) == 6 * sizeof(double));
static_assert(sizeof(pinocchio::Force) == 6 * sizeof(double));

// True where each subtree's joints have consecutive numbers, as Pinocchio's derivatives need them.
bool depth_first(const pinocchio::Model& model) {
  for (int j = 1; j < model.njoints; ++j)
    if (model.subtrees[j].back() - j + 1 != model.subtrees[j].size()) return false;
  return true;
}

// Without the second derivatives, which nothing here computes: they take the cube of the number of
// velocities, 160 MB of 28 free bodies.
pinocchio::Data data_of(const pinocchio::Model& model) {
  pinocchio::Data data(model);
  for (auto* unused : {&data.d2tau_dqdq, &data.d2tau_dvdv, &data.d2tau_dqdv, &data.d2tau_dadq})
    unused->resize(0, 0, 0);
  return data;
}

}  // namespace

Multibody::Multibody(const pinocchio::Model& model)
    : model_(model),
      data_(data_of(model_)),
      zero_(VectorX::Zero(model_.nv)),
      mimics_(!model_.mimicking_joints.empty()) {
  for (int j = 1; j < model_.njoints; ++j) find_curved(model_.joints[j], curved_);
}

Multibody::Multibody(const Multibody& other) = default;

Multibody::~Multibody() = default;

// With all ancestors, in ascending order: parents have lower numbers.
void Multibody::need(int joint) {
  for (; joint > 0; joint = static_cast<int>(model_.parents[joint])) {
    const auto at = std::lower_bound(needed_.begin(), needed_.end(), joint);
    if (at != needed_.end() && *at == joint) return;
    needed_.insert(at, joint);
  }
}

// The step of Pinocchio's own forward kinematics, for the joints on the way to contacts alone.
template <class Step, class... State>
void Multibody::run_needed(const State&... state) {
  for (int j : needed_)
    Step::run(model_.joints[j], data_.joints[j], typename Step::ArgsType(model_, data_, state...));
}

void Multibody::kinematics(const VectorX& q, const VectorX* v) {
  if (compiled_)
    compiled_->kinematics(needed_.data(), static_cast<int>(needed_.size()), q.data(),
                          v ? v->data() : nullptr, data_.oMi[0].rotation().data(),
                          data_.v[0].toVector().data());
  else if (v)
    run_needed<StepOf<pinocchio::impl::ForwardKinematicFirstStep, VectorX, VectorX>>(q, *v);
  else
    run_needed<StepOf<pinocchio::impl::ForwardKinematicZeroStep, VectorX>>(q);
}

// The composite-rigid-body algorithm (Featherstone 2008, section 6.2) on all joints in world axes.
// Each product of two axes is added where the coordinates of their joints meet: G^T M G, with G the
// velocities of all joints per independent one. Pinocchio's crba is not used, since it is wrong
// where joints are not numbered depth first and where a tree branches behind a mimic joint.
void Multibody::compute_mass(const VectorX& q) {
  for (int j = 1; j < model_.njoints; ++j) {
    Axes::run(model_.joints[j], data_.joints[j], Axes::ArgsType(model_, data_, q, data_.J));
    data_.oYcrb[j] = data_.oMi[j].act(model_.inertias[j]);
  }
  data_.M.setZero();
  data_.M.diagonal() = model_.armature;
  for (int j = model_.njoints - 1; j > 0; --j) {
    for (int c = 0; c < model_.nvExtendeds[j]; ++c) {
      const pinocchio::Motion axis(data_.J.col(model_.idx_vExtendeds[j] + c));
      const pinocchio::Force momentum = data_.oYcrb[j] * axis;
      const int column = model_.idx_vs[j] + c;
      for (int i = j; i > 0; i = static_cast<int>(model_.parents[i]))
        for (int d = 0; d < model_.nvExtendeds[i]; ++d) {
          const double product = data_.J.col(model_.idx_vExtendeds[i] + d).dot(momentum.toVector());
          data_.M(model_.idx_vs[i] + d, column) += product;
          if (i != j) data_.M(column, model_.idx_vs[i] + d) += product;
        }
    }
    if (model_.parents[j] > 0) data_.oYcrb[model_.parents[j]] += data_.oYcrb[j];
  }
}

// M a = tau - bias, by Cholesky's factorization.
const VectorX& Multibody::solve(const VectorX& tau, const VectorX& bias) {
  mass_.compute(data_.M);
  solution_ = tau - bias;
  mass_.solveInPlace(solution_);
  return solution_;
}

const VectorX& Multibody::acceleration(const VectorX& q, const VectorX& v, const VectorX& tau,
                                       const Forces* external) {
  if (!compiled_) return own_acceleration(q, v, tau, external);
  solution_.resize(model_.nv);
  compiled_->acceleration(q.data(), v.data(), tau.data(),
                          external ? external->front().toVector().data() : nullptr,
                          solution_.data());
  return solution_;
}

const VectorX& Multibody::own_acceleration(const VectorX& q, const VectorX& v, const VectorX& tau,
                                           const Forces* external) {
  if (mimics_) {
    compute_mass(q);
    return solve(tau, external ? pinocchio::rnea(model_, data_, q, v, zero_, *external)
                               : pinocchio::rnea(model_, data_, q, v, zero_));
  }
  const VectorRef at(q), rate(v), torque(tau);
  return external ? pinocchio::aba(model_, data_, at, rate, torque, *external)
                  : pinocchio::aba(model_, data_, at, rate, torque);
}

void Multibody::acceleration_derivatives(const VectorX& q, const VectorX& v, const VectorX& tau,
                                         Eigen::Ref<MatrixX> by_q, Eigen::Ref<MatrixX> by_v,
                                         Eigen::Ref<MatrixX> by_tau) {
  if (!differences_) {
    if (!unlocked_) {
      pinocchio::computeABADerivatives(model_, data_, q, v, tau, by_q, by_v, by_tau);
      return;
    }
    // With G the ratios, tau = G^T id(q_all, G v, G a): differentiated at a held torque.
    const VectorX a = own_acceleration(q, v, tau);
    place_unlocked(q);
    auto& [model, data, ratios, id_by_q, id_by_v, id_by_a, q_all] = *unlocked_;
    pinocchio::computeRNEADerivatives(model, data, q_all, VectorX(ratios * v), VectorX(ratios * a),
                                      id_by_q, id_by_v, id_by_a);
    by_tau.setIdentity();
    mass_.solveInPlace(by_tau);
    by_q.noalias() = -by_tau * (ratios.transpose() * id_by_q * ratios);
    by_v.noalias() = -by_tau * (ratios.transpose() * id_by_v * ratios);
    return;
  }
  by_q.setZero();
  by_v.setZero();
  by_tau.setZero();
  for (int m = 0; m < model_.nv; ++m)
    for (const double sign : {1.0, -1.0}) {
      step_.setZero();
      step_[m] = sign * kDifference;
      integrate(q, step_, moved_);
      by_q.col(m) += sign / (2 * kDifference) * own_acceleration(moved_, v, tau);
      // The acceleration is quadratic in v and linear in tau: any step is exact.
      step_ = v;
      step_[m] += sign;
      by_v.col(m) += sign / 2 * own_acceleration(q, step_, tau);
      step_ = tau;
      step_[m] += sign;
      by_tau.col(m) += sign / 2 * own_acceleration(q, v, step_);
    }
}

void Multibody::want_derivatives() {
  turning_.clear();
  // Finds the joints whose axes turn, by trying: the derivative of their motion subspace S by their
  // own coordinates is not zero.
  step_.setLinSpaced(model_.nv, 0.2, 0.7);  // anywhere but at a special place
  moved_ = pinocchio::neutral(model_);
  const VectorX q = pinocchio::integrate(model_, moved_, step_);
  for (int j = 1; j < model_.njoints; ++j) {
    const int nv = model_.nvs[j];
    if (nv == 0) continue;  // its axis is that of a joint with one
    TurningAxes axes{j, Matrix6X::Zero(6, nv * nv)};
    turn_axes(q, axes);
    if (axes.by_q.cwiseAbs().maxCoeff() > 1e-6) turning_.push_back(axes);
  }
  differences_ = !turning_.empty() || !depth_first(model_);
  if (mimics_ && !differences_) unlock();
}

// The same tree with each mimic joint as a joint of its own kind; ratios: the velocities of its
// joints by those of the model.
void Multibody::unlock() {
  pinocchio::Model all;
  all.gravity = model_.gravity;
  for (int j = 1; j < model_.njoints; ++j) {
    const auto* mimic = boost::get<pinocchio::JointModelMimic>(&model_.joints[j]);
    all.addJoint(model_.parents[j], mimic ? mimic->jmodel() : model_.joints[j],
                 model_.jointPlacements[j], model_.names[j]);
    all.inertias[j] = model_.inertias[j];
  }
  MatrixX ratios = MatrixX::Zero(all.nv, model_.nv);
  for (int j = 1; j < model_.njoints; ++j) {
    const auto* mimic = boost::get<pinocchio::JointModelMimic>(&model_.joints[j]);
    for (int i = 0; i < all.nvs[j]; ++i)
      ratios(all.idx_vs[j] + i, model_.joints[j].idx_v() + i) = mimic ? mimic->scaling() : 1;
  }
  const MatrixX zero = MatrixX::Zero(all.nv, all.nv);
  unlocked_.emplace(Unlocked{all, data_of(all), ratios, zero, zero, zero, pinocchio::neutral(all)});
}

// A mimic joint's coordinate is scaling x that of the joint it follows + offset.
void Multibody::place_unlocked(const VectorX& q) {
  const pinocchio::Model& all = unlocked_->model;
  for (int j = 1; j < model_.njoints; ++j) {
    const auto from = q.segment(model_.joints[j].idx_q(), all.nqs[j]);
    auto to = unlocked_->q.segment(all.idx_qs[j], all.nqs[j]);
    if (const auto* mimic = boost::get<pinocchio::JointModelMimic>(&model_.joints[j]))
      pinocchio::configVectorAffineTransform(mimic->jmodel(), from, mimic->scaling(),
                                             mimic->offset(), to);
    else
      to = from;
  }
}

// dS/dq by central differences in the joint's own frame, where nothing but the joint itself moves.
void Multibody::turn_axes(const VectorX& q, TurningAxes& axes) {
  const int nv = model_.nvs[axes.joint], first = model_.idx_vs[axes.joint];
  axes.by_q.setZero();
  for (int m = 0; m < nv; ++m)
    for (const double sign : {1.0, -1.0}) {
      step_.setZero();
      step_[first + m] = sign * kDifference;
      integrate(q, step_, moved_);
      auto& data = data_.joints[axes.joint];
      model_.joints[axes.joint].calc(data, moved_);
      axes.by_q.middleCols(nv * m, nv) += sign / (2 * kDifference) * data.S().matrix();
    }
}

void Multibody::place_axes(const VectorX& q) {
  for (TurningAxes& axes : turning_)
    if (std::binary_search(needed_.begin(), needed_.end(), axes.joint)) turn_axes(q, axes);
  for (int j : needed_)
    Axes::run(model_.joints[j], data_.joints[j], Axes::ArgsType(model_, data_, q, data_.J));
}

const VectorX& Multibody::gravity(const VectorX& q) {
  return pinocchio::computeGeneralizedGravity(model_, data_, q);
}

const VectorX& Multibody::bias(const VectorX& q, const VectorX& v, const Forces& external) {
  return pinocchio::rnea(model_, data_, q, v, zero_, external);
}

// a_gf holds the acceleration less gravity's.
pinocchio::Motion Multibody::drift(int joint) const {
  if (joint == 0) return pinocchio::Motion::Zero();
  return data_.a_gf[joint] + data_.oMi[joint].actInv(model_.gravity);
}

// M^-1 J^T by the factorized mass matrix; J is brought from the joint's frame to the task's.
void Multibody::task(const VectorX& q, int joint, const pinocchio::SE3& frame, Matrix6X& jacobian,
                     MatrixX& mobility) {
  place(q);
  jacobian.setZero(6, model_.nv);
  pinocchio::computeJointJacobian(model_, data_, q, joint, jacobian);
  jacobian = frame.toActionMatrixInverse() * jacobian;
  mobility = jacobian.transpose();
  mass_.solveInPlace(mobility);
}

void Multibody::place(const VectorX& q) {
  compute_mass(q);
  mass_.compute(data_.M);
}

void Multibody::add_jacobian(int joint, const Eigen::Vector3d& point, double factor,
                             MatrixX& out) const {
  for (; joint > 0; joint = static_cast<int>(model_.parents[joint]))
    for (int c = 0; c < model_.nvExtendeds[joint]; ++c) {
      const pinocchio::Motion axis(data_.J.col(model_.idx_vExtendeds[joint] + c));
      out.col(model_.idx_vs[joint] + c) += factor * (axis.linear() + axis.angular().cross(point));
    }
}

MatrixX Multibody::mobility(const MatrixX& jacobian) const {
  const MatrixX half = mass_.matrixL().solve(jacobian.transpose());
  return half.transpose() * half;
}

void Multibody::transmit(const VectorX& q, const VectorX& v, const VectorX& acceleration,
                         const Forces& external) {
  pinocchio::rnea(model_, data_, q, v, acceleration, external);
}

void Multibody::integrate(const VectorX& q, const VectorX& step, VectorX& out) const {
  pinocchio::integrate(model_, q, step, out);
}

void Multibody::difference(const VectorX& q0, const VectorX& q1, VectorX& out) const {
  pinocchio::difference(model_, q0, q1, out);
}

VectorX Multibody::neutral() const { return pinocchio::neutral(model_); }

// Scales for errors of q: |q| of plain coordinates; for positions of free and planar joints the
// distance from the origin, the same for all axes; 1 rad for rotations.
void Multibody::sizes(const VectorX& q, VectorX& out) const {
  out.setOnes(model_.nv);
  for (int j = 1; j < model_.njoints; ++j) {
    const auto& joint = model_.joints[j];
    if (joint.nq() == joint.nv())
      out.segment(joint.idx_v(), joint.nv()) = q.segment(joint.idx_q(), joint.nq()).cwiseAbs();
  }
  for (const CurvedSegment& s : curved_)
    out.segment(s.index_v, s.linear).setConstant(q.segment(s.index_q, s.linear).norm());
}

void Multibody::speeds(const VectorRef& v, VectorX& out) const {
  out = v.cwiseAbs();
  // Components of one vector share a scale, so that the choice of axes does not matter.
  const auto together = [&](int i, int n) {
    out.segment(i, n).setConstant(v.segment(i, n).norm());
  };
  for (const CurvedSegment& s : curved_) {
    together(s.index_v, s.linear);
    together(s.index_v + s.linear, s.angular);
  }
}

double Multibody::kinetic_energy(const VectorX& q, const VectorX& v) {
  if (mimics_) {
    compute_mass(q);
    return 0.5 * v.dot(data_.M * v);
  }
  // Not by Pinocchio's function, which leaves out the armature of joints about a skew axis.
  pinocchio::forwardKinematics(model_, data_, q, v);
  double twice = model_.armature.dot(v.cwiseAbs2());
  for (int j = 1; j < model_.njoints; ++j) twice += model_.inertias[j].vtiv(data_.v[j]);
  return 0.5 * twice;
}

// - sum of m g . (center of mass); Pinocchio's function refuses mimic joints.
double Multibody::potential_energy(const VectorX& q) {
  pinocchio::forwardKinematics(model_, data_, q);
  double sum = 0;
  for (int j = 1; j < model_.njoints; ++j) {
    const auto& inertia = model_.inertias[j];
    sum -= inertia.mass() * model_.gravity.linear().dot(data_.oMi[j].act(inertia.lever()));
  }
  return sum;
}

}  // namespace sphshell
