// Joint torques from the state.
#pragma once

#include "dynamics/control/fields.hpp"
#include "dynamics/scene/scene_data.hpp"

namespace sphshell {

class Controller {
 public:
  virtual ~Controller() = default;
  // Called once before a run, to ask for the placements that torque() reads.
  virtual void prepare(SceneData&) {}
  // Called once before a run that has sensors: where their latest readings will be.
  virtual void read(const std::vector<double>& /*readings*/) {}
  // Writes the torques; the scene's contacts have been evaluated at (q, v).
  virtual void torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
                      VectorX& tau) = 0;
  // Takes the place of `before` at time t, in the middle of a run: goes on from where that is.
  virtual void take_over(const Controller& /*before*/, double /*t*/) {}
  // Implicit integrators difference the torques by the state, and if they follow it, by time.
  virtual bool follows_time() const { return false; }
  // The next time at which the torques bend or jump.
  virtual double next_kink(double /*t*/) const { return std::numeric_limits<double>::infinity(); }
};

// The controller that files call `kind`; the fields are those of its class in dynamics/control/.
std::shared_ptr<Controller> make_controller(const std::string& kind, const Fields& fields);

}  // namespace sphshell
