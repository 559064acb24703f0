// Contacts in MuJoCo: the adapter's half that MuJoCo calls.
#include "bindings/interop.hpp"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <map>

#include "adapters/mujoco.hpp"
#include "bindings/arrays.hpp"
#include "bindings/evaluations.hpp"
#include "bindings/records.hpp"

namespace {

using namespace sphshell;

const void* pointer(std::uintptr_t address) { return reinterpret_cast<const void*>(address); }

struct OwnMujoco {
  std::shared_ptr<MujocoContacts> contacts;
};

}  // namespace

void bind_mujoco(nb::module_& m) {
  m.def("mujoco_passive", [] { return reinterpret_cast<std::uintptr_t>(&apply_passive); });
  nb::class_<OwnMujoco>(m, "MujocoContacts")
      .def(
          "__init__",
          [](OwnMujoco* self, const OwnState& state, const std::vector<std::size_t>& layout,
             const std::vector<int>& ids, const std::vector<int>& roots,
             const std::vector<std::vector<int>>& dofs, bool logs) {
            check_count("layout", layout.size(), 9);
            const std::size_t* at = layout.data();
            std::vector<MujocoBody> bodies;
            for (std::size_t k = 0; k < ids.size(); ++k)
              bodies.push_back({ids[k], roots[k], dofs[k]});
            new (self) OwnMujoco{std::make_shared<MujocoContacts>(
                SceneState(state.state),
                MujocoLayout{at[0], at[1], at[2], at[3], at[4], at[5], at[6], at[7], at[8]},
                std::move(bodies), logs)};
          },
          nb::arg("state"), nb::arg("layout"), nb::arg("ids"), nb::arg("roots"), nb::arg("dofs"),
          nb::arg("logs"))
      .def("attach", [](const OwnMujoco& self,
                        std::uintptr_t model) { register_passive(pointer(model), self.contacts); })
      .def("detach",
           [](const OwnMujoco& self, std::uintptr_t model) {
             unregister_passive(pointer(model), self.contacts.get());
           })
      .def("apply",
           [](const OwnMujoco& self, std::uintptr_t model, std::uintptr_t data) {
             self.contacts->apply(pointer(model), const_cast<void*>(pointer(data)));
           })
      .def("contacts",
           [](const OwnMujoco& self, std::uintptr_t data) {
             return to_bytes(self.contacts->contacts(const_cast<void*>(pointer(data))));
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
