// Contacts as passive forces of MuJoCo, without its headers.
//
// Each body that carries a sphere or a shell is a free body of a scene: its placement and velocity
// are what MuJoCo has computed, and the scene's wrench on it goes through MuJoCo's own motion axes
// into qfrc_passive. Laws, queries, friction and its memory are those of any scene. The forces are
// a function of MuJoCo's state, which holds the memory, too.
#pragma once

#include <cstring>
#include <shared_mutex>
#include <thread>

#include "dynamics/scene/scene_data.hpp"

namespace sphshell {

// Where an mjData, and in the second row an mjModel, keep what is read and written [bytes from the
// beginning]. It differs between versions of MuJoCo: Python finds it in the structs at hand. `mark`
// is of use to MuJoCo where a warning has been given alone: `lastinfo` of one, zero after a reset.
struct MujocoLayout {
  std::size_t time, qvel, plugin_state, xpos, xquat, cvel, subtree_com, cdof, qfrc_passive, mark;
  std::size_t timestep, integrator, enableflags, contype, conaffinity;
};

// What a struct has so many bytes from its beginning.
template <class T>
T value_at(const void* from, std::size_t offset) {
  T out;
  std::memcpy(&out, static_cast<const char*>(from) + offset, sizeof(T));
  return out;
}

// A body of MuJoCo that is joint k + 1 of the scene's model.
struct MujocoBody {
  int id, root;  // root: of its kinematic tree, whose center of mass cvel and cdof refer to
  std::vector<int> dofs;  // that move it
};

// Where contacts keep what they remember: the state of an instance of the plugin below, which
// MuJoCo copies, saves and resets with the rest of a state.
struct MujocoMemory {
  int instance = -1;                  // -1: nothing is remembered
  std::size_t address = 0, size = 0;  // in mjData's plugin_state
};

// The part of each geom in a set of contacts: MuJoCo's own contact between the spheres and the
// geoms of the shell's body is left out.
enum class MujocoRole : char { None, Sphere, Shell };

// What a set of contacts is made of.
struct MujocoSetup {
  SceneData scene;
  MujocoLayout layout;
  MujocoMemory memory;
  std::vector<MujocoBody> bodies;
  std::vector<MujocoRole> roles;
  std::vector<std::string> touches;  // a name for each sphere with its shell, the same for the same
  bool logs;
  // Is called with a fault of apply(), from any thread, where none has been noted since
  // take_fault().
  void (*report)(const std::string&);
};

class MujocoContacts {
 public:
  explicit MujocoContacts(MujocoSetup of) : setup(std::move(of)) {}

  const MujocoSetup setup;

  // Adds the forces at the state of `data` to its qfrc_passive. Several threads may do so at once,
  // each with data of its own.
  void apply(const void* model, void* data);
  // MuJoCo has moved `data` on by a step: its memory follows, by the stages of that step.
  void advance(const void* model, void* data);
  // The contacts at the state of `data`.
  std::vector<ContactRow> contacts(const void* model, const void* data);
  // Those of all accepted steps, and their times [s].
  std::pair<std::vector<double>, std::vector<ContactRow>> log(void* data);
  // Forgets the log of `data`.
  void forget(const void* data);
  // What went wrong in apply(), which cannot raise, since this was last called.
  std::string take_fault();
  // Whether MuJoCo's own contact between these geoms is left out.
  bool separates(int geom, int other) const {
    const MujocoRole one = setup.roles[geom], two = setup.roles[other];
    return (one == MujocoRole::Sphere && two == MujocoRole::Shell) ||
           (one == MujocoRole::Shell && two == MujocoRole::Sphere);
  }

 private:
  // Of one thread: the scene at the stages of the step under way.
  struct Scratch {
    explicit Scratch(const SceneData& prototype) : scene(prototype) {}
    SceneData scene;
    const void* data = nullptr;
    double time = 0;  // where the step began [s]
    int stage = 0;    // evaluated of that step: 1, of RK4 up to 4
    VectorX q, v, z;
    std::array<VectorX, 4> rates;  // of the bristles, at the stages
  };
  struct Log {
    std::uint32_t mark = 0;  // of its data
    std::vector<double> times;
    std::vector<ContactRow> rows;
  };
  Scratch& scratch();
  template <class Work>
  void report_faults(const Work& work);
  void read(const char* data, Scratch& scratch) const;
  // With the velocity of each body about the center of mass of its tree, angular first.
  template <class VelocityOf>
  void read(const char* data, Scratch& scratch, const VelocityOf& velocity_of) const;
  void evaluate(const void* model, const char* data, Scratch& scratch) const;
  void begin(const void* model, const char* data, Scratch& scratch) const;
  void add_forces(char* data, const SceneData& scene) const;
  void add_to_log(void* data, Scratch& scratch);

  static std::vector<double> memory_of_none(SceneData scene) {
    return scene.save(VectorX::Zero(scene.bristle_size()));
  }

  const std::vector<double> none_ = memory_of_none(setup.scene);
  std::shared_mutex mutex_;  // of what follows
  std::unordered_map<std::thread::id, std::unique_ptr<Scratch>> scratches_;
  std::unordered_map<const void*, Log> logs_of_;
  std::string fault_;
};

// MuJoCo calls these, its mjcb_passive and mjcb_contactfilter, for every model. The first applies
// the contacts of `model`; the second leaves out the pairs of geoms that MuJoCo itself would, and
// those that contacts separate.
void apply_passive(const void* model, void* data);
int filter_contact(const void* model, void* data, int geom, int other);

// Registers the plugin `sphshell_pin.memory` with MuJoCo, by its functions mjp_registerPlugin and
// mj_getPluginConfig; returns its slot. An instance has a state of so many numbers as its attribute
// `size` says, which is zero where nothing is remembered.
int register_memory(void* register_plugin, void* get_config);

// A model is known by its address until it is deleted, and its copies by a mark in the enableflags:
// they have its contacts, too, until those of the model end.
// register_passive() returns what touches already, or nothing where the contacts are registered.
std::string register_passive(void* model, std::shared_ptr<MujocoContacts> contacts);
// Of all models; the marks of those without other contacts are taken away.
void unregister_passive(const MujocoContacts* contacts);
// Whether contacts of `model` remember in an instance of the plugin already.
bool is_taken(const void* model, int instance);
// Whether the contacts act on `model`.
bool acts_on(const void* model, const MujocoContacts* contacts);
// The model, which is deleted by now, has no contacts any more.
void end_model(const void* model);
// A number that no other mjData has had, kept in `data` at `offset`: another one may have its
// address later.
std::uint32_t mark_of_data(void* data, std::size_t offset);

}  // namespace sphshell
