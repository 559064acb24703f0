#include "dynamics/sensing/sensors.hpp"

#include <bitset>

namespace sphshell {
namespace {

// Pieces of a filter's period. A sine at the cutoff is then followed to 1e-4 of its amplitude.
constexpr double kPieces = 8;

// Steele, Lea, Flood, OOPSLA 2014: one step of SplitMix64.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

// Weights of a signal s0 + b u + c u^2, u from 0 to 1, in a filter after z = h / time constant.
struct Weights {
  double constant, linear, square;
};

Weights weights(double z) {
  // 1 - e^-z; w1 and w2 by recursion of the integrals of u^n e^-z(1-u), by series where they would
  // cancel.
  const double w0 = -std::expm1(-z);
  if (z > 0.03) {
    const double w1 = 1 - w0 / z;
    return {w0, w1, 1 - 2 * w1 / z};
  }
  double w1 = 0, w2 = 0, term = -1;  // (-z)^k / (k + 1)!
  for (int k = 1; k < 8; ++k) {
    term *= -z / (k + 1);
    w1 += term;
    w2 += 2 * term / (k + 2);
  }
  return {w0, w1, w2};
}

bool has(const std::vector<int>& sorted, int one) {
  return std::binary_search(sorted.begin(), sorted.end(), one);
}

// The wrench that the parts before a frame exert on those beyond it: in the frame, about its
// origin.
class ForceTorque : public Measured, Fields {
 public:
  explicit ForceTorque(const Fields& fields) : Fields(fields) {
    // Mass, first and second moments, as of Pinocchio's dynamic parameters; no mass: nothing is
    // beyond the sensor.
    if (const VectorX& parameters = vector("inertia"); parameters[0] > 0)
      inertia_ = pinocchio::Inertia::FromDynamicParameters(parameters);
  }

  int size() const override { return 6; }

  void read(const Evaluated& at, double* out) const override {
    const Multibody& body = at.scene.body();
    const pinocchio::Motion& v = body.transmitted_velocity(joint_);
    // Newton and Euler for what moves with this joint; its acceleration holds gravity's.
    pinocchio::Force sum = inertia_ * body.transmitted_acceleration(joint_) + inertia_.vxiv(v);
    for (int child : children_) sum += body.transmitted_to_parent(child);
    const SE3& pose = joint_ == 0 ? SE3::Identity() : body.world_from_joint(joint_);
    const auto take_off = [&](const ContactWrench& wrench, double sign) {
      // Into the joint's frame, about its origin.
      const Vec3 force = sign * (pose.rotation().transpose() * wrench.force);
      sum.linear() -= force;
      sum.angular() -= pose.actInv(wrench.point).cross(force) +
                       sign * (pose.rotation().transpose() * wrench.moment);
    };
    if (at.scene.touching())
      for (const ActiveContact& active : at.scene.active()) {
        if (has(pairs_i_, active.pair)) take_off(at.scene.wrench(active), 1);
        if (has(pairs_j_, active.pair)) take_off(at.scene.wrench(active), -1);
      }
    if (at.push.active() && has(frames_, at.push.frame())) sum -= at.push.on_joint(body);
    const pinocchio::Force seen = frame_.actInv(sum);
    Eigen::Map<Vec3>{out} = seen.linear();
    Eigen::Map<Vec3>{out + 3} = seen.angular();
  }

 private:
  const int joint_ = integer("joint");  // that carries the frame
  const SE3 frame_ = frame("frame");    // in that joint
  pinocchio::Inertia inertia_ =
      pinocchio::Inertia::Zero();  // of what is beyond it on this joint, in that joint
  const std::vector<int> children_ =
      list<int>("children");  // joints beyond it that hang on this joint
  // Whose body i or j, and which, are beyond it on this joint.
  const std::vector<int> pairs_i_ = list<int>("pairs_i"), pairs_j_ = list<int>("pairs_j"),
                         frames_ = list<int>("frames");
};

// The generalized force that a joint transmits behind the gear: without what its own rotor takes.
class JointTorque : public Measured, Fields {
 public:
  explicit JointTorque(const Fields& fields) : Fields(fields) {}
  int size() const override { return 1; }
  void read(const Evaluated& at, double* out) const override {
    const Multibody& body = at.scene.body();
    *out = body.transmitted()[index_] - body.model().armature[index_] * at.acceleration[index_];
  }

 private:
  const int index_ = integer("index");  // of its velocity
};

// The sum of the normal forces of its pairs; 1 once that is above the threshold, 0 once it is below
// `release` [N].
class ContactSwitch : public Measured, Fields {
 public:
  explicit ContactSwitch(const Fields& fields) : Fields(fields) {}
  int size() const override { return 1; }
  void read(const Evaluated& at, double* out) const override {
    double sum = 0;
    for (int pair : pairs_) sum += at.scene.states()[pair].normal_force;
    *out = sum;
  }
  std::optional<bool> position(double signal, bool before) const override {
    return before ? signal >= release_ : signal > threshold_;
  }
  bool is_dynamic() const override { return false; }

 private:
  const std::vector<int> pairs_ = list<int>("pairs");
  const double threshold_ = number("threshold"), release_ = number("release");
};

// A new sensor is its class above and one line here, and a class of that kind in Python.
constexpr KindOf<const Measured> kSensors[] = {
    {"force-torque", make_of<const Measured, ForceTorque>},
    {"joint-torque", make_of<const Measured, JointTorque>},
    {"contact-switch", make_of<const Measured, ContactSwitch>},
};

}  // namespace

std::shared_ptr<const Measured> make_measured(const std::string& kind, const Fields& fields) {
  return make_from(kSensors, kind, fields);
}

// The sum of 256 fair bits, whose steps two uniform numbers fill. It calls nothing of the system's
// mathematical library, whose last digits differ between machines.
double normal_noise(std::uint64_t seed, std::uint64_t sample, std::uint64_t value) {
  // A function of seed, sample and value alone: noise does not depend on the order of runs or
  // threads.
  const std::uint64_t key = mix(mix(mix(seed) ^ sample) ^ value);
  double sum = -128;
  for (std::uint64_t i = 0; i < 4; ++i)
    sum += static_cast<double>(std::bitset<64>(mix(key ^ mix(i))).count());
  const std::uint64_t rest = mix(key ^ mix(4));
  sum +=
      static_cast<double>(rest >> 32) * 0x1p-32 - static_cast<double>(rest & 0xffffffffu) * 0x1p-32;
  // The variance is 256 / 4 + 2 / 12.
  constexpr double kDeviation = 8.010409893800427;
  return sum / kDeviation;
}

Sensors::Sensors(std::vector<Sensor> sensors, SceneData& scene, Torques& torques, const Push& push,
                 double start)
    : scene_(scene),
      torques_(torques),
      push_(push),
      start_(start),
      external_(scene.body().model().joints.size(), pinocchio::Force::Zero()) {
  int size = 0;
  for (Sensor& sensor : sensors) {
    shortest_ = std::min(shortest_, 1 / sensor.rate);
    if (sensor.cutoff > 0) {
      filtered_ = true;
      piece_ = std::min(piece_, 1 / (kPieces * sensor.cutoff));
    }
    dynamic_ = dynamic_ || sensor.signal->is_dynamic();
    channels_.push_back({std::move(sensor), size, 0, false, {}});
    size += channels_.back().sensor.size();
  }
  for (auto* values : {&measured_, &before_, &middle_, &after_, &smooth_, &readings_})
    values->resize(static_cast<std::size_t>(size));
}

// Before the first torque: at rest, without noise or delay.
void Sensors::hold_still(const State& state) {
  acceleration_.setZero(state.v.size());
  read_all(state);
  smooth_ = measured_;
  for (Channel& channel : channels_)
    for (int i = 0; i < channel.sensor.size(); ++i)
      readings_[channel.at + i] = value(channel, i, false);
}

// The first sample, with the first acceleration.
void Sensors::begin(const State& state) {
  begun_ = true;
  measure(state);
  smooth_ = before_ = measured_;
  known_ = true;
  jumped_ = false;
  sample(state.t);
  deliver(state.t);
}

// Where a torque has jumped, the signal before the step is measured anew.
void Sensors::begin_step(const State& state) {
  if (!std::exchange(jumped_, false) || !known_) return;
  measure(state);
  before_ = measured_;
}

// Between the ends of a fixed step signals are linear in time.
void Sensors::add_fixed(const Stepping& made, double dt) {
  const State &from = made.state(), &to = made.next();
  const double next = next_due(), margin = hair(to.t);
  const bool used = filtered_ || next <= to.t + margin;
  // The next step begins where this one ends.
  const bool needed = used || next < to.t + dt - margin;
  if (needed) {
    measure(to);
    if (used) {
      const double h = to.t - from.t;
      // measured_ is overwritten by what march() asks for.
      const std::vector<double> start = known_ ? before_ : measured_, end = measured_;
      march(from.t, to.t, [&](double t, std::vector<double>& out) {
        const double share = (t - from.t) / h;
        for (std::size_t i = 0; i < out.size(); ++i)
          out[i] = share < 1 ? start[i] + share * (end[i] - start[i]) : end[i];
      });
    }
    before_ = measured_;
  }
  known_ = needed;
  deliver(to.t);
}

// Signals at any time within the step come from the dense output.
void Sensors::add_dense(const Stepping& made) {
  const State &from = made.state(), &to = made.next();
  if (filtered_ || next_due() <= to.t + hair(to.t)) {
    scene_.restart();
    march(from.t, to.t, [&](double t, std::vector<double>& out) {
      if (t < to.t) made.interpolate((t - from.t) / (to.t - from.t), t, between_);
      const State& state = t < to.t ? between_ : to;
      scene_.evaluate(state.q, state.v, state.z);
      measure(state);
      out = measured_;
    });
    scene_.evaluate_anew(to.q, to.v, to.z);
  }
  known_ = filtered_;
  deliver(to.t);
}

// Takes the samples that are due and moves the filters on; `signal` gives the signals at a time.
template <class Signal>
void Sensors::march(double from, double to, const Signal& signal) {
  const double margin = hair(to);
  for (double t = from; t < to;) {
    double next = next_due();
    if (filtered_) next = std::min({next, t + piece_, to});
    if (next > to + margin) return;
    if (next > to - margin) next = to;
    if (filtered_) signal(0.5 * (t + next), middle_);
    signal(next, after_);
    if (filtered_)
      filter(next - t);
    else
      smooth_ = after_;
    before_ = after_;
    t = next;
    sample(t);
  }
}

void Sensors::filter(double h) {
  for (const Channel& channel : channels_) {
    const double cutoff = channel.sensor.cutoff;
    const std::size_t begin = channel.at, end = begin + channel.sensor.size();
    if (cutoff == 0) {
      std::copy(after_.begin() + begin, after_.begin() + end, smooth_.begin() + begin);
      continue;
    }
    // The exact solution of the low-pass filter for a parabola through start, middle and end.
    const Weights w = weights(2 * M_PI * cutoff * h);
    for (std::size_t i = begin; i < end; ++i) {
      const double s0 = before_[i], b = 4 * middle_[i] - 3 * s0 - after_[i];
      const double c = 2 * (s0 + after_[i] - 2 * middle_[i]);
      smooth_[i] += w.constant * (s0 - smooth_[i]) + w.linear * b + w.square * c;
    }
  }
}

// All samples of all sensors that are due; each is on its way for the sensor's delay.
void Sensors::sample(double t) {
  const double limit = t + hair(t);
  for (Channel& channel : channels_)
    for (; due(channel) <= limit; ++channel.sample) {
      const double when = due(channel);
      Reading reading{when + channel.sensor.delay, when, {}};
      for (int i = 0; i < channel.sensor.size(); ++i)
        reading.values.push_back(value(channel, i, true));
      channel.under_way.push_back(std::move(reading));
    }
}

// Of a sample: with noise, and within the range. A switch keeps its position.
double Sensors::value(Channel& channel, int i, bool noisy) const {
  const Sensor& sensor = channel.sensor;
  const double signal = smooth_[channel.at + i];
  if (const auto position = sensor.signal->position(signal, channel.on))
    return (channel.on = *position) ? 1 : 0;
  double noise = 0;
  if (noisy && sensor.noise[i] > 0)
    noise = sensor.noise[i] * normal_noise(sensor.seed, static_cast<std::uint64_t>(channel.sample),
                                           static_cast<std::uint64_t>(i));
  return std::clamp(signal + noise, -sensor.range[i], sensor.range[i]);
}

// Readings arrive in the order of their samples.
void Sensors::deliver(double t) {
  const double limit = t + hair(t);
  for (std::size_t k = 0; k < channels_.size(); ++k) {
    std::deque<Reading>& under_way = channels_[k].under_way;
    for (; !under_way.empty() && under_way.front().arrival <= limit; under_way.pop_front()) {
      const Reading& reading = under_way.front();
      std::copy(reading.values.begin(), reading.values.end(), readings_.begin() + channels_[k].at);
      rows_.sensor.push_back(static_cast<int>(k));
      rows_.t.push_back(reading.arrival);
      rows_.sampled.push_back(reading.sampled);
      rows_.values.insert(rows_.values.end(), reading.values.begin(), reading.values.end());
    }
  }
}

SensorRows Sensors::take() { return std::exchange(rows_, {}); }

double Sensors::next_due() const {
  double out = kInfinity;
  for (const Channel& channel : channels_) out = std::min(out, due(channel));
  return out;
}

// Times closer than this are the same: the grids of steps and of samples need not agree to the last
// bit.
double Sensors::hair(double t) const {
  return std::max(1e-9 * shortest_, 4 * std::numeric_limits<double>::epsilon() * std::abs(t));
}

void Sensors::measure(const State& state) {
  if (dynamic_) {
    const VectorX& tau = torques_.torque(state.t, state.q, state.v);
    acceleration_ = scene_.acceleration(state.q, state.v, tau);
  }
  read_all(state);
}

// With the acceleration as it is.
void Sensors::read_all(const State& state) {
  if (dynamic_) {
    if (scene_.touching())
      external_ = scene_.external();
    else
      std::fill(external_.begin(), external_.end(), pinocchio::Force::Zero());
    if (push_.active()) external_[push_.joint()] += push_.on_joint(scene_.body());
    scene_.body().transmit(state.q, state.v, acceleration_, external_);
  }
  const Evaluated at{scene_, push_, acceleration_};
  for (const Channel& channel : channels_) channel.sensor.signal->read(at, &measured_[channel.at]);
}

}  // namespace sphshell
