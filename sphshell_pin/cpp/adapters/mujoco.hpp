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
  std::size_t timestep, integrator;
};

// A body of MuJoCo that is joint k + 1 of the scene's model.
struct MujocoBody {
  int id, root;  // root: of its kinematic tree, whose center of mass cvel and cdof refer to
  std::vector<int> dofs;  // that move it
};

class MujocoContacts {
 public:
  MujocoContacts(SceneState scene, MujocoLayout layout, std::vector<MujocoBody> bodies, bool logs)
      : prototype_(std::move(scene)), layout_(layout), bodies_(std::move(bodies)), logs_(logs) {}

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
  const bool logs_;
  std::shared_mutex mutex_;  // of what follows
  std::unordered_map<const void*, std::unique_ptr<Memory>> memories_;
  std::string fault_;
};

// MuJoCo calls this, its mjcb_passive, for every model: it applies the contacts of `model`.
void apply_passive(const void* model, void* data);
void register_passive(const void* model, std::shared_ptr<MujocoContacts> contacts);
void unregister_passive(const void* model, const MujocoContacts* contacts);

}  // namespace sphshell
