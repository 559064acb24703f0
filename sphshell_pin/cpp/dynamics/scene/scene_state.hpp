// A scene along a motion that somebody else integrates.
#pragma once

#include "dynamics/derivatives/linearization.hpp"

namespace sphshell {

// Remembers what the forces depend on besides q and v: which contacts there are, on which side of
// its shell each sphere is, and how far bristles are stretched.
class SceneState {
 public:
  SceneState(const pinocchio::Model& model, std::vector<Pair> pairs, JointForces::Effects joints)
      : scene_(model, std::move(pairs), std::move(joints)),
        z_(VectorX::Zero(scene_.bristle_size())) {}
  SceneState(const SceneState& other)
      : scene_(other.scene_), q_(other.q_), z_(other.z_), begun_(other.begun_) {}
  SceneState& operator=(const SceneState&) = delete;

  // Forces at (q, v), with the memory as it is: they do not change it.
  void evaluate(const VectorX& q, const VectorX& v) { scene_.evaluate_anew(q, v, z_, true); }

  // The motion has come to (q, v), in dt [s]. Bristles are stretched as SemiImplicitEuler does it:
  // with the new velocity, at the contacts where the step began. The first call only begins.
  void advance(const VectorX& q, const VectorX& v, double dt) {
    if (begun_ && z_.size() > 0) {
      scene_.relax_in(dt);
      evaluate(q_, v);
      z_ += dt * scene_.bristle_rates();
    }
    evaluate(q, v);
    scene_.accept(z_);
    q_ = q;
    begun_ = true;
  }

  // All that is remembered, as numbers: whether the motion has begun, its last q, and the scene's
  // memory. restore() takes it up; false, and nothing is changed, where it is not of such a scene.
  std::vector<double> save() {
    std::vector<double> out{double(begun_)};
    const VectorX q = begun_ ? q_ : VectorX::Zero(scene_.body().model().nq);
    out.insert(out.end(), q.begin(), q.end());
    const std::vector<double> memory = scene_.save(z_);
    out.insert(out.end(), memory.begin(), memory.end());
    return out;
  }
  bool restore(const double* from, std::size_t count) {
    const auto nq = static_cast<std::size_t>(scene_.body().model().nq);
    if (count < 1 + nq || (from[0] != 0 && from[0] != 1)) return false;
    const VectorX q = Eigen::Map<const VectorX>(from + 1, Eigen::Index(nq));
    if (!q.allFinite() || !scene_.load(from + 1 + nq, count - 1 - nq, z_)) return false;
    q_ = q;
    begun_ = from[0] == 1;
    return true;
  }

  // Made when it is first asked for.
  Linearization& linearization() {
    if (!linearization_) linearization_.emplace(scene_);
    return *linearization_;
  }

  SceneData& scene() { return scene_; }
  const SceneData& scene() const { return scene_; }
  const VectorX& bristles() const { return z_; }

 private:
  SceneData scene_;
  VectorX q_, z_;
  bool begun_ = false;
  std::optional<Linearization> linearization_;
};

}  // namespace sphshell
