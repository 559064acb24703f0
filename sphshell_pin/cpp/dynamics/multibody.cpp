#include "dynamics/multibody.hpp"

#include <algorithm>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/energy.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <string>

namespace sphshell {
namespace {

void find_curved(const pinocchio::JointModel& joint, std::vector<CurvedSegment>& out) {
  if (const auto* whole = boost::get<pinocchio::JointModelComposite>(&joint)) {
    for (const auto& part : whole->joints) find_curved(part, out);
    return;
  }
  const std::string kind = joint.shortname();
  using Group = CurvedSegment::Group;
  const auto add = [&](Group group) { out.push_back({group, joint.idx_v(), joint.idx_q()}); };
  if (kind == "JointModelFreeFlyer") add(Group::Rigid);
  if (kind == "JointModelSpherical") add(Group::Rotation);
  if (kind == "JointModelPlanar") add(Group::Planar);
}

}  // namespace

Multibody::Multibody(const pinocchio::Model& model)
    : model_(model), data_(model_), zero_(VectorX::Zero(model_.nv)) {
  for (int j = 1; j < model_.njoints; ++j) find_curved(model_.joints[j], curved_);
}

void Multibody::need(int joint) {
  for (; joint > 0; joint = static_cast<int>(model_.parents[joint])) {
    const auto at = std::lower_bound(needed_.begin(), needed_.end(), joint);
    if (at != needed_.end() && *at == joint) return;
    needed_.insert(at, joint);
  }
}

void Multibody::kinematics(const VectorX& q) {
  using Step =
      pinocchio::impl::ForwardKinematicZeroStep<double, 0, pinocchio::JointCollectionDefaultTpl,
                                                VectorX>;
  for (int j : needed_)
    Step::run(model_.joints[j], data_.joints[j], Step::ArgsType(model_, data_, q));
}

void Multibody::kinematics(const VectorX& q, const VectorX& v) {
  using Step =
      pinocchio::impl::ForwardKinematicFirstStep<double, 0, pinocchio::JointCollectionDefaultTpl,
                                                 VectorX, VectorX>;
  for (int j : needed_)
    Step::run(model_.joints[j], data_.joints[j], Step::ArgsType(model_, data_, q, v));
}

const VectorX& Multibody::acceleration(const VectorX& q, const VectorX& v, const VectorX& tau) {
  return pinocchio::aba(model_, data_, q, v, tau);
}

const VectorX& Multibody::acceleration(const VectorX& q, const VectorX& v, const VectorX& tau,
                                       const Forces& external) {
  return pinocchio::aba(model_, data_, q, v, tau, external);
}

const VectorX& Multibody::gravity(const VectorX& q) {
  return pinocchio::computeGeneralizedGravity(model_, data_, q);
}

const VectorX& Multibody::bias(const VectorX& q, const VectorX& v, const Forces& external) {
  return pinocchio::rnea(model_, data_, q, v, zero_, external);
}

void Multibody::integrate(const VectorX& q, const VectorX& step, VectorX& out) const {
  pinocchio::integrate(model_, q, step, out);
}

void Multibody::difference(const VectorX& q0, const VectorX& q1, VectorX& out) const {
  pinocchio::difference(model_, q0, q1, out);
}

double Multibody::kinetic_energy(const VectorX& q, const VectorX& v) {
  return pinocchio::computeKineticEnergy(model_, data_, q, v);
}

double Multibody::potential_energy(const VectorX& q) {
  return pinocchio::computePotentialEnergy(model_, data_, q);
}

}  // namespace sphshell
