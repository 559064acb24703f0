// Evaluations of one scene, by any number of threads.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "bindings/own_errors.hpp"
#include "dynamics/scene.hpp"

namespace sphshell {

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

  // work(scene) at a state (q, v), whose sizes are checked.
  template <class Work>
  auto at(const VectorX& q, const VectorX& v, Work&& work) {
    check_count("q", q.size(), model_.nq);
    check_count("v", v.size(), model_.nv);
    return with_scene(work);
  }
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

}  // namespace sphshell
