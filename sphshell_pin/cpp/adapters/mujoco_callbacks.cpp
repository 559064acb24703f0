// Which contacts a model of MuJoCo has, and the functions by which MuJoCo calls them.
#include <random>
#include <unordered_set>

#include "adapters/mujoco.hpp"

namespace sphshell {
namespace {

using Set = std::vector<std::shared_ptr<MujocoContacts>>;

// The mark of a model is in bits of its enableflags that MuJoCo does not use. No mark is given
// twice, as a copy may outlive the contacts; when all are, models get the last, which finds none.
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
  std::unordered_map<std::uint64_t, Marked> marked;
  std::unordered_map<const void*, std::uint64_t> owners;
  const std::uint32_t first = std::random_device()() % kMarks;
  std::uint64_t given = 0;
  std::unordered_map<const void*, std::uint32_t> marks_of_data;
  std::uint32_t last_of_data = 0;
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
  // A number of its own for a set of contacts; up to kMarks it is also the mark.
  std::uint64_t next() {
    const std::uint64_t k = given++;
    return k < kMarks - 1 ? (first + k) % (kMarks - 1) + 1 : k + 2;
  }
  const Marked* find(const void* model) const {
    if (marked.empty()) return nullptr;
    const auto owned = owners.find(model);
    const auto at = marked.find(owned == owners.end() ? mark(model) : owned->second);
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
      "by detach(), or more than 32766 models had contacts: attach them to the copy");
  return nullptr;
}

template <class Is>
bool any_of_model(const void* model, const Is& is) {
  const auto here = contacts_of(model);
  return here && std::any_of(here->begin(), here->end(), is);
}

// What MuJoCo knows of a plugin: its mjpPlugin, up to what is never used here.
struct Plugin {
  const char* name;
  int num_attributes;
  const char* const* attributes;
  int capabilities, stage;
  int (*num_state)(const void* model, int instance);
  int (*num_sensordata)(const void*, int, int);
  int (*init)(const void*, void*, int);
  void (*destroy)(void*, int);
  void (*copy)(void*, const void*, const void*, int);
  void (*reset)(const void* model, double* state, void*, int instance);
  void (*compute)(const void*, void*, int, int);
  void (*advance)(const void* model, void* data, int instance);
  void* unused[32];
};
constexpr int kPassive = 4;  // mjPLUGIN_PASSIVE

const char* (*get_config)(const void* model, int instance, const char* attribute);

int memory_size(const void* model, int instance) {
  const char* const text = get_config(model, instance, "size");
  return text ? std::max(0, std::atoi(text)) : 0;
}

void forget_memory(const void* model, double* state, void*, int instance) {
  std::fill_n(state, memory_size(model, instance), 0.0);
}

void advance_memory(const void* model, void* data, int instance) {
  if (const auto here = contacts_of(model))
    for (const auto& contacts : *here)
      if (contacts->setup.memory.instance == instance) contacts->advance(model, data);
}

}  // namespace

void apply_passive(const void* model, void* data) {
  if (const auto here = contacts_of(model))
    for (const auto& contacts : *here) contacts->apply(model, data);
}

int register_memory(void* register_plugin, void* config) {
  static const char* const attributes[] = {"size"};
  get_config = reinterpret_cast<decltype(get_config)>(config);
  Plugin plugin{};
  plugin.name = "sphshell_pin.memory";
  plugin.num_attributes = 1;
  plugin.attributes = attributes;
  plugin.capabilities = kPassive;
  plugin.num_state = &memory_size;
  plugin.init = [](const void*, void*, int) { return 0; };
  plugin.reset = &forget_memory;
  plugin.compute = [](const void*, void*, int, int) {};
  plugin.advance = &advance_memory;
  return reinterpret_cast<int (*)(const Plugin*)>(register_plugin)(&plugin);
}

int filter_contact(const void* model, void*, int geom, int other) {
  const Registry& all = registry();
  const int* const type = value_at<const int*>(model, all.layout->contype);
  const int* const affinity = value_at<const int*>(model, all.layout->conaffinity);
  if (!(type[geom] & affinity[other]) && !(type[other] & affinity[geom])) return 1;
  return any_of_model(model, [&](const auto& one) { return one->separates(geom, other); });
}

std::string register_passive(void* model, std::shared_ptr<MujocoContacts> contacts) {
  Registry& all = registry();
  const std::unique_lock lock(all.mutex);
  if (!all.layout) all.layout = contacts->setup.layout;
  all.report = contacts->setup.report;
  const Marked* const before = all.find(model);
  Set set = before ? *before->contacts : Set();
  for (const auto& one : set)
    for (const std::string& touch : contacts->setup.touches)
      if (std::count(one->setup.touches.begin(), one->setup.touches.end(), touch)) return touch;
  set.push_back(std::move(contacts));
  // A copy of a model with contacts has a mark, and contacts, of its own from here on.
  const auto owned = all.owners.find(model);
  const std::uint64_t number = owned == all.owners.end() ? all.next() : owned->second;
  all.set_mark(model, std::uint32_t(std::min<std::uint64_t>(number, kMarks)));
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

bool is_taken(const void* model, int instance) {
  return any_of_model(model,
                      [&](const auto& one) { return one->setup.memory.instance == instance; });
}

bool acts_on(const void* model, const MujocoContacts* contacts) {
  return any_of_model(model, [&](const auto& one) { return one.get() == contacts; });
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

std::uint32_t mark_of_data(void* data, std::size_t offset) {
  Registry& all = registry();
  const std::unique_lock lock(all.mutex);
  std::uint32_t& own = all.marks_of_data[data];
  if (own == 0 || value_at<std::uint32_t>(data, offset) != own) {
    own = ++all.last_of_data;
    std::memcpy(static_cast<char*>(data) + offset, &own, sizeof(own));
  }
  return own;
}

}  // namespace sphshell
