#include "sphshell_pin/scene.hpp"

#include <pinocchio/algorithm/joint-configuration.hpp>

#include "dynamics/compiled/compiled_robot.hpp"
#include "dynamics/scene/model_fault.hpp"
#include "dynamics/scene/scene_state.hpp"
#include "library/checks.hpp"
#include "library/impl.hpp"

namespace sphshell_pin {
namespace {

using pinocchio::Model;
using pinocchio::SE3;

constexpr std::size_t kMostNames = 20;  // in a message

std::string in_quotes(const std::string& name) { return "'" + name + "'"; }

// Names may repeat (a link called as its joint): a body's frame comes first, then an operational
// frame, then any other.
const pinocchio::Frame& find_frame(const Model& model, const std::string& name) {
  // All frames are looked at: names are few, and may repeat.
  const pinocchio::Frame* found = nullptr;
  const auto rank = [](const pinocchio::Frame& frame) {
    return frame.type == pinocchio::BODY ? 0 : frame.type == pinocchio::OP_FRAME ? 1 : 2;
  };
  for (const pinocchio::Frame& frame : model.frames)
    if (frame.name == name && (!found || rank(frame) < rank(*found))) found = &frame;
  if (found) return *found;
  std::string text = "no frame " + in_quotes(name) + "; the model has: ";
  for (std::size_t k = 0; k < std::min(kMostNames, model.frames.size()); ++k)
    text += (k ? ", " : "") + model.frames[k].name;
  if (model.frames.size() > kMostNames)
    text += " and " + std::to_string(model.frames.size() - kMostNames) + " more";
  throw FrameNotFound(text);
}

// A rigid placement: finite, with a rotation.
void check_placement(const SE3& placement) {
  const Eigen::Matrix3d r = placement.rotation();
  if (!r.allFinite() || !placement.translation().allFinite())
    throw InvalidParameter("placement", shown_all(placement.translation()), "must be finite");
  // Orthonormal to 1e-6, as numbers in a file are.
  if ((r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 1e-6 ||
      r.determinant() < 0)
    throw InvalidParameter("placement.rotation",
                           "a matrix of determinant " + shown(r.determinant()),
                           "must be a rotation: orthonormal, determinant +1");
}

// The size that the model asks for, and finite numbers.
void check_size(const char* name, const Eigen::VectorXd& x, Eigen::Index size, const Model& model) {
  if (x.size() != size)
    throw InvalidParameter(name, "a vector of size " + std::to_string(x.size()),
                           "must have size " + std::to_string(size) + ": this model has nq = " +
                               std::to_string(model.nq) + ", nv = " + std::to_string(model.nv));
  for (Eigen::Index i = 0; i < size; ++i)
    if (!std::isfinite(x[i]))
      throw InvalidParameter(name + ("[" + std::to_string(i) + "]"), shown(x[i]), "must be finite");
}

void check_state(const Model& model, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  check_size("q", q, model.nq, model);
  check_size("v", v, model.nv, model);
  if (!pinocchio::isNormalized(model, q, 1e-3))
    throw InvalidParameter("q", shown_all(q),
                           "must have quaternions (x, y, z, w) and pairs (cos, sin) of unit "
                           "length: take pinocchio::normalize");
}

}  // namespace

struct Scene::Impl {
  Model model;
  std::vector<core::Pair> pairs;
  core::JointForces::Effects joints;  // nothing acts in them; with the compiled robot, or null

  // A sphere as a frame at its center, in its joint, whose number goes into `joint`.
  SE3 center_of(const Sphere& sphere, int& joint) const {
    check_positive("radius", sphere.radius, " [m]");
    check_point("offset", sphere.offset);
    const pinocchio::Frame& frame = find_frame(model, sphere.frame);
    joint = static_cast<int>(frame.parentJoint);
    return frame.placement * SE3(Eigen::Matrix3d::Identity(), sphere.offset);
  }

  // Adds the pair of a sphere and what it touches; returns its number.
  int add(core::Pair pair, const Sphere& sphere, const std::string& touched, const NormalLaw& law,
          const FrictionLaw& friction) {
    pair.name = sphere.frame + "-" + touched;
    pair.radius = sphere.radius;
    pair.law = law.core();
    pair.friction = friction.core();
    pairs.push_back(std::move(pair));
    return static_cast<int>(pairs.size()) - 1;
  }
};

// The model, unless Pinocchio's algorithms would not survive it.
static const Model& checked(const Model& model) {
  if (const auto fault = core::model_fault(model))
    throw InvalidParameter(fault->name, fault->value, fault->must);
  return model;
}

Scene::Scene(const Model& model) : impl_(new Impl{checked(model), {}, {}}) {}

// Frames are found by name once, and kept as joint and placement.
int Scene::add_contact(const Sphere& sphere, const Shell& shell, const NormalLaw& law,
                       const FrictionLaw& friction, const Mount& mount) {
  core::Pair pair;
  const core::Method method = checked(mount.method);
  check_placement(mount.placement);
  pair.placement_i = impl_->center_of(sphere, pair.joint_i);
  const pinocchio::Frame& frame = find_frame(impl_->model, mount.frame);
  pair.joint_j = static_cast<int>(frame.parentJoint);
  pair.placement_j = frame.placement * mount.placement;
  pair.geometry = core::ShellSurface{{}, shell.impl().with(mount.method), method};
  return impl_->add(std::move(pair), sphere, mount.frame, law, friction);
}

int Scene::add_contact(const Sphere& sphere, const Sphere& other, const NormalLaw& law,
                       const FrictionLaw& friction) {
  core::Pair pair;
  pair.placement_i = impl_->center_of(sphere, pair.joint_i);
  pair.placement_j = impl_->center_of(other, pair.joint_j);
  pair.geometry = core::Ball{{}, other.radius};
  return impl_->add(std::move(pair), sphere, other.frame, law, friction);
}

void Scene::set_relaxation(int pair, double time) {
  if (pair < 0 || pair >= num_pairs())
    throw InvalidParameter("pair", std::to_string(pair),
                           "must be one of the " + std::to_string(num_pairs()) + " of the scene");
  impl_->pairs[pair].relaxation = check_positive("time", time, " [s]");
}

void Scene::use_compiled(const std::string& path) {
  core::JointEffects effects;
  try {
    effects.compiled = std::make_shared<core::CompiledRobot>(path, impl_->model);
  } catch (const std::exception& error) {
    throw InvalidParameter(
        "path", path,
        std::string("must be what compile_robot() made for this model: ") + error.what());
  }
  impl_->joints = std::make_shared<core::JointEffects>(std::move(effects));
}

const Model& Scene::model() const { return impl_->model; }
int Scene::num_pairs() const { return static_cast<int>(impl_->pairs.size()); }

struct SceneState::Impl {
  core::SceneState state;
  core::Forces none;  // where nothing touches

  // A state copies the scene's model and pairs: what is done to the scene later does not change it.
  explicit Impl(const Scene::Impl& scene)
      : state(scene.model, scene.pairs, scene.joints),
        none(static_cast<std::size_t>(scene.model.njoints), pinocchio::Force::Zero()) {}

  void evaluate(const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
    check_state(state.scene().body().model(), q, v);
    state.evaluate(q, v);
  }
};

SceneState::SceneState(const Scene& scene) : impl_(new Impl(scene.impl())) {}

const std::vector<pinocchio::Force>& SceneState::external_forces(const Eigen::VectorXd& q,
                                                                 const Eigen::VectorXd& v) {
  impl_->evaluate(q, v);
  const core::SceneData& scene = impl_->state.scene();
  return scene.touching() ? scene.external() : impl_->none;
}

const Eigen::VectorXd& SceneState::acceleration(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                                const Eigen::VectorXd& tau) {
  check_size("tau", tau, impl_->state.scene().body().model().nv,
             impl_->state.scene().body().model());
  impl_->evaluate(q, v);
  return impl_->state.scene().acceleration(q, v, tau);
}

// Rows as runs record them, in the library's own types.
std::vector<SceneContact> SceneState::contacts(const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  using Vec3 = Eigen::Vector3d;
  impl_->evaluate(q, v);
  std::vector<core::ContactRow> rows;
  impl_->state.scene().log(q, v, rows);
  std::vector<SceneContact> out;
  for (const core::ContactRow& row : rows)
    out.push_back({row.pair, Vec3(row.point), Vec3(row.normal), row.depth, row.normal_force,
                   Vec3(row.friction_force), Vec3(row.slip_velocity), row.element,
                   static_cast<Feature>(row.feature), row.contact_id});
  return out;
}

void SceneState::contact_derivatives(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                     Eigen::MatrixXd& by_q, Eigen::MatrixXd& by_v) {
  // Before evaluate(): it makes the contacts carry what it needs.
  core::Linearization& linearization = impl_->state.linearization();
  impl_->evaluate(q, v);
  linearization.forces(q, v, by_q, by_v);
}

void SceneState::advance(const Eigen::VectorXd& q, const Eigen::VectorXd& v, double dt) {
  check_state(impl_->state.scene().body().model(), q, v);
  impl_->state.advance(q, v, check_not_negative("dt", dt, " [s]"));
}

std::vector<double> SceneState::values() const { return impl_->state.save(); }

void SceneState::restore(const std::vector<double>& values) {
  if (!impl_->state.restore(values.data(), values.size()))
    throw InvalidParameter("values", std::to_string(values.size()) + " numbers",
                           "must be the values of a state of a scene with the same pairs");
}

}  // namespace sphshell_pin
