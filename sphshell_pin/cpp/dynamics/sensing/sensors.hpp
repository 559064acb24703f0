// What a robot's computer knows of a run: sampled, filtered, noisy, limited and delayed readings.
#pragma once

#include <deque>

#include "dynamics/control/fields.hpp"
#include "dynamics/control/push.hpp"
#include "dynamics/run/recording.hpp"

namespace sphshell {

// What a sensor may look at: a state at which the scene and its inverse dynamics were evaluated.
struct Evaluated {
  const SceneData& scene;
  const Push& push;
  const VectorX& acceleration;
};

// A kind of signal.
class Measured {
 public:
  virtual ~Measured() = default;
  virtual int size() const = 0;
  // Writes size() values.
  virtual void read(const Evaluated& at, double* out) const = 0;
  // Of a switch, which has neither noise nor range: its position by the signal and the one before.
  virtual std::optional<bool> position(double /*signal*/, bool /*before*/) const { return {}; }
  // Whether it reads what inverse dynamics give.
  virtual bool is_dynamic() const { return true; }
};

// The signal that files call `kind`; the fields are those of its class in dynamics/sensing/.
std::shared_ptr<const Measured> make_measured(const std::string& kind, const Fields& fields);

// What is measured, and what becomes of the signal on its way.
struct Sensor {
  std::shared_ptr<const Measured> signal;
  double rate = 1000, delay = 0;  // [Hz], [s]
  double cutoff = 0;              // of the low-pass filter before the sampling [Hz]; 0: none
  // Of each value: largest, and standard deviation of a sample.
  std::vector<double> range = {}, noise = {};
  std::uint64_t seed = 0;

  int size() const { return signal->size(); }
};

// A normal random number that depends on the three alone: the same bits on every machine.
double normal_noise(std::uint64_t seed, std::uint64_t sample, std::uint64_t value);

// The sensors of one run. A step is never shortened for them: they look at its dense output or,
// where its length is fixed, between the signals at its ends.
class Sensors {
 public:
  // Samples are due at start + k / rate [s].
  Sensors(std::vector<Sensor> sensors, SceneData& scene, Torques& torques, const Push& push,
          double start);

  // What controllers read before the first sample: the scene's last state without acceleration.
  void hold_still(const State& state);
  // The first sample, where the run begins; filters begin settled.
  void begin(const State& state);
  bool begun() const { return begun_; }
  // Torques, forces or laws have changed where the next step begins.
  void jump() { jumped_ = true; }
  // A step begins at a state, at which the scene was last evaluated.
  void begin_step(const State& state);
  // The step that was made, of the fixed length `dt` or a part of it; the scene was last evaluated
  // at its end.
  void add_fixed(const Stepping& made, double dt);
  // The same of any length, with its dense output. Leaves the forces evaluated at its end.
  void add_dense(const Stepping& made);

  // The latest of all sensors, one after the other.
  const std::vector<double>& readings() const { return readings_; }
  // Hands over what has arrived since the last call.
  SensorRows take();

 private:
  struct Reading {
    double arrival, sampled;
    std::vector<double> values;
  };
  struct Channel {
    Sensor sensor;
    int at;           // of its first value among those of all sensors
    long sample = 0;  // next
    bool on = false;  // of a switch
    std::deque<Reading> under_way;
  };

  // The signals at a state, into measured_: with the acceleration there, or with the last one.
  void measure(const State& state);
  void read_all(const State& state);
  template <class Signal>
  void march(double from, double to, const Signal& signal);
  // Moves the filters on by h; takes samples that are due at t; one value of a sample; hands over
  // readings that have arrived by t.
  void filter(double h);
  void sample(double t);
  double value(Channel& channel, int i, bool noisy) const;
  void deliver(double t);
  double due(const Channel& channel) const {
    return start_ + double(channel.sample) / channel.sensor.rate;
  }
  // The time of the next sample of any sensor.
  double next_due() const;
  double hair(double t) const;

  SceneData& scene_;
  Torques& torques_;
  const Push& push_;
  std::vector<Channel> channels_;
  double start_, shortest_ = kInfinity;  // period of sampling [s]
  double piece_ = kInfinity;             // filters are integrated over pieces no longer [s]
  bool filtered_ = false, dynamic_ = false;
  bool begun_ = false, jumped_ = false, known_ = false;
  // The signals of all sensors: measured last, and at the begin, in the middle and at the end of a
  // piece; behind the filters.
  std::vector<double> measured_, before_, middle_, after_, smooth_, readings_;
  SensorRows rows_;
  Forces external_;
  VectorX acceleration_;
  State between_;
};

}  // namespace sphshell
