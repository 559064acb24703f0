#include "dynamics/scene/model_fault.hpp"

#include <stdexcept>

namespace sphshell {
namespace {

// Adds joint j of a model as Pinocchio would; false where it mimics none that is there.
bool add_joint(const pinocchio::Model& from, int j, pinocchio::Model& to) {
  const auto* given = boost::get<pinocchio::JointModelMimic>(&from.joints[j]);
  const std::size_t leader = given ? given->jmodel().id() : 1;
  if (leader < 1 || (given && leader >= static_cast<std::size_t>(j))) return false;
  to.addJoint(from.parents[j], from.joints[j], from.jointPlacements[j], std::to_string(j));
  if (!given) return true;
  const pinocchio::JointModel& of = to.joints[leader];
  if (of.nq() != given->jmodel().nq() || of.nv() != given->jmodel().nv()) return false;
  boost::get<pinocchio::JointModelMimic>(to.joints[j])
      .setMimicIndexes(of.id(), of.idx_q(), of.idx_v(), of.idx_vExtended());
  return true;
}

}  // namespace

std::string model_fault(const pinocchio::Model& model) {
  const std::string again = ": build the model anew with addJoint";
  // Built as Pinocchio does it, and compared: composite joints and those that mimic others too.
  pinocchio::Model right;
  for (int j = 1; j < model.njoints; ++j)
    if (!add_joint(model, j, right) || !(right.joints[j] == model.joints[j]) ||
        right.nqs[j] != model.nqs[j] || right.nvs[j] != model.nvs[j])
      return "the indices of joint '" + model.names[j] + "' are not those of its place" + again;
  if (right.nq != model.nq || right.nv != model.nv || right.nvExtended != model.nvExtended)
    return "nq = " + std::to_string(model.nq) + ", nv = " + std::to_string(model.nv) +
           " are not the sums of its joints, " + std::to_string(right.nq) + " and " +
           std::to_string(right.nv) + again;
  if (right.idx_qs != model.idx_qs || right.idx_vs != model.idx_vs ||
      right.idx_vExtendeds != model.idx_vExtendeds || right.nvExtendeds != model.nvExtendeds ||
      right.children != model.children || right.supports != model.supports ||
      right.subtrees != model.subtrees || right.mimicking_joints != model.mimicking_joints ||
      right.mimicked_joints != model.mimicked_joints)
    return "its lists of indices, children, supports or subtrees are not those of its joints" +
           again;
  if (static_cast<std::size_t>(model.nframes) != model.frames.size())
    return "nframes = " + std::to_string(model.nframes) + " is not the number of its frames";
  for (const auto& [name, values] :
       {std::pair{"armature", &model.armature}, std::pair{"damping", &model.damping},
        std::pair{"lowerDryFrictionLimit", &model.lowerDryFrictionLimit},
        std::pair{"upperDryFrictionLimit", &model.upperDryFrictionLimit}})
    if (values->size() != model.nv)
      return std::string(name) + " has " + std::to_string(values->size()) + " numbers, nv is " +
             std::to_string(model.nv);
  for (const auto& [name, values] : {std::pair{"lowerPositionLimit", &model.lowerPositionLimit},
                                     std::pair{"upperPositionLimit", &model.upperPositionLimit}})
    if (values->size() != model.nq)
      return std::string(name) + " has " + std::to_string(values->size()) + " numbers, nq is " +
             std::to_string(model.nq);
  return "";
}

}  // namespace sphshell
