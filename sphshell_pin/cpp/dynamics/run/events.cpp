#include "dynamics/run/events.hpp"

#include <boost/math/tools/toms748_solve.hpp>

namespace sphshell {

// How far outside the sphere contacts are looked for, as a share of the radius.
constexpr double kMargin = 0.25;
constexpr std::uintmax_t kMostLooks = 200;

static long count_positive(const std::vector<double>& values) {
  return std::count_if(values.begin(), values.end(), [](double value) { return value > 0; });
}

// Of a law that clamps its force at zero, less than zero where it acts. Laws are linear in the
// rate: the force against the opposite rate is 2 elastic - unclamped.
static double clamp_gauge(const NormalLaw& law, double depth, double gap_rate, double force,
                          double scale = 0) {
  if (force > 0) return -force;
  const NormalForce<double> opposed = law.force(depth, -gap_rate, scale);
  return opposed.total - 2 * opposed.elastic;
}

Events::Start Events::now(std::size_t k) const {
  const TouchState& at = scene_.touch(k);
  const bool is_pair = k < scene_.pairs().size();
  return {at.pieces, at.clamped, is_pair ? scene_.states()[k].center : Vec3(Vec3::Zero())};
}

void Events::begin() {
  for (std::size_t k = 0; k < at_begin_.size(); ++k) at_begin_[k] = now(k);
}

bool Events::changed(std::size_t k) const {
  // Numbers of contacts, less saddles, and of clamped ones.
  const Start state = now(k);
  return state.pieces != at_begin_[k].pieces || state.clamped != at_begin_[k].clamped;
}

bool Events::met() const {
  for (std::size_t k = 0; k < at_begin_.size(); ++k)
    if (changed(k)) return true;
  return false;
}

bool Events::met_at(double theta, const Motion& motion, const Chart& chart) {
  ++queries_;
  motion(theta, y_);
  chart.finish(chart.origin().t, y_, state_);
  scene_.evaluate(state_.q, state_.v, state_.z);
  return met();
}

// A sphere that is larger by the margin has contacts with a gap, too.
void Events::measure(std::size_t k, double margin, Gauges& out) {
  for (std::vector<double>& values : out) values.clear();
  // Behind the pairs come the stops of joints.
  if (k >= scene_.pairs().size()) {
    const std::size_t i = k - scene_.pairs().size();
    const TouchState& state = scene_.touch(k);
    const JointStop& stop = scene_.joints().effects()->stops[i];
    out[Minimum].push_back(state.depth);
    if (state.count > 0)
      out[Clamp].push_back(
          clamp_gauge(stop.law, state.depth, -stop.sign * state_.v[stop.v], state.normal_force));
    return;
  }
  const Pair& pair = scene_.pairs()[k];
  const Vec3& center = scene_.states()[k].center;
  pair.ask([&](const auto& one) { one.find_near(center, pair.radius, margin, query_); });
  for (const Contact& contact : query_.contacts)
    out[contact.weight > 0 ? Minimum : Saddle].push_back(contact.depth);
  for (const ActiveContact& active : scene_.active()) {
    if (active.pair != static_cast<int>(k)) continue;
    const ContactKinematics<double>& m = active.kinematics;
    out[Clamp].push_back(
        clamp_gauge(pair.law, m.depth, m.normal.dot(m.relative), active.force.normal, m.scale));
  }
  for (std::vector<double>& values : out)
    std::sort(values.begin(), values.end(), std::greater<double>());
}

// Root finding on a continuous quantity (a depth, or the unclamped force), with the sign of met(),
// so that the step ends on the right side whatever else happens. TOMS 748: Alefeld, Potra and Shi,
// ACM Trans. Math. Softw. 21 (1995) 327.
double Events::locate(double before, double after, double tolerance, const Motion& motion,
                      const Chart& chart) {
  met_at(after, motion, chart);
  std::size_t k = 0;
  while (k + 1 < at_begin_.size() && !changed(k)) ++k;
  const double radius = k < scene_.pairs().size() ? scene_.pairs()[k].radius : 0;
  const Vec3 end = now(k).center;
  const double margin = std::min(1.1 * (end - at_begin_[k].center).norm(), kMargin * radius);
  measure(k, margin, after_);
  met_at(before, motion, chart);
  const Vec3 start = now(k).center;
  measure(k, margin, before_);

  // The quantity that changes its sign, and where it stands at both ends.
  int kind = 0;
  while (kind < kKinds && count_positive(before_[kind]) == count_positive(after_[kind])) ++kind;
  std::size_t index = 0;
  double known = 0;
  Vec3 from = end;
  if (kind < kKinds) {
    // Sorted from large to small: the quantity with this index is the one that passes through zero.
    const long counts[] = {count_positive(before_[kind]), count_positive(after_[kind])};
    index = static_cast<std::size_t>(std::min(counts[0], counts[1]));
    const bool comes = counts[1] > counts[0];
    known = (comes ? after_ : before_)[kind][index];
    if (!comes) from = start;
  }
  // Its sign is that of met(), whatever else happens in the step.
  const auto value = [&](const Gauges& gauges, const Vec3& center, bool is_met) {
    double size = 1;
    if (kind < kKinds) {
      // Out of sight, a contact is farther than the margin; a depth changes no faster than the
      // center moves.
      size = gauges[kind].size() > index ? std::abs(gauges[kind][index])
             : kind == Clamp             ? known
                                         : std::max(margin, (center - from).norm() - known);
      size = std::max(size, std::numeric_limits<double>::min());
    }
    return is_met ? size : -size;
  };
  std::uintmax_t looks = kMostLooks;
  const auto bracket = boost::math::tools::toms748_solve(
      [&](double theta) {
        const bool is_met = met_at(theta, motion, chart);
        if (kind < kKinds) measure(k, margin, between_);
        return value(between_, now(k).center, is_met);
      },
      before, after, value(before_, start, false), value(after_, end, true),
      [&](double a, double b) { return b - a <= tolerance; }, looks);
  return bracket.second;
}

}  // namespace sphshell
