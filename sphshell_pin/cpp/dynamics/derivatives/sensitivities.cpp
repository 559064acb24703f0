#include "dynamics/derivatives/sensitivities.hpp"

namespace sphshell {

// A contact that begins at the end of a step is not deeper there than by this share of its motion.
constexpr double kJustBegun = 1e-2;
// Stretches are differenced by this share of their size.
constexpr double kStretchDifference = 1e-4;
// A state just before the event at the end of a step, as a share of it; what an acceleration
// changes there at least, where it jumps, relative to its size and to the velocity over 1 s.
constexpr double kBefore = 1 - 1e-5, kJump = 1e-3;

static void append(std::vector<double>& to, const MatrixX& rows) {
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    for (Eigen::Index k = 0; k < rows.cols(); ++k) to.push_back(rows(i, k));
}

Sensitivities::Sensitivities(SceneData& scene, SensitivitySettings settings)
    : scene_(scene), slopes_(scene, std::move(settings.parameters)) {
  const Eigen::Index nv = scene.body().model().nv, nz = scene.bristle_size();
  parameters_ = static_cast<Eigen::Index>(slopes_.linearization().parameters().size());
  const Eigen::Index last = parameters_ + (settings.by_q0 ? nv : 0);
  columns_ = last + (settings.by_v0 ? nv : 0);
  now_.setZero(2 * nv + nz, columns_);
  if (settings.by_q0) now_.block(0, parameters_, nv, nv).setIdentity();
  if (settings.by_v0) now_.block(nv, last, nv, nv).setIdentity();
  torque_.setZero(nv, columns_);
}

void Sensitivities::hold(const TorqueAt& torque, const State& state) {
  slopes_.torque_slopes(torque, state.t, state.q, state.v, state.z);
  torque_ = slopes_.held(now_);
}

void Sensitivities::step(Stepping& made) {
  const State& to = made.next();
  next_ = now_;
  made_ = &made, h_ = to.t - made.state().t;
  slopes_.carry(made.chart(), made.stepper(), h_, torque_, next_);
  scene_.evaluate_anew(to.q, to.v, to.z);
}

void Sensitivities::accept(const State& to, bool located) {
  std::swap(now_, next_);
  if (located) jump(to);
  made_ = nullptr;
  if (to.z.size() == 0) return;
  if (located) begin_contacts(to);
  reorder_bristles(to.z);
}

// Forces begin and end with no depth, and torques that do not know of them go on: then nothing
// jumps. Where the acceleration does, as by a controller that counts contacts, v changes by its
// jump times the time by which the event comes earlier (Hiskens and Pai, IEEE Trans. Circuits
// Syst. I 47 (2000) 204).
void Sensitivities::jump(const State& to) {
  Torques& torques = made_->chart().torques();
  const auto acceleration = [&](const State& at) -> VectorX {
    scene_.evaluate(at.q, at.v, at.z, true);
    return scene_.acceleration(at.q, at.v, torques.torque(at.t, at.q, at.v));
  };
  State before;
  made_->interpolate(kBefore, to.t - (1 - kBefore) * h_, before);
  const VectorX first = acceleration(before);
  const std::vector<char> touching = touching_pairs();
  const Eigen::RowVectorXd end = time_of(before, touching, true);
  scene_.restart();
  const VectorX last = acceleration(to);
  // A step ends a little behind its event, where forces have grown by next to nothing.
  if ((last - first).norm() < kJump * (first.norm() + last.norm() + to.v.norm())) return;
  const Eigen::RowVectorXd begin = time_of(to, touching, false), &time = begin.size() ? begin : end;
  const Eigen::Index nv = to.v.size();
  if (time.size() > 0) now_.middleRows(nv, nv) += (first - last) * time;
}

std::vector<char> Sensitivities::touching_pairs() const {
  std::vector<char> out;
  for (const PairState& state : scene_.states()) out.push_back(state.count > 0);
  return out;
}

// How the time changes at which the shallowest contact begins, of the pairs that did not touch, or
// ends, of those that did; the scene is evaluated at the state. Empty where there is none.
Eigen::RowVectorXd Sensitivities::time_of(const State& at, const std::vector<char>& touched,
                                          bool ends) {
  const std::vector<ActiveContact>& active = scene_.active();
  std::size_t found = active.size();
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (static_cast<bool>(touched[active[i].pair]) != ends) continue;
    if (found == active.size() || active[i].contact.depth < active[found].contact.depth) found = i;
  }
  if (found == active.size()) return {};
  slopes_.linearization().contact_forces(at.q, at.v, contacts_);
  std::vector<int> row_of;
  scene_.rows_of_contacts(row_of);
  const MatrixX row = contacts_.plain_depth.row(row_of[found]);
  const double rate = row.row(0).head(at.v.size()).dot(at.v);
  if (rate == 0) return {};
  return changed(row, now_) / -rate;
}

// The time of a touch changes with the parameters. A stretch that begins there with a rate jumps
// from no change to that rate times the time by which it begins earlier.
void Sensitivities::begin_contacts(const State& to) {
  const std::vector<ActiveContact>& active = scene_.active();
  const auto is_new = [&](const ActiveContact& one) { return one.slot >= 0 && scene_.is_new(one); };
  if (std::none_of(active.begin(), active.end(), is_new)) return;
  slopes_.linearization().contact_forces(to.q, to.v, contacts_);
  std::vector<int> row_of;
  scene_.rows_of_contacts(row_of);
  const MatrixX depth_by = changed(contacts_.plain_depth, now_);
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (!is_new(active[i])) continue;
    const double rate = contacts_.plain_depth.row(row_of[i]).head(to.v.size()).dot(to.v);
    if (!(rate > 0) || active[i].contact.depth > kJustBegun * rate * h_) continue;
    const int rings = scene_.pairs()[active[i].pair].friction.rings();
    const Eigen::Index at = 3 * active[i].slot, size = 3 * rings;
    now_.middleRows(2 * to.v.size() + at, size) =
        scene_.bristle_rates().segment(at, size) * (depth_by.row(row_of[i]) / rate);
  }
}

// What SceneData::accept() makes of the stretches, of their changes.
void Sensitivities::reorder_bristles(const VectorX& z) {
  const Eigen::Index first = now_.rows() - z.size();
  const double size = z.cwiseAbs().maxCoeff();
  MatrixX out;
  for (Eigen::Index k = 0; k < columns_; ++k) {
    const VectorX column = now_.col(k).tail(z.size());
    const double change = column.cwiseAbs().maxCoeff();
    const double share = size > 0 && change > 0 ? kStretchDifference * size / change : 1;
    VectorX more = z + share * column, less = z - share * column;
    scene_.reorder_bristles(more);
    scene_.reorder_bristles(less);
    if (k == 0) out.resize(more.size(), columns_);
    out.col(k) = (more - less) / (2 * share);
  }
  now_.conservativeResize(first + out.rows(), columns_);
  now_.bottomRows(out.rows()) = out;
}

// Within a step the changes are carried to the row anew, from the start of the step.
void Sensitivities::add_row(const State& state, double share) {
  const MatrixX* at = made_ ? &next_ : &now_;
  if (made_ && share < 1) {
    between_ = now_;
    slopes_.carry(made_->chart(), made_->stepper(), h_, torque_, between_, share);
    scene_.evaluate_anew(state.q, state.v, state.z, true);
    at = &between_;
  }
  append(record_.q, at->topRows(state.v.size()));
  append(record_.v, at->middleRows(state.v.size(), state.v.size()));
  slopes_.linearization().contact_forces(state.q, state.v, contacts_);
  append(record_.force_world, changed(contacts_.force_world, *at));
  append(record_.normal_force, changed(contacts_.normal_force, *at));
  append(record_.depth, changed(contacts_.depth, *at));
}

}  // namespace sphshell
