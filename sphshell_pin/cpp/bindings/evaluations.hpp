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

// A scene with what it remembers, for one call at (q, v).
struct At {
  SceneState& state;
  const VectorX &q, &v;
  SceneData& scene = state.scene();

  void evaluate() const { state.evaluate(q, v); }
  // After evaluate().
  std::vector<ContactRow> rows() const {
    std::vector<ContactRow> out;
    scene.log(q, v, out);
    return out;
  }
};

// answer(at, tau) at a state as users hand it over.
template <class T, class Answer>
auto at_given(T& self, nb::handle q, nb::handle v, nb::handle tau, Answer&& answer) {
  const StateArgument given = self.arguments(q, v, tau);
  return self.at(given.q, given.v, [&](const At& at) { return answer(at, given.tau); });
}

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

  // work(at) at a state whose sizes are checked; bristles are unstretched.
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
    return work(At{*state, q, v});
  }

  const pinocchio::Model& model() const { return first_.scene().body().model(); }
  int bristle_size() const { return first_.scene().bristle_size(); }

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
    return work(At{state, q, v});
  }
  void advance(const VectorX& q, const VectorX& v, double dt) {
    const Use use(user, "advance");
    state.advance(q, v, dt);
  }
};

}  // namespace sphshell
