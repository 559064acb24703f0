// Evaluations of one scene: at single states by any number of threads, or along a motion.
#pragma once

#include "bindings/state_arguments.hpp"
#include "dynamics/scene/scene_state.hpp"

namespace sphshell {

// Sizes only: values were checked where they came from Python.
inline void check_state(const pinocchio::Model& model, const VectorX& q, const VectorX& v) {
  check_count("q", q.size(), model.nq);
  check_count("v", v.size(), model.nv);
}

// What a state answers at (q, v): its forces, when it is called.
struct Evaluate {
  SceneState& state;
  const VectorX &q, &v;
  void operator()() const { state.evaluate(q, v); }
  Linearization& linearization() const { return state.linearization(); }
};

// A call has a state to itself: while its contact source runs, another thread, or the source
// itself, may begin another. The interpreter's lock guards the fields.
class Evaluations {
 public:
  Evaluations(nb::object model, nb::object shown, std::vector<Pair> pairs,
              JointForces::Effects joints, nb::object convert)
      : arguments(model, std::move(shown), std::move(convert)),
        first_(model_of(model), std::move(pairs), std::move(joints)) {}

  Evaluations(const Evaluations&) = delete;
  Evaluations& operator=(const Evaluations&) = delete;

  const StateArguments arguments;

  // work(scene, evaluate) at a state whose sizes are checked.
  template <class Work>
  auto at(const VectorX& q, const VectorX& v, Work&& work) {
    check_state(model(), q, v);
    std::unique_ptr<SceneState> state;
    if (idle_.empty()) {
      state = std::make_unique<SceneState>(first_);
    } else {
      state = std::move(idle_.back());
      idle_.pop_back();
    }
    const GiveBack give_back{idle_, state};
    return work(state->scene(), Evaluate{*state, q, v});
  }

  const pinocchio::Model& model() const { return first_.scene().body().model(); }
  int bristle_size() const { return first_.scene().bristle_size(); }
  // Unstretched.
  VectorX bristles(const SceneData& scene) const { return VectorX::Zero(scene.bristle_size()); }

  // Those at work are not among them: what holds them is alive.
  template <class Visit>
  void for_each_pairs(Visit&& visit) const {
    visit(first_.scene().pairs());
    for (const auto& state : idle_) visit(state->scene().pairs());
  }

 private:
  using Idle = std::vector<std::unique_ptr<SceneState>>;
  struct GiveBack {
    Idle& idle;
    std::unique_ptr<SceneState>& state;
    ~GiveBack() { idle.push_back(std::move(state)); }
  };

  const SceneState first_;  // the others are copies of it
  Idle idle_;
};

// A SceneState for one user at a time.
struct OwnState {
  OneUser user{"SceneState"};
  const StateArguments arguments;
  SceneState state;

  OwnState(nb::object model, nb::object shown, std::vector<Pair> pairs, JointForces::Effects joints,
           nb::object convert)
      : arguments(model, std::move(shown), std::move(convert)),
        state(model_of(model), std::move(pairs), std::move(joints)) {}
  OwnState(const OwnState& other) : arguments(other.arguments), state(other.state) {}

  // As Evaluations::at, with what the state remembers.
  template <class Work>
  auto at(const VectorX& q, const VectorX& v, Work&& work) {
    const Use use(user, "evaluation");
    check_state(state.scene().body().model(), q, v);
    return work(state.scene(), Evaluate{state, q, v});
  }
  VectorX bristles(const SceneData&) const { return state.bristles(); }
  void advance(const VectorX& q, const VectorX& v, double dt) {
    const Use use(user, "advance");
    state.advance(q, v, dt);
  }
};

}  // namespace sphshell
