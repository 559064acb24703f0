// Many runs of one model, shared out over threads.
#pragma once

#include <condition_variable>
#include <thread>

#include "dynamics/run/simulation.hpp"

namespace sphshell {

// What is left of a run.
struct Outcome {
  Simulation::Status status = Simulation::Status::Running;  // if still so, it was stopped
  std::string fault;                                        // what a user's routine threw
  std::optional<DeepStart> deep_start;                      // it did not begin
  double time = 0, last_step = 0, wall_time = 0;            // [s]
  Counts counts;
  VectorX q, v;
  std::vector<PairSummary> summaries;
  std::vector<LimitSummary> limits;
  Record record;
};

// Threads take the runs in the order in which they were added. A run knows nothing of the others,
// so its bits depend neither on them nor on the number of threads.
class Rollout {
 public:
  Rollout(const pinocchio::Model& model, int threads);
  ~Rollout() { stop(); }
  Rollout(const Rollout&) = delete;
  Rollout& operator=(const Rollout&) = delete;

  // Any free thread takes it up.
  void add(Task task);
  // Waits until `left` runs or fewer are not finished, for `seconds` at most; returns how many are.
  std::size_t wait(std::size_t left, double seconds);
  // Ends the runs under way where they stand, and begins no more. Waits for the threads.
  void stop();
  // Hands over what the runs used that are finished. Users' routines and other objects of theirs
  // are not let go of in the threads, where that might need a lock of theirs.
  std::vector<Lent> give_back();
  // Of runs that are finished, once the threads stand still.
  const std::deque<Outcome>& outcomes() const { return outcomes_; }
  const pinocchio::Model& model() const { return model_; }

 private:
  // A thread's loop; and one run, whose errors become part of its outcome.
  void work();
  Outcome run(Task task, Lent& lent) const;

  pinocchio::Model model_;
  std::mutex mutex_;
  std::condition_variable added_, finished_;
  std::deque<std::pair<std::size_t, Task>> waiting_;
  std::deque<Outcome> outcomes_;  // by number; a deque: the others stay where they are
  std::vector<Lent> lent_;        // of finished runs
  std::size_t done_ = 0;
  std::atomic<bool> stopped_{false};
  std::vector<std::thread> threads_;
};

}  // namespace sphshell
