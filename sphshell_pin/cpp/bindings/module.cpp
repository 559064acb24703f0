#include <nanobind/nanobind.h>

namespace nb = nanobind;

void bind_mending(nb::module_& m);
void bind_mujoco(nb::module_& m);
void bind_shell(nb::module_& m);
void bind_contact(nb::module_& m);
void bind_dynamics(nb::module_& m);
void bind_evaluator(nb::module_& m);
void bind_foundation(nb::module_& m);
void bind_rollout(nb::module_& m);

NB_MODULE(_core, m) {
  // Interpreters that end with objects alive are no leak of ours.
  nb::set_leak_warnings(false);
  m.doc() = "C++ core of sphshell_pin; its Python face checks and converts, this trusts and runs.";
  bind_mending(m);
  bind_shell(m);
  bind_contact(m);
  bind_dynamics(m);
  bind_evaluator(m);
  bind_foundation(m);
  bind_rollout(m);
  bind_mujoco(m);
}
