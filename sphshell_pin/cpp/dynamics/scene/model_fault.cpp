#include "dynamics/scene/model_fault.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

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

// Pinocchio's transformJointIntoMimic sorts the joints that are mimicked apart from those that
// mimic them.
std::vector<std::size_t> sorted(std::vector<std::size_t> joints) {
  std::sort(joints.begin(), joints.end());
  return joints;
}

// What is wrong with the indices of a model; empty if nothing is. Its lists have one entry per
// joint, parents first.
std::string index_fault(const pinocchio::Model& model) {
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
      sorted(right.mimicked_joints) != sorted(model.mimicked_joints))
    return "its lists of indices, children, supports or subtrees are not those of its joints" +
           again;
  if (static_cast<std::size_t>(model.nframes) != model.frames.size())
    return "nframes = " + std::to_string(model.nframes) + " is not the number of its frames";
  for (const auto& [name, values, size, of] :
       {std::tuple("armature", &model.armature, model.nv, "nv"),
        {"damping", &model.damping, model.nv, "nv"},
        {"lowerDryFrictionLimit", &model.lowerDryFrictionLimit, model.nv, "nv"},
        {"upperDryFrictionLimit", &model.upperDryFrictionLimit, model.nv, "nv"},
        {"lowerPositionLimit", &model.lowerPositionLimit, model.nq, "nq"},
        {"upperPositionLimit", &model.upperPositionLimit, model.nq, "nq"}})
    if (values->size() != size)
      return std::string(name) + " has " + std::to_string(values->size()) + " numbers, " + of +
             " is " + std::to_string(size);
  return "";
}

bool is_finite(const pinocchio::SE3& placement) {
  return placement.rotation().allFinite() && placement.translation().allFinite();
}

template <class Value>
std::string text_of(const Value& value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

std::string text_of(const Eigen::VectorXd& x) {
  const Eigen::IOFormat row(Eigen::StreamPrecision, Eigen::DontAlignCols, ", ", "", "", "", "[",
                            "]");
  return text_of(x.transpose().format(row));
}

}  // namespace

std::optional<ModelFault> model_fault(const pinocchio::Model& model) {
  const auto count = static_cast<std::size_t>(model.njoints);
  // Pinocchio's algorithms read these arrays without looking at their lengths.
  for (const auto& [name, found] : {std::pair("names", model.names.size()),
                                    {"joints", model.joints.size()},
                                    {"parents", model.parents.size()},
                                    {"inertias", model.inertias.size()},
                                    {"jointPlacements", model.jointPlacements.size()},
                                    {"nqs", model.nqs.size()},
                                    {"nvs", model.nvs.size()}})
    if (found != count)
      return ModelFault{std::string("model.") + name, text_of(found),
                        "must have " + text_of(count) + " entries"};
  for (std::size_t j = 0; j < count; ++j) {
    const std::string at = "[" + text_of(j) + "]", joint = "joint '" + model.names[j] + "'";
    // Also excludes cycles: a parent has a lower number.
    if (model.parents[j] >= std::max<std::size_t>(j, 1))
      return ModelFault{"model.parents" + at, text_of(model.parents[j]),
                        "must come before " + joint};
    const pinocchio::Inertia& inertia = model.inertias[j];
    const pinocchio::SE3& placement = model.jointPlacements[j];
    if (!std::isfinite(inertia.mass()) || !inertia.lever().allFinite() ||
        !inertia.inertia().matrix().allFinite())
      return ModelFault{"model.inertias" + at, text_of(inertia.mass()) + ", ...",
                        "must be finite: " + joint};
    if (!is_finite(placement))
      return ModelFault{"model.jointPlacements" + at,
                        text_of(Eigen::VectorXd(placement.translation())) + ", ...",
                        "must be finite: " + joint};
    if (inertia.mass() < 0)
      return ModelFault{"the mass of " + joint, text_of(inertia.mass()),
                        "must not be negative [kg]"};
  }
  const Eigen::VectorXd gravity = model.gravity.toVector();
  if (!gravity.allFinite()) return ModelFault{"model.gravity", text_of(gravity), "must be finite"};
  for (const pinocchio::Frame& frame : model.frames)
    if (frame.parentJoint >= count || !is_finite(frame.placement))
      return ModelFault{"model's frame '" + frame.name + "'", text_of(frame.parentJoint),
                        "must be on a joint of it"};
  const std::string fault = index_fault(model);
  if (fault.empty()) return {};
  return ModelFault{"model", "a pinocchio::Model", "is damaged: " + fault};
}

}  // namespace sphshell
