// Many runs of one model, shared out over threads.
#pragma once

#include <chrono>
#include <condition_variable>
#include <system_error>
#include <thread>

#include "dynamics/run/simulation.hpp"

namespace sphshell {

// What is left of a run.
struct Outcome : Figures {
  Simulation::Status status = Simulation::Status::Running;  // if still so, it was stopped
  std::string fault;                                        // what a user's routine threw
  std::optional<DeepStart> deep_start;                      // it did not begin
  Record record;
};

// Threads take the runs in the order in which they were added. A run knows nothing of the others,
// so its bits depend neither on them nor on the number of threads.
class Rollout {
 public:
  // Threads wait for tasks from now on.
  Rollout(const pinocchio::Model& model, int threads) : model_(model) {
    try {
      while (static_cast<int>(threads_.size()) < threads) threads_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      if (threads_.empty()) throw;  // the system gives no more: these do the work
    }
  }
  ~Rollout() { stop(); }
  Rollout(const Rollout&) = delete;
  Rollout& operator=(const Rollout&) = delete;

  // Any free thread takes it up.
  void add(Task task) {
    {
      const std::lock_guard lock(mutex_);
      waiting_.emplace_back(outcomes_.size(), std::move(task));
      outcomes_.emplace_back();
    }
    added_.notify_one();
  }
  // Waits until `left` runs or fewer are not finished, for `seconds` at most; returns how many are.
  std::size_t wait(std::size_t left, double seconds) {
    std::unique_lock lock(mutex_);
    finished_.wait_for(lock, std::chrono::duration<double>(seconds),
                       [&] { return outcomes_.size() - done_ <= left; });
    return done_;
  }
  // Ends the runs under way where they stand, and begins no more. Waits for the threads.
  void stop() {
    // Runs under way see the flag and end after their step.
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    added_.notify_all();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }
  // Hands over what the runs used that are finished. Users' routines and other objects of theirs
  // are not let go of in the threads, where that might need a lock of theirs.
  std::vector<Lent> give_back() {
    const std::lock_guard lock(mutex_);
    return std::exchange(lent_, {});
  }
  // Of runs that are finished, once the threads stand still.
  const std::deque<Outcome>& outcomes() const { return outcomes_; }
  const pinocchio::Model& model() const { return model_; }

 private:
  // Takes the tasks in the order in which they were added, until stop().
  void work() {
    for (;;) {
      std::size_t number;
      Task task;
      {
        std::unique_lock lock(mutex_);
        added_.wait(lock, [this] { return stopped_ || !waiting_.empty(); });
        if (stopped_) return;
        number = waiting_.front().first;
        task = std::move(waiting_.front().second);
        waiting_.pop_front();
      }
      Lent lent;
      Outcome outcome = run(std::move(task), lent);
      {
        const std::lock_guard lock(mutex_);
        lent_.push_back(std::move(lent));
        outcomes_[number] = std::move(outcome);
        ++done_;
      }
      finished_.notify_one();
    }
  }

  // One run, whose errors become part of its outcome.
  Outcome run(Task task, Lent& lent) const {
    Outcome out;
    // An exception that left a thread would end the process.
    try {
      Simulation run(model_, std::move(task));
      try {
        out.deep_start = run.deep_start();
        if (!out.deep_start) out.status = run.advance(kInfinity, kInfinity, &stopped_);
      } catch (const std::exception& error) {
        out.fault = error.what();
      }
      out.record = run.take();
      static_cast<Figures&>(out) = run.figures();
      lent = run.give_back();
    } catch (const std::exception& error) {
      out.fault = error.what();
    }
    return out;
  }

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
