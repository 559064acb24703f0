#include "adapters/mujoco.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <exception>
#include <mutex>
#include <random>
#include <stdexcept>
#include <unordered_set>

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

using Set = std::vector<std::shared_ptr<MujocoContacts>>;

// The mark of a model is in bits of its enableflags that MuJoCo does not use.
constexpr std::uint32_t kMarks = 0x7fff;
constexpr int kMarkShift = 16;
// The first bytes of an mjModel are its sizes: they tell a model from one that has the mark by
// chance, as from a file.
constexpr std::size_t kSizes = 256;

struct Marked {
  void* owner;  // the model that the contacts were attached to
  std::string sizes;
  std::shared_ptr<const Set> contacts;  // in the order in which they were attached
};

struct Registry {
  std::shared_mutex mutex;
  std::optional<MujocoLayout> layout;
  std::unordered_map<std::uint32_t, Marked> marked;
  std::unordered_map<const void*, std::uint32_t> owners;
  std::uint32_t last = std::random_device()();
  std::unordered_set<std::uint32_t> ended;  // marks of copies that were found without contacts
  void (*report)(const std::string&) = nullptr;

  std::uint32_t mark(const void* model) const {
    return value_at<std::uint32_t>(model, layout->enableflags) >> kMarkShift & kMarks;
  }
  void set_mark(void* model, std::uint32_t mark) const {
    char* const at = static_cast<char*>(model) + layout->enableflags;
    const auto others = value_at<std::uint32_t>(at, 0) & ~(kMarks << kMarkShift);
    const std::uint32_t flags = others | mark << kMarkShift;
    std::memcpy(at, &flags, sizeof(flags));
  }
  const Marked* find(const void* model) const {
    if (marked.empty()) return nullptr;
    std::uint32_t number = mark(model);
    if (number == 0) {
      const auto at = owners.find(model);
      if (at == owners.end()) return nullptr;
      number = at->second;
    }
    const auto at = marked.find(number);
    if (at == marked.end()) return nullptr;
    const bool same = std::memcmp(at->second.sizes.data(), model, kSizes) == 0;
    return same ? &at->second : nullptr;
  }
};

Registry& registry() {
  static Registry* const all = new Registry;  // threads may step beyond the end of main()
  return *all;
}

std::shared_ptr<const Set> contacts_of(const void* model) {
  Registry& all = registry();
  std::uint32_t mark = 0;
  {
    const std::shared_lock lock(all.mutex);
    if (const Marked* const found = all.find(model)) return found->contacts;
    if (!all.layout || (mark = all.mark(model)) == 0) return nullptr;
  }
  {
    const std::unique_lock lock(all.mutex);
    if (!all.ended.insert(mark).second) return nullptr;
  }
  all.report(
      "a copy of a MuJoCo model moves without contacts: those of the model have ended, with it or "
      "by detach(); attach them to the copy");
  return nullptr;
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
    const std::string text = error.what();
    {
      const std::unique_lock lock(mutex_);
      if (!fault_.empty()) return;
      fault_ = text;
    }
    report_(text);
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
    if (!origin.allFinite() || !turn.coeffs().allFinite() || !angular.allFinite() ||
        !linear.allFinite())
      throw std::domain_error("the state of data is not finite");
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
  if (const auto here = contacts_of(model))
    for (const auto& contacts : *here) contacts->apply(model, data);
}

int filter_contact(const void* model, void*, int geom, int other) {
  const Registry& all = registry();
  const int* const type = value_at<const int*>(model, all.layout->contype);
  const int* const affinity = value_at<const int*>(model, all.layout->conaffinity);
  if (!(type[geom] & affinity[other]) && !(type[other] & affinity[geom])) return 1;
  const auto here = contacts_of(model);
  return here && std::any_of(here->begin(), here->end(), [&](const auto& contacts) {
           return contacts->separates(geom, other);
         });
}

std::string register_passive(void* model, std::shared_ptr<MujocoContacts> contacts) {
  Registry& all = registry();
  const std::unique_lock lock(all.mutex);
  if (!all.layout) all.layout = contacts->layout();
  all.report = contacts->reporter();
  const Marked* const before = all.find(model);
  Set set = before ? *before->contacts : Set();
  for (const auto& one : set)
    for (const std::string& touch : contacts->touches())
      if (std::count(one->touches().begin(), one->touches().end(), touch)) return touch;
  set.push_back(std::move(contacts));
  // A copy of a model with contacts has a mark, and contacts, of its own from here on.
  const auto owned = all.owners.find(model);
  std::uint32_t number = owned == all.owners.end() ? 0 : owned->second;
  if (number == 0) {
    if (all.marked.size() + 1 >= kMarks)
      throw std::length_error("too many MuJoCo models have contacts");
    do number = ++all.last & kMarks;
    while (number == 0 || all.marked.count(number));
  }
  all.ended.erase(number);
  all.set_mark(model, number);
  all.owners[model] = number;
  all.marked[number] = {model, std::string(static_cast<const char*>(model), kSizes),
                        std::make_shared<const Set>(std::move(set))};
  return {};
}

void unregister_passive(const MujocoContacts* contacts) {
  Registry& all = registry();
  std::vector<std::shared_ptr<const Set>> before;  // destroyed without the lock
  const std::unique_lock lock(all.mutex);
  for (auto at = all.marked.begin(); at != all.marked.end();) {
    Marked& marked = at->second;
    Set set;
    for (const auto& one : *marked.contacts)
      if (one.get() != contacts) set.push_back(one);
    before.push_back(marked.contacts);
    if (set.empty()) {
      all.set_mark(marked.owner, 0);
      all.owners.erase(marked.owner);
      at = all.marked.erase(at);
    } else {
      marked.contacts = std::make_shared<const Set>(std::move(set));
      ++at;
    }
  }
}

bool acts_on(const void* model, const MujocoContacts* contacts) {
  Registry& all = registry();
  const std::shared_lock lock(all.mutex);
  const Marked* const found = all.layout ? all.find(model) : nullptr;
  return found && std::any_of(found->contacts->begin(), found->contacts->end(),
                              [&](const auto& one) { return one.get() == contacts; });
}

void end_model(const void* model) {
  Registry& all = registry();
  std::shared_ptr<const Set> before;
  const std::unique_lock lock(all.mutex);
  const auto owned = all.owners.find(model);
  if (owned == all.owners.end()) return;
  before = all.marked.at(owned->second).contacts;
  all.marked.erase(owned->second);
  all.owners.erase(owned);
}

}  // namespace sphshell
