// Contacts in MuJoCo: the adapter's half that MuJoCo calls.
#include "bindings/evaluations.hpp"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "adapters/mujoco.hpp"
#include "bindings/gil.hpp"
#include "bindings/records.hpp"

namespace {

using namespace sphshell;

void* pointer(std::uintptr_t address) { return reinterpret_cast<void*>(address); }

// A callback of MuJoCo cannot raise: Python reports the fault as it does those of finalizers.
void report(const std::string& fault) {
  const AcquireGil gil;
  nb::module_ errors = nb::module_::import_("sphshell_pin.errors");
  PyErr_SetString(errors.attr("SphshellError").ptr(), ("contacts in MuJoCo: " + fault).c_str());
  PyErr_WriteUnraisable(nullptr);
}

struct OwnMujoco {
  std::shared_ptr<MujocoContacts> contacts;
};

}  // namespace

void bind_mujoco(nb::module_& m) {
  m.def("mujoco_passive", [] { return reinterpret_cast<std::uintptr_t>(&apply_passive); });
  m.def("mujoco_filter", [] { return reinterpret_cast<std::uintptr_t>(&filter_contact); });
  m.def("mujoco_register", [](std::uintptr_t register_plugin, std::uintptr_t get_config) {
    return register_memory(pointer(register_plugin), pointer(get_config));
  });
  m.def("mujoco_taken",
        [](std::uintptr_t model, int instance) { return is_taken(pointer(model), instance); });
  m.def("mujoco_end", [](std::uintptr_t model) { end_model(pointer(model)); });
  nb::class_<OwnMujoco>(m, "MujocoContacts")
      .def("__init__",
           [](OwnMujoco* self, const OwnState& state, const std::vector<std::size_t>& layout,
              const std::vector<int>& memory, const std::vector<int>& ids,
              const std::vector<int>& roots, const std::vector<std::vector<int>>& dofs,
              const std::vector<int>& roles, std::vector<std::string> touches, bool logs) {
             check_count("layout", layout.size(), sizeof(MujocoLayout) / sizeof(std::size_t));
             check_count("memory", memory.size(), 3);
             MujocoLayout places;
             std::memcpy(&places, layout.data(), sizeof places);
             std::vector<MujocoBody> bodies;
             for (std::size_t k = 0; k < ids.size(); ++k)
               bodies.push_back({ids[k], roots[k], dofs[k]});
             std::vector<MujocoRole> parts;
             for (const int role : roles) parts.push_back(static_cast<MujocoRole>(role));
             new (self) OwnMujoco{std::make_shared<MujocoContacts>(MujocoSetup{
                 SceneData(state.state.scene()), places,
                 MujocoMemory{memory[0], std::size_t(memory[1]), std::size_t(memory[2])},
                 std::move(bodies), std::move(parts), std::move(touches), logs, &report})};
           })
      .def("attach",
           [](const OwnMujoco& self, std::uintptr_t model) {
             return register_passive(pointer(model), self.contacts);
           })
      .def("acts_on",
           [](const OwnMujoco& self, std::uintptr_t model) {
             return acts_on(pointer(model), self.contacts.get());
           })
      .def("detach", [](const OwnMujoco& self) { unregister_passive(self.contacts.get()); })
      .def("apply",
           [](const OwnMujoco& self, std::uintptr_t model, std::uintptr_t data) {
             self.contacts->apply(pointer(model), pointer(data));
           })
      .def("contacts",
           [](const OwnMujoco& self, std::uintptr_t model, std::uintptr_t data) {
             return to_bytes(self.contacts->contacts(pointer(model), pointer(data)));
           })
      .def("log",
           [](const OwnMujoco& self, std::uintptr_t data) {
             auto [times, rows] = self.contacts->log(pointer(data));
             const VectorX t = Eigen::Map<const VectorX>(times.data(), Eigen::Index(times.size()));
             return std::pair(to_array(t), to_bytes(std::move(rows)));
           })
      .def("forget",
           [](const OwnMujoco& self, std::uintptr_t data) { self.contacts->forget(pointer(data)); })
      .def("take_fault", [](const OwnMujoco& self) { return self.contacts->take_fault(); });
}
