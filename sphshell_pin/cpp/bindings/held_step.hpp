// A step of an integrator under held torques, and its derivatives.
#pragma once

#include "bindings/evaluations.hpp"
#include "dynamics/derivatives/step_derivatives.hpp"
#include "dynamics/integrators/stepper.hpp"

namespace sphshell {

// The scene is left as it was.
class HeldStep {
 public:
  HeldStep(const At& at, const std::string& integrator, double dt, const VectorX& tau)
      : scene_(at.scene),
        before_(scene_.least_relaxation()),
        dt_(dt),
        torques_(tau),
        stepper_(make_stepper(integrator, scene_)),
        chart_(scene_, torques_),
        start_{0, at.q, at.v, at.state.bristles(), {}} {
    // Explicit steps of this length hold bristles back.
    scene_.relax_in(stepper_->is_implicit() ? 0 : dt);
    chart_.begin(start_);
    scene_.evaluate(start_.q, start_.v, start_.z, true);
  }
  ~HeldStep() {
    scene_.restart();
    scene_.relax_in(before_);
  }

  // The end of the step, which starts from the same state however often it is taken.
  const State& take() {
    stepper_->begin(chart_);
    stepper_->step(chart_, dt_, end_);
    return end_;
  }
  // Of the end, after take(): by the parameters of `slopes`, q, v and the torques, in columns.
  MatrixX derivatives(StepSlopes& slopes) {
    const auto nv = start_.v.size();
    const auto first = Eigen::Index(slopes.linearization().parameters().size());
    MatrixX out = MatrixX::Zero(2 * nv + start_.z.size(), first + 3 * nv);
    MatrixX torque = MatrixX::Zero(nv, out.cols());
    out.block(0, first, 2 * nv, 2 * nv).setIdentity();
    torque.rightCols(nv).setIdentity();
    slopes.carry(chart_, *stepper_, dt_, torque, out);
    return out;
  }

 private:
  class Held : public Torques {
   public:
    explicit Held(const VectorX& tau) : tau_(tau) {}
    const VectorX& torque(double, const VectorX&, const VectorX&) override { return tau_; }
    bool follow_state() const override { return false; }
    bool follow_time() const override { return false; }

   private:
    const VectorX& tau_;
  };

  SceneData& scene_;
  const double before_, dt_;
  Held torques_;
  std::unique_ptr<Stepper> stepper_;
  Chart chart_;
  const State start_;
  State end_;
};

}  // namespace sphshell
