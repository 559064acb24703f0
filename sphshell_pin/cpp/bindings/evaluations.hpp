// Evaluations of one scene: at single states by any number of threads, or along a motion.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "bindings/one_user.hpp"
#include "dynamics/scene_state.hpp"

namespace sphshell {

inline void check_state(const Scene& scene, const VectorX& q, const VectorX& v) {
  check_count("q", q.size(), scene.body().model().nq);
  check_count("v", v.size(), scene.body().model().nv);
}

// A call has a Scene to itself: while its contact source runs, another thread, or the source
// itself, may begin another. The interpreter's lock guards the fields.
class Evaluations {
 public:
  Evaluations(const pinocchio::Model& model, std::vector<Pair> pairs)
      : model_(model), pairs_(std::move(pairs)) {
    idle_.push_back(std::make_unique<Scene>(model_, pairs_));
  }

  Evaluations(const Evaluations&) = delete;
  Evaluations& operator=(const Evaluations&) = delete;

  template <class Work>
  auto with_scene(Work&& work) {
    std::unique_ptr<Scene> scene;
    if (idle_.empty()) {
      scene = std::make_unique<Scene>(model_, pairs_);
    } else {
      scene = std::move(idle_.back());
      idle_.pop_back();
    }
    const GiveBack give_back{idle_, scene};
    return work(*scene);
  }
  // work(scene, evaluate) at a state whose sizes are checked; evaluate() computes its forces.
  template <class Work>
  auto at(const VectorX& q, const VectorX& v, Work&& work) {
    return with_scene([&](Scene& scene) {
      check_state(scene, q, v);
      return work(scene, [&] {
        scene.restart();
        scene.evaluate(q, v, VectorX::Zero(scene.bristle_size()));
      });
    });
  }

  // Those at work are not among them: what holds them is alive.
  template <class Visit>
  int for_each_pairs(Visit&& visit) const {
    if (const int stop = visit(pairs_)) return stop;
    for (const auto& scene : idle_)
      if (const int stop = visit(scene->pairs())) return stop;
    return 0;
  }

 private:
  struct GiveBack {
    std::vector<std::unique_ptr<Scene>>& idle;
    std::unique_ptr<Scene>& scene;
    ~GiveBack() { idle.push_back(std::move(scene)); }
  };

  const pinocchio::Model model_;
  const std::vector<Pair> pairs_;
  std::vector<std::unique_ptr<Scene>> idle_;
};

// A SceneState for one user at a time.
struct OwnState {
  OneUser user{"SceneState"};
  SceneState state;

  OwnState(const pinocchio::Model& model, std::vector<Pair> pairs)
      : state(model, std::move(pairs)) {}
  OwnState(const OwnState& other) : state(other.state) {}

  // As Evaluations::at, with what the state remembers.
  template <class Work>
  auto at(const VectorX& q, const VectorX& v, Work&& work) {
    const Use use(user, "evaluation");
    check_state(state.scene(), q, v);
    return work(state.scene(), [&] { state.evaluate(q, v); });
  }
  void advance(const VectorX& q, const VectorX& v, double dt) {
    const Use use(user, "advance");
    check_state(state.scene(), q, v);
    state.advance(q, v, dt);
  }
};

}  // namespace sphshell
