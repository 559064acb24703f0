// Contacts as passive forces of MuJoCo, without its headers.
//
// Each body that carries a sphere or a shell is a free body of a scene: its placement and velocity
// are what MuJoCo has computed, and the scene's wrench on it goes through MuJoCo's own motion axes
// into qfrc_passive. Laws, queries, friction and its memory are those of any scene.
#pragma once

#include <memory>
#include <optional>
#include <shared_mutex>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dynamics/scene/scene_state.hpp"

namespace sphshell {

// Where an mjData, and in the second row an mjModel, keep what is read and written [bytes from the
// beginning]. It differs between versions of MuJoCo: Python finds it in the structs at hand.
struct MujocoLayout {
  std::size_t time, xpos, xquat, cvel, subtree_com, cdof, qfrc_passive;
  std::size_t timestep, integrator, enableflags, contype, conaffinity;
};

// A body of MuJoCo that is joint k + 1 of the scene's model.
struct MujocoBody {
  int id, root;  // root: of its kinematic tree, whose center of mass cvel and cdof refer to
  std::vector<int> dofs;  // that move it
};

// The part of each geom in a set of contacts: MuJoCo's own contact between the spheres and the
// geoms of the shell's body is left out.
enum class MujocoRole : char { None, Sphere, Shell };

class MujocoContacts {
 public:
  // `report` is called with a fault of apply(), from any thread, where none has been noted since
  // take_fault(). `touches` has a name for each sphere with its shell, the same for the same ones.
  MujocoContacts(SceneState scene, MujocoLayout layout, std::vector<MujocoBody> bodies,
                 std::vector<MujocoRole> roles, std::vector<std::string> touches, bool logs,
                 void (*report)(const std::string&))
      : prototype_(std::move(scene)),
        layout_(layout),
        bodies_(std::move(bodies)),
        roles_(std::move(roles)),
        touches_(std::move(touches)),
        logs_(logs),
        report_(report) {}

  // Adds the forces at the state of `data` to its qfrc_passive. Several threads may do so at once,
  // each with data of its own.
  void apply(const void* model, void* data);
  // The contacts at the state of `data`, with its memory as it is.
  std::vector<ContactRow> contacts(void* data);
  // Those of all accepted steps, and their times [s].
  std::pair<std::vector<double>, std::vector<ContactRow>> log(const void* data);
  // Forgets all about `data`.
  void forget(const void* data);
  // What went wrong in apply(), which cannot raise, since this was last called.
  std::string take_fault();
  // Whether MuJoCo's own contact between these geoms is left out.
  bool separates(int geom, int other) const {
    return (roles_[geom] == MujocoRole::Sphere && roles_[other] == MujocoRole::Shell) ||
           (roles_[geom] == MujocoRole::Shell && roles_[other] == MujocoRole::Sphere);
  }
  const MujocoLayout& layout() const { return layout_; }
  const std::vector<std::string>& touches() const { return touches_; }
  auto reporter() const { return report_; }

 private:
  // What the forces on one mjData depend on besides its state.
  struct Memory {
    std::optional<SceneState> scene;
    double begun = 0, accepted = 0, last = 0;  // times [s]: of its first, accepted, last evaluation
    VectorX q, v;
    std::vector<double> times;
    std::vector<ContactRow> rows;
  };
  Memory& memory(const void* data);
  void read(const char* data, Memory& memory) const;
  void move(const void* model, const char* data, Memory& memory);
  void add_forces(char* data, const SceneData& scene) const;

  const SceneState prototype_;
  const MujocoLayout layout_;
  const std::vector<MujocoBody> bodies_;
  const std::vector<MujocoRole> roles_;
  const std::vector<std::string> touches_;
  const bool logs_;
  void (*const report_)(const std::string&);
  std::shared_mutex mutex_;  // of what follows
  std::unordered_map<const void*, std::unique_ptr<Memory>> memories_;
  std::string fault_;
};

// MuJoCo calls these, its mjcb_passive and mjcb_contactfilter, for every model. The first applies
// the contacts of `model`; the second leaves out the pairs of geoms that MuJoCo itself would, and
// those that contacts separate.
void apply_passive(const void* model, void* data);
int filter_contact(const void* model, void* data, int geom, int other);

// A model is known by a mark in its enableflags, which its copies carry: they have its contacts,
// too, until those of the model end. A mark that was overwritten is found by the model's address.
// register_passive() returns what touches already, or nothing where the contacts are registered.
std::string register_passive(void* model, std::shared_ptr<MujocoContacts> contacts);
// Of all models; the marks of those without other contacts are taken away.
void unregister_passive(const MujocoContacts* contacts);
// Whether the contacts act on `model`.
bool acts_on(const void* model, const MujocoContacts* contacts);
// The model, which is deleted by now, has no contacts any more.
void end_model(const void* model);

}  // namespace sphshell
