#include "adapters/mujoco.hpp"

#include <exception>

namespace sphshell {

using Eigen::Map;
using Vec3Map = Map<const Vec3>;

constexpr int kRungeKutta4 = 1;  // mjINT_RK4

// The array whose pointer a struct keeps at `offset`.
static const double* array_at(const void* from, std::size_t offset) {
  return value_at<const double*>(from, offset);
}

template <class Work>
void MujocoContacts::report_faults(const Work& work) {
  try {
    work(scratch());
  } catch (const std::exception& error) {
    const std::string text = error.what();
    {
      const std::unique_lock lock(mutex_);
      if (!fault_.empty()) return;
      fault_ = text;
    }
    setup.report(text);
  }
}

void MujocoContacts::apply(const void* model, void* data) {
  report_faults([&](Scratch& own) {
    char* const bytes = static_cast<char*>(data);
    evaluate(model, bytes, own);
    if (setup.logs && own.stage == 1) add_to_log(data, own);
    add_forces(bytes, own.scene);
  });
}

// Where the step has the stages of RK4, by their weights; else as SemiImplicitEuler does it, with
// the new velocity at the contacts where the step began: MuJoCo's kinematics are still those of
// there.
void MujocoContacts::advance(const void* model, void* data) {
  report_faults([&](Scratch& own) {
    char* const bytes = static_cast<char*>(data);
    const double dt = value_at<double>(model, setup.layout.timestep);
    if (own.data != data || (own.stage != 1 && own.stage != 4)) begin(model, bytes, own);
    if (own.stage == 4) {
      const auto& k = own.rates;
      own.z += dt / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3]);
    } else {
      const double* const qvel = array_at(data, setup.layout.qvel);
      const double* const cdof = array_at(data, setup.layout.cdof);
      read(bytes, own, [&](const MujocoBody& body) {
        Vector6 out = Vector6::Zero();
        for (const int i : body.dofs) out += qvel[i] * Map<const Vector6>(cdof + 6 * i);
        return out;
      });
      own.scene.revisit(own.q, own.v, own.z);
      own.z += dt * own.scene.bristle_rates();
    }
    own.stage = 0;
    const std::vector<double> memory = own.scene.save(own.z);
    if (memory.size() + 1 > setup.memory.size)
      throw std::length_error(
          "more contacts touch at once than memory is reserved for: reserve(spec, spheres, "
          "contacts)");
    double* const state = const_cast<double*>(array_at(data, setup.layout.plugin_state));
    double* const to = state + setup.memory.address;
    to[0] = double(memory.size());
    std::fill(std::copy(memory.begin(), memory.end(), to + 1), to + setup.memory.size, 0.0);
  });
}

std::vector<ContactRow> MujocoContacts::contacts(const void* model, const void* data) {
  Scratch& own = scratch();
  begin(model, static_cast<const char*>(data), own);
  own.stage = 0;
  std::vector<ContactRow> rows;
  own.scene.log(own.q, own.v, rows);
  return rows;
}

// Where time goes back the log ends; of several evaluations at one time the last one counts.
void MujocoContacts::add_to_log(void* data, Scratch& own) {
  const std::unique_lock lock(mutex_);
  Log& log = logs_of_[data];
  if (const auto mark = mark_of_data(data, setup.layout.mark); log.mark != mark)
    log = {mark, {}, {}};
  const auto keep = std::lower_bound(log.times.begin(), log.times.end(), own.time);
  log.times.erase(keep, log.times.end());
  log.rows.resize(log.times.size());
  own.scene.log(own.q, own.v, log.rows);
  log.times.resize(log.rows.size(), own.time);
}

std::pair<std::vector<double>, std::vector<ContactRow>> MujocoContacts::log(void* data) {
  const std::shared_lock lock(mutex_);
  const auto at = logs_of_.find(data);
  if (at == logs_of_.end() || at->second.mark != mark_of_data(data, setup.layout.mark)) return {};
  return {at->second.times, at->second.rows};
}

void MujocoContacts::forget(const void* data) {
  const std::unique_lock lock(mutex_);
  logs_of_.erase(data);
}

std::string MujocoContacts::take_fault() {
  const std::unique_lock lock(mutex_);
  return std::exchange(fault_, {});
}

MujocoContacts::Scratch& MujocoContacts::scratch() {
  const std::thread::id own = std::this_thread::get_id();
  {
    const std::shared_lock lock(mutex_);
    const auto at = scratches_.find(own);
    if (at != scratches_.end()) return *at->second;
  }
  // The copy of a law in Python waits for the interpreter's lock, whose holder may wait for mutex_.
  auto made = std::make_unique<Scratch>(setup.scene);
  const std::unique_lock lock(mutex_);
  return *(scratches_[own] = std::move(made));
}

// cvel is the velocity of the body's point that is at the center of mass of its tree, in the
// world's axes, its angular part first; a free joint of Pinocchio has that of the body's origin, in
// the body's axes.
void MujocoContacts::read(const char* data, Scratch& own) const {
  const double* const cvel = array_at(data, setup.layout.cvel);
  read(data, own,
       [&](const MujocoBody& body) { return Vector6(Map<const Vector6>(cvel + 6 * body.id)); });
}

template <class VelocityOf>
void MujocoContacts::read(const char* data, Scratch& own, const VelocityOf& velocity_of) const {
  const double* const xpos = array_at(data, setup.layout.xpos);
  const double* const xquat = array_at(data, setup.layout.xquat);
  const double* const center = array_at(data, setup.layout.subtree_com);
  own.q.resize(7 * static_cast<Eigen::Index>(setup.bodies.size()));
  own.v.resize(6 * static_cast<Eigen::Index>(setup.bodies.size()));
  for (std::size_t k = 0; k < setup.bodies.size(); ++k) {
    const MujocoBody& body = setup.bodies[k];
    const Vec3 origin = Vec3Map(xpos + 3 * body.id);
    const double* const w = xquat + 4 * body.id;
    const Eigen::Quaterniond turn(w[0], w[1], w[2], w[3]);
    const Vector6 velocity = velocity_of(body);
    const Vec3 angular = velocity.head<3>(), linear = velocity.tail<3>();
    own.q.segment<3>(7 * k) = origin;
    own.q.segment<4>(7 * k + 3) = turn.coeffs();
    if (!origin.allFinite() || !turn.coeffs().allFinite() || !angular.allFinite() ||
        !linear.allFinite())
      throw std::domain_error("the state of data is not finite");
    const auto to_body = turn.conjugate().toRotationMatrix();
    own.v.segment<3>(6 * k) =
        to_body * (linear + angular.cross(origin - Vec3Map(center + 3 * body.root)));
    own.v.segment<3>(6 * k + 3) = to_body * angular;
  }
}

// The stages of RK4 follow the first one at half the step, twice, and at its end; they go on from
// what that has found. Any other evaluation is a first one, which may be of a step or of none.
void MujocoContacts::evaluate(const void* model, const char* data, Scratch& own) const {
  const double now = value_at<double>(data, setup.layout.time);
  const double dt = value_at<double>(model, setup.layout.timestep);
  const bool is_rk4 = value_at<int>(model, setup.layout.integrator) == kRungeKutta4;
  const double share = own.stage == 3 ? 1 : 0.5;
  if (!is_rk4 || own.data != data || own.stage < 1 || own.stage > 3 ||
      std::abs(now - own.time - share * dt) > 1e-6 * dt) {
    begin(model, data, own);
    return;
  }
  read(data, own);
  const VectorX z = own.z + share * dt * own.rates[own.stage - 1];
  own.scene.evaluate(own.q, own.v, z);
  own.rates[own.stage++] = own.scene.bristle_rates();
}

void MujocoContacts::begin(const void* model, const char* data, Scratch& own) const {
  own.data = data;
  own.time = value_at<double>(data, setup.layout.time);
  own.stage = 0;
  read(data, own);
  const bool remembers = setup.memory.instance >= 0;
  const double* memory = none_.data();
  double size = double(none_.size());
  if (remembers) {
    const double* const state = array_at(data, setup.layout.plugin_state) + setup.memory.address;
    if (state[0] != 0) size = state[0], memory = state + 1;
  }
  if (!(size > 0 && (memory == none_.data() || size < double(setup.memory.size))) ||
      !own.scene.load(memory, static_cast<std::size_t>(size), own.z))
    throw std::domain_error("the state of the plugin sphshell_pin.memory is not one that it made");
  own.scene.relax_in(value_at<double>(model, setup.layout.timestep));
  own.scene.evaluate(own.q, own.v, own.z, remembers);
  if (remembers) own.scene.accept(own.z);
  own.rates[0] = own.scene.bristle_rates();
  own.stage = 1;
}

// J^T of each wrench. cdof has the axes of the degrees of freedom, turns first, about the center of
// mass of their tree.
void MujocoContacts::add_forces(char* data, const SceneData& scene) const {
  if (!scene.touching()) return;
  const double* const xpos = array_at(data, setup.layout.xpos);
  const double* const cdof = array_at(data, setup.layout.cdof);
  const double* const center = array_at(data, setup.layout.subtree_com);
  double* const force_on = const_cast<double*>(array_at(data, setup.layout.qfrc_passive));
  for (std::size_t k = 0; k < setup.bodies.size(); ++k) {
    const MujocoBody& body = setup.bodies[k];
    const int joint = static_cast<int>(k) + 1;
    const pinocchio::Force& wrench = scene.external()[joint];
    const auto& turn = scene.body().world_from_joint(joint).rotation();
    const Vec3 force = turn * wrench.linear();
    const Vec3 arm = Vec3Map(xpos + 3 * body.id) - Vec3Map(center + 3 * body.root);
    const Vec3 moment = turn * wrench.angular() + arm.cross(force);
    for (const int i : body.dofs)
      force_on[i] += Vec3Map(cdof + 6 * i).dot(moment) + Vec3Map(cdof + 6 * i + 3).dot(force);
  }
}

}  // namespace sphshell
