// Derivatives of the steps of each method: of what it computes, not of what it approximates.

#include "dynamics/derivatives/step_derivatives.hpp"
#include "dynamics/integrators/explicit.hpp"
#include "dynamics/integrators/implicit.hpp"

namespace sphshell {

// The differences to both sides: alike where the slopes are smooth. Where a kink is on one side, as
// a touch within what is differenced, that of the other side.
static MatrixX beside_kinks(const MatrixX& before, const MatrixX& here, const MatrixX& after) {
  constexpr double kAlike = 3;
  return (here - before).binaryExpr(after - here, [](double back, double on) {
    if (std::abs(on) > kAlike * std::abs(back)) return back;
    if (std::abs(back) > kAlike * std::abs(on)) return on;
    return 0.5 * (back + on);
  });
}

// Along the dense output, which solves the same equations to their tolerance.
void Stepper::carry_along(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const {
  slopes.along(chart, *this, h, 1, changes);
}

void SemiImplicitEuler::carry(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const {
  // The method's own formulas, differentiated line by line.
  const int nv = chart.nv();
  MatrixX at = slopes.at_origin();
  const MatrixX rates = slopes.rates(chart, chart.origin().t, start_, at);
  at.bottomRows(at.rows() - nv) += h * rates.bottomRows(at.rows() - nv);
  at.topRows(nv) = h * at.middleRows(nv, nv);
  if (chart.nz() > 0)
    at.bottomRows(chart.nz()) =
        changes.bottomRows(chart.nz()) +
        h * slopes.bristle_rates(chart, y_.segment(nv, nv), at.middleRows(nv, nv));
  changes = slopes.finish(chart, y_, at);
}

// Every stage's state changes with the stages before it.
void ExplicitRungeKutta::carry(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const {
  const double t = chart.origin().t;
  const MatrixX start = slopes.at_origin();
  // One set of changes for each stage.
  std::vector<MatrixX> rates{slopes.rates(chart, t, start_, start)};
  for (const Row& row : rows_) {
    VectorX y = start_;
    MatrixX at = start;
    for (std::size_t j = 0; j < rates.size(); ++j) {
      if (row.a[j] == 0) continue;
      y += h * row.a[j] * k_[j];
      at += h * row.a[j] * rates[j];
    }
    rates.push_back(slopes.rates(chart, t + row.node * h, y, at));
  }
  MatrixX end = start;
  for (std::size_t i = 0; i < weights_.size(); ++i) end += h * weights_[i] * rates[i];
  changes = slopes.finish(chart, y_, end);
}

// With (I / h - J) k = f for the change k of y, (I / h - J) dk = df + dJ k. The last term is the
// second derivative of the rates, of which one direction, k, is differenced.
void LinearlyImplicitEuler::carry(StepSlopes& slopes, Chart& chart, double h,
                                  MatrixX& changes) const {
  constexpr double kShare = 1e-3;  // of the step
  const MatrixX start = slopes.at_origin();
  const auto rates_at = [&](double share) {
    return slopes.rates(chart, chart.origin().t + share * h, start_ + share * (y_ - start_), start);
  };
  const MatrixX here = rates_at(0), before = rates_at(-kShare), after = rates_at(kShare);
  const MatrixX bend = beside_kinks(before, here, after);
  changes = slopes.finish(chart, y_, start + solved(here + bend / kShare));
}

}  // namespace sphshell
