#include "bindings/law_integral.hpp"

#include "contact/laws/gauss.hpp"

namespace sphshell {

constexpr double kFirst = 0x1p-20;    // where the octaves begin: a depth of 1e-12 m [m^0.5]
constexpr double kTolerance = 1e-11;  // of an interval, as a share of the energy so far
constexpr int kMostHalvings = 24;
constexpr int kMostJumps = 1000;  // noise has one everywhere: then no interval is halved any more

// The rule is exact for a sum of powers of the depth, halves among them, up to the seventh.
double LawIntegral::gauss(double from, double to, const double* parameters) const {
  const GaussRule& rule = gauss_rule(8);
  double sum = 0;
  for (int i = 0; i < rule.size; ++i) {
    const double s = from + rule.nodes[i] * (to - from), force = force_(s * s, 0.0, parameters);
    sum += rule.weights[i] * 2 * s *
           OwnFunction::finite(force, "force of a FunctionLaw", "depth [m]", s * s,
                               "gap rate [m/s]", 0);
  }
  return sum * (to - from);
}

void LawIntegral::divide(double from, double to, double whole, const double* parameters,
                         int halvings, Table& table) const {
  const double middle = (from + to) / 2;
  const double low = gauss(from, middle, parameters), high = gauss(middle, to, parameters);
  const double size = std::abs(table.energy) + std::abs(low) + std::abs(high);
  if (halvings == 0 || table.jumps > kMostJumps ||
      std::abs(low + high - whole) <= kTolerance * size) {
    table.jumps += halvings == 0;
    table.intervals.push_back({from, table.energy});
    table.energy += whole;
    return;
  }
  divide(from, middle, low, parameters, halvings - 1, table);
  divide(middle, to, high, parameters, halvings - 1, table);
}

double LawIntegral::operator()(double depth, const double* parameters) const {
  const double s = std::sqrt(std::max(depth, 0.0));
  std::shared_ptr<const Table> table = std::atomic_load(&found_->table);
  if (!table || s > table->end) {
    Table longer;
    if (table)
      longer = *table;
    else
      longer = {{{0, 0}}, kFirst, gauss(0, kFirst, parameters)};
    while (longer.end < s) {
      const double from = longer.end;
      longer.end *= M_SQRT2;
      divide(from, longer.end, gauss(from, longer.end, parameters), parameters, kMostHalvings,
             longer);
    }
    table = std::make_shared<const Table>(std::move(longer));
    std::atomic_store(&found_->table, table);
  }
  const auto after = std::upper_bound(table->intervals.begin(), table->intervals.end(), s,
                                      [](double x, const Interval& one) { return x < one.start; });
  const Interval& at = *std::prev(after);
  return at.energy + gauss(at.start, s, parameters);
}

}  // namespace sphshell
