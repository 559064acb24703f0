#include "dynamics/run/rollout.hpp"

#include <chrono>
#include <exception>
#include <system_error>

namespace sphshell {

// Threads wait for tasks from now on.
Rollout::Rollout(const pinocchio::Model& model, int threads) : model_(model) {
  try {
    while (static_cast<int>(threads_.size()) < threads) threads_.emplace_back([this] { work(); });
  } catch (const std::system_error&) {
    if (threads_.empty()) throw;  // the system gives no more: these do the work
  }
}

void Rollout::add(Task task) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.emplace_back(outcomes_.size(), std::move(task));
    outcomes_.emplace_back();
  }
  added_.notify_one();
}

// Until no more than `left` tasks are unfinished, or for so long [s]; returns how many are done.
std::size_t Rollout::wait(std::size_t left, double seconds) {
  std::unique_lock lock(mutex_);
  finished_.wait_for(lock, std::chrono::duration<double>(seconds),
                     [&] { return outcomes_.size() - done_ <= left; });
  return done_;
}

std::vector<Lent> Rollout::give_back() {
  const std::lock_guard lock(mutex_);
  return std::exchange(lent_, {});
}

// Runs under way see the flag and end after their step.
void Rollout::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  added_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

// Takes the tasks in the order in which they were added, until stop().
void Rollout::work() {
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

Outcome Rollout::run(Task task, Lent& lent) const {
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
    out.time = run.time();
    out.last_step = run.last_step();
    out.wall_time = run.wall_time();
    out.counts = run.counts();
    out.q = run.q();
    out.v = run.v();
    out.summaries = run.summaries();
    out.limits = run.limits();
    lent = run.give_back();
  } catch (const std::exception& error) {
    out.fault = error.what();
  }
  return out;
}

}  // namespace sphshell
