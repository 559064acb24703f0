#include "dynamics/integrators/explicit.hpp"

namespace sphshell {

// All but the positions by the rates at the start; positions with the new velocities.
void SemiImplicitEuler::step(Chart& chart, double h, State& out) {
  const int nv = chart.nv(), all = static_cast<int>(start_.size());
  y_ = start_;
  y_.segment(nv, all - nv - Chart::kWork) += h * rate_.segment(nv, all - nv - Chart::kWork);
  // First the velocities, then the positions with the new velocities: symplectic Euler.
  y_.head(nv) = h * y_.segment(nv, nv);
  // Bristles are springs: they move like positions, with the new velocity.
  if (chart.nz() > 0)
    y_.segment(2 * nv, chart.nz()) =
        chart.origin().z + h * chart.bristle_rates_at(y_.segment(nv, nv));
  // The torque acts over the mean of both velocities.
  y_[all - 1] +=
      h * (rate_[all - 1] + 0.5 * h * chart.torque_at_origin().dot(rate_.segment(nv, nv)));
  chart.finish(chart.origin().t + h, y_, out);
}

// The first stage is the rate at the start, which steps of any length share.
void ExplicitRungeKutta::begin(Chart& chart) {
  Stepper::begin(chart);
  k_[0] = rate_;
}

// Each stage is an evaluation at the state that the stages before it predict.
void ExplicitRungeKutta::step(Chart& chart, double h, State& out) {
  const double t = chart.origin().t;
  h_ = h;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    // Zeros of the tableau cost nothing.
    stage_ = start_;
    for (std::size_t j = 0; j <= i; ++j)
      if (rows_[i].a[j] != 0) stage_ += h * rows_[i].a[j] * k_[j];
    chart.rate(t + rows_[i].node * h, stage_, k_[i + 1]);
  }
  y_ = start_;
  for (std::size_t i = 0; i < weights_.size(); ++i)
    if (weights_[i] != 0) y_ += h * weights_[i] * k_[i];
  chart.finish(t + h, y_, out);
}

// Kutta's classical tableau.
RungeKutta4::RungeKutta4()
    : ExplicitRungeKutta({{0.5, {0.5}}, {0.5, {0, 0.5}}, {1, {0, 0, 1}}},
                         {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6}) {}

// The tableau of the pair 5(4) with seven stages; the last one is the first of the next step.
DormandPrince::DormandPrince()
    : ExplicitRungeKutta(
          {{1.0 / 5, {1.0 / 5}},
           {3.0 / 10, {3.0 / 40, 9.0 / 40}},
           {4.0 / 5, {44.0 / 45, -56.0 / 15, 32.0 / 9}},
           {8.0 / 9, {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729}},
           {1, {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656}},
           {1, {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}}},
          {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}) {}

void DormandPrince::step(Chart& chart, double h, State& out) {
  // Weights of order 5 less those of order 4.
  static constexpr double kError[7] = {71.0 / 57600,      0,          -71.0 / 16695, 71.0 / 1920,
                                       -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
  ExplicitRungeKutta::step(chart, h, out);
  error_.setZero(y_.size());
  for (int i = 0; i < 7; ++i)
    if (kError[i] != 0) error_ += h * kError[i] * k_[i];
}

void DormandPrince::interpolate(double theta, VectorX& y) const {
  // Shampine's continuous extension, as in Hairer's code DOPRI5.
  static constexpr double kDense[7] = {
      -12715105075.0 / 11282082432.0,  0,
      87487479700.0 / 32700410799.0,   -10690763975.0 / 1880347072.0,
      701980252875.0 / 199316789632.0, -1453857185.0 / 822651844.0,
      69997945.0 / 29380423.0};
  const double rest = 1 - theta;
  y = start_ + theta * (y_ - start_);
  y += theta * rest * (h_ * k_[0] - (y_ - start_));
  y += theta * theta * rest * (2 * (y_ - start_) - h_ * (k_[0] + k_[6]));
  for (int i = 0; i < 7; ++i)
    if (kDense[i] != 0) y += theta * theta * rest * rest * h_ * kDense[i] * k_[i];
}

}  // namespace sphshell
