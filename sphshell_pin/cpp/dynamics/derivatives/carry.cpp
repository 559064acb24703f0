// Derivatives of the steps of each method: of what it computes, not of what it approximates.

#include "dynamics/derivatives/step_derivatives.hpp"
#include "dynamics/integrators/explicit.hpp"
#include "dynamics/integrators/implicit.hpp"

namespace sphshell {

using Changes = StepSlopes::Coordinates;

static void add(Changes& to, double share, const Changes& rates) {
  to.u += share * rates.u;
  to.w += share * rates.w;
  to.z += share * rates.z;
}

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
void Stepper::carry_along(StepSlopes& slopes, Chart& chart, double h, Tangent& tangent) const {
  slopes.along(chart, *this, h, 1, tangent);
}

void SemiImplicitEuler::carry(StepSlopes& slopes, Chart& chart, double h, Tangent& tangent) const {
  // The method's own formulas, differentiated line by line.
  Changes at = slopes.at_origin(), rates;
  slopes.rates(chart, chart.origin().t, start_, at, rates);
  at.w += h * rates.w;
  at.u = h * at.w;
  if (chart.nz() > 0)
    at.z += h * slopes.bristle_rates(chart, y_.segment(chart.nv(), chart.nv()), at.w);
  slopes.finish(chart, y_, at, tangent);
}

// Every stage's state changes with the stages before it.
void ExplicitRungeKutta::carry(StepSlopes& slopes, Chart& chart, double h, Tangent& tangent) const {
  const double t = chart.origin().t;
  const Changes start = slopes.at_origin();
  // One set of changes for each stage.
  std::vector<Changes> rates(k_.size());
  slopes.rates(chart, t, start_, start, rates[0]);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    VectorX y = start_;
    Changes at = start;
    for (std::size_t j = 0; j <= i; ++j) {
      if (rows_[i].a[j] == 0) continue;
      y += h * rows_[i].a[j] * k_[j];
      add(at, h * rows_[i].a[j], rates[j]);
    }
    slopes.rates(chart, t + rows_[i].node * h, y, at, rates[i + 1]);
  }
  Changes end = start;
  for (std::size_t i = 0; i < weights_.size(); ++i) add(end, h * weights_[i], rates[i]);
  slopes.finish(chart, y_, end, tangent);
}

// With (I / h - J) k = f for the change k of y, (I / h - J) dk = df + dJ k. The last term is the
// second derivative of the rates, of which one direction, k, is differenced.
void LinearlyImplicitEuler::carry(StepSlopes& slopes, Chart& chart, double h,
                                  Tangent& tangent) const {
  constexpr double kShare = 1e-3;  // of the step
  const double t = chart.origin().t;
  const Changes start = slopes.at_origin();
  Changes right, before, after;
  slopes.rates(chart, t, start_, start, right);
  for (const auto& [sign, bent] : {std::pair(-1.0, &before), std::pair(1.0, &after)}) {
    const VectorX y = start_ + sign * kShare * (y_ - start_);
    slopes.rates(chart, t + sign * kShare * h, y, start, *bent);
  }
  const Changes bend{beside_kinks(before.u, right.u, after.u),
                     beside_kinks(before.w, right.w, after.w),
                     beside_kinks(before.z, right.z, after.z)};
  add(right, 1 / kShare, bend);
  const Eigen::Index nv = chart.nv(), nz = chart.nz();
  MatrixX all(2 * nv + nz, right.u.cols());
  all << right.u, right.w, right.z;
  const MatrixX change = solved(all);
  Changes end = start;
  add(end, 1, {change.topRows(nv), change.middleRows(nv, nv), change.bottomRows(nz)});
  slopes.finish(chart, y_, end, tangent);
}

}  // namespace sphshell
