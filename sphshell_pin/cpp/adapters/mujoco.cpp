#include "adapters/mujoco.hpp"

#include <algorithm>
#include <cstring>
#include <exception>
#include <mutex>

namespace sphshell {
namespace {

using Eigen::Map;
using Vec3Map = Map<const Vec3>;

constexpr int kRungeKutta4 = 1;  // mjINT_RK4

template <class T>
T value_at(const void* from, std::size_t offset) {
  T out;
  std::memcpy(&out, static_cast<const char*>(from) + offset, sizeof(T));
  return out;
}

// The array whose pointer a struct keeps at `offset`.
const double* array_at(const void* from, std::size_t offset) {
  return value_at<const double*>(from, offset);
}

// The contacts of each model, in the order in which they were attached.
struct Registry {
  std::shared_mutex mutex;
  std::unordered_map<const void*, std::vector<std::shared_ptr<MujocoContacts>>> of;
};

Registry& registry() {
  static Registry* const all = new Registry;  // threads may step beyond the end of main()
  return *all;
}

}  // namespace

void MujocoContacts::apply(const void* model, void* data) {
  char* const bytes = static_cast<char*>(data);
  try {
    Memory& own = memory(data);
    read(bytes, own);
    move(model, bytes, own);
    add_forces(bytes, own.scene->scene());
  } catch (const std::exception& error) {
    const std::unique_lock lock(mutex_);
    fault_ = error.what();
  }
}

std::vector<ContactRow> MujocoContacts::contacts(void* data) {
  Memory& own = memory(data);
  read(static_cast<char*>(data), own);
  if (!own.scene) own.scene.emplace(prototype_);
  own.scene->evaluate(own.q, own.v);
  std::vector<ContactRow> rows;
  own.scene->scene().log(own.q, own.v, rows);
  return rows;
}

std::pair<std::vector<double>, std::vector<ContactRow>> MujocoContacts::log(const void* data) {
  const Memory& own = memory(data);
  return {own.times, own.rows};
}

void MujocoContacts::forget(const void* data) {
  const std::unique_lock lock(mutex_);
  memories_.erase(data);
}

std::string MujocoContacts::take_fault() {
  const std::unique_lock lock(mutex_);
  return std::exchange(fault_, {});
}

MujocoContacts::Memory& MujocoContacts::memory(const void* data) {
  {
    const std::shared_lock lock(mutex_);
    const auto at = memories_.find(data);
    if (at != memories_.end()) return *at->second;
  }
  const std::unique_lock lock(mutex_);
  std::unique_ptr<Memory>& own = memories_[data];
  if (!own) own = std::make_unique<Memory>();
  return *own;
}

// cvel is the velocity of the body's point that is at the center of mass of its tree, in the
// world's axes, its angular part first; a free joint of Pinocchio has that of the body's origin, in
// the body's axes.
void MujocoContacts::read(const char* data, Memory& memory) const {
  const double* const xpos = array_at(data, layout_.xpos);
  const double* const xquat = array_at(data, layout_.xquat);
  const double* const cvel = array_at(data, layout_.cvel);
  const double* const center = array_at(data, layout_.subtree_com);
  memory.q.resize(7 * static_cast<Eigen::Index>(bodies_.size()));
  memory.v.resize(6 * static_cast<Eigen::Index>(bodies_.size()));
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const MujocoBody& body = bodies_[k];
    const Vec3 origin = Vec3Map(xpos + 3 * body.id);
    const double* const w = xquat + 4 * body.id;
    const Eigen::Quaterniond turn(w[0], w[1], w[2], w[3]);
    const Vec3Map angular(cvel + 6 * body.id), linear(cvel + 6 * body.id + 3);
    memory.q.segment<3>(7 * k) = origin;
    memory.q.segment<4>(7 * k + 3) = turn.coeffs();
    const auto to_body = turn.conjugate().toRotationMatrix();
    memory.v.segment<3>(6 * k) =
        to_body * (linear + angular.cross(origin - Vec3Map(center + 3 * body.root)));
    memory.v.segment<3>(6 * k + 3) = to_body * angular;
  }
}

// Evaluates the forces, and moves the memory on where a step was accepted. MuJoCo does not tell:
// its time does. The stages of RK4 are at the beginning, twice in the middle and at the end of a
// step, and the next step begins at that end: the second evaluation there is the accepted one.
// Where no time has passed since the beginning, as while somebody looks at different states,
// nothing is remembered; where time goes back the data were reset.
void MujocoContacts::move(const void* model, const char* data, Memory& memory) {
  const double time = value_at<double>(data, layout_.time);
  const bool begins = !memory.scene || time < memory.accepted || time == memory.begun;
  const double before = std::exchange(memory.last, time);
  if (begins) {
    memory.scene.emplace(prototype_);
    memory.begun = memory.accepted = time;
    memory.times.clear(), memory.rows.clear();
    memory.scene->advance(memory.q, memory.v, 0);
  } else if (time > memory.accepted &&
             (value_at<int>(model, layout_.integrator) != kRungeKutta4 ||
              (before == time &&
               time - memory.accepted > 0.75 * value_at<double>(model, layout_.timestep)))) {
    memory.scene->advance(memory.q, memory.v, time - memory.accepted);
    memory.accepted = time;
  } else {
    memory.scene->evaluate(memory.q, memory.v);
    return;
  }
  if (!logs_) return;
  memory.scene->scene().log(memory.q, memory.v, memory.rows);
  memory.times.resize(memory.rows.size(), time);
}

// J^T of each wrench. cdof has the axes of the degrees of freedom, turns first, about the center of
// mass of their tree.
void MujocoContacts::add_forces(char* data, const SceneData& scene) const {
  if (!scene.touching()) return;
  const double* const xpos = array_at(data, layout_.xpos);
  const double* const cdof = array_at(data, layout_.cdof);
  const double* const center = array_at(data, layout_.subtree_com);
  double* const force_on = const_cast<double*>(array_at(data, layout_.qfrc_passive));
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const MujocoBody& body = bodies_[k];
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

void apply_passive(const void* model, void* data) {
  std::vector<std::shared_ptr<MujocoContacts>> here;
  Registry& all = registry();
  {
    const std::shared_lock lock(all.mutex);
    const auto at = all.of.find(model);
    if (at == all.of.end()) return;
    here = at->second;
  }
  for (const auto& contacts : here) contacts->apply(model, data);
}

void register_passive(const void* model, std::shared_ptr<MujocoContacts> contacts) {
  const std::unique_lock lock(registry().mutex);
  registry().of[model].push_back(std::move(contacts));
}

void unregister_passive(const void* model, const MujocoContacts* contacts) {
  const std::unique_lock lock(registry().mutex);
  const auto at = registry().of.find(model);
  if (at == registry().of.end()) return;
  auto& here = at->second;
  here.erase(std::remove_if(here.begin(), here.end(),
                            [&](const auto& one) { return one.get() == contacts; }),
             here.end());
  if (here.empty()) registry().of.erase(at);
}

}  // namespace sphshell
