// Shares of places in a contact: a concave quadratic program over the simplex.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "contact/query/contact.hpp"

namespace sphshell {

// Finds the shares w >= 0 of sum 1 that maximize
//
//   sum w lead - (|sum w from|^2 + ridge sum w^2) / 2
//
// by an active-set method (Nocedal, Wright, Numerical Optimization, 16.5). Its systems are ridge +
// X X^T with the places `from` of the active items as rows of X: by Woodbury's formula one of
// three. An Item has `from`, `lead`, `share`, `active` (whether it has a share) and `solution` (of
// the last system).
template <class Item>
class Shares {
 public:
  Shares(std::vector<Item>& items, double ridge) : items_(items), ridge_(ridge) {}

  // Begins at an item that lies in the origin.
  void maximize(Item& first) {
    for (Item& one : items_) one.share = 0, one.active = false;
    first.share = 1, first.active = true;
    double level = first.lead - ridge_;
    for (std::size_t round = 0; round < kMostRounds * items_.size(); ++round) {
      Item* entering = find_entering(level);
      if (!entering) break;
      entering->active = true;
      level = settle();
    }
    factor();
  }
  // Sets `solution` to what the active shares change by when the leads do, by change(item).
  template <class Change>
  void follow(const Change& change) {
    solve(change, 0);
  }

 private:
  // An item enters where it gains more than this share of the ridge: less is the rounding of leads,
  // which are some 1e4 ridges where the maximum is decided.
  static constexpr double kLeastGain = 1e-12;
  // The share of an item that leaves is zero but for this rounding; shares are at most one.
  static constexpr double kLeastShare = 1e-15;
  // Each round raises the maximum, so the method ends: more rounds an item are rounding.
  static constexpr std::size_t kMostRounds = 20;

  void factor() {
    Mat3 sum = ridge_ * Mat3::Identity();
    for (const Item& one : items_)
      if (one.active) sum += one.from * one.from.transpose();
    small_.compute(sum);
  }

  // Solves (ridge + X X^T) w = value - level with the level for which w has the sum; returns that.
  template <class Value>
  double solve(const Value& value, double sum) {
    Vec3 moment = Vec3::Zero(), ones = Vec3::Zero();
    double values = 0, count = 0;
    for (const Item& one : items_)
      if (one.active)
        moment += value(one) * one.from, ones += one.from, values += value(one), count += 1;
    moment = small_.solve(moment).eval();
    const Vec3 of_ones = small_.solve(ones);
    const double level = (values - ones.dot(moment) - ridge_ * sum) / (count - ones.dot(of_ones));
    for (Item& one : items_)
      if (one.active)
        one.solution =
            (value(one) - one.from.dot(moment) - level * (1 - one.from.dot(of_ones))) / ridge_;
    return level;
  }

  // The item without a share whose first share would raise the maximum the most.
  Item* find_entering(double level) {
    Vec3 mean = Vec3::Zero();
    for (const Item& one : items_) mean += one.share * one.from;
    Item* best = nullptr;
    double most = level + kLeastGain * ridge_;
    for (Item& one : items_) {
      const double gain = one.lead - one.from.dot(mean);
      if (!one.active && gain > most) most = gain, best = &one;
    }
    return best;
  }

  // Moves to the maximum over the active items; those whose share would be less than zero leave.
  // Returns the gain that all of them have there.
  double settle() {
    for (;;) {
      factor();
      const double level = solve([](const Item& one) { return one.lead; }, 1);
      const double step = feasible_step();
      for (Item& one : items_) {
        if (!one.active) continue;
        one.share += step * (one.solution - one.share);
        if (step == 1 || one.share > kLeastShare || one.solution >= 0) continue;
        one.share = 0, one.active = false;
      }
      if (step == 1) return level;
    }
  }

  // The part of the way to the solution after which the first share is zero.
  double feasible_step() const {
    double step = 1;
    for (const Item& one : items_)
      if (one.active && one.solution < 0)
        step = std::min(step, one.share / (one.share - one.solution));
    return step;
  }

  std::vector<Item>& items_;
  double ridge_;
  Eigen::LLT<Mat3> small_;
};

}  // namespace sphshell
