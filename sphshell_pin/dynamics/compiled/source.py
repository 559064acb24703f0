"""The C source of a robot: forward dynamics and kinematics with the constants of its model."""

import pinocchio as pin

from sphshell_pin.dynamics.compiled.c_text import Storage, functions
from sphshell_pin.dynamics.compiled.recursions import Robot, articulated, composite, placing

# Statements in one function: compilers take more than linear time for long ones.
_LONGEST = 4000

# More than any robot has: a file of a stranger must not keep the compiler busy for long.
_MOST_JOINTS = 200

# See CompiledRobot in C++, which checks the first number.
_HEAD = """\
#include <math.h>
const int sphshell_pin_sizes[4] = {{1, {nq}, {nv}, {njoints}}};
static const double none[{forces}] = {{0}};
"""
_ARGUMENTS = (
    "const double* restrict q, const double* restrict v, const double* restrict tau, "
    "const double* restrict f, double* restrict w, double* restrict a, double* restrict m, "
    "double* restrict b"
)
_CALL = "q, v, tau, f, w, a, m, b"
_ACCELERATION = """\
void sphshell_pin_acceleration(const double* q, const double* v, const double* tau,
                               const double* f, double* a) {{
  double w[{size}], m[{square}], b[{nv}];
  if (!f) f = none;
  {begin}
  recursion(q, v, tau, f, w, a, m, b);
  {end}
}}
"""
# M a = tau - b by L D L^T; the lower triangle of m holds M, then L.
_BEGIN = """\
  static const double armature[] = {{{armature}}};
  for (int i = 0; i < {nv} * {nv}; ++i) m[i] = 0;
  for (int i = 0; i < {nv}; ++i) m[i * {nv} + i] = armature[i], b[i] = 0;"""
_END = """\
  for (int i = 0; i < {nv}; ++i) {{
    a[i] = tau[i] - b[i];
    for (int j = 0; j <= i; ++j) {{
      double sum = m[i * {nv} + j];
      for (int k = 0; k < j; ++k) sum -= m[i * {nv} + k] * m[j * {nv} + k] * m[k * {nv} + k];
      m[i * {nv} + j] = j < i ? sum / m[j * {nv} + j] : sum;
    }}
    for (int j = 0; j < i; ++j) a[i] -= m[i * {nv} + j] * a[j];
  }}
  for (int i = {nv} - 1; i >= 0; --i) {{
    a[i] /= m[i * {nv} + i];
    for (int j = i + 1; j < {nv}; ++j) a[i] -= m[j * {nv} + i] * a[j];
  }}"""
_KINEMATICS = """\
typedef void step(const double*, const double*, double*, double*);
static step* const steps[] = {{0, {steps}}};
void sphshell_pin_kinematics(const int* joints, int count, const double* q, const double* v,
                             double* o, double* s) {{
  for (int i = 0; i < count; ++i) steps[joints[i]](q, v, o, s);
}}
"""


def c_source(model: pin.Model) -> tuple[str | None, str]:
    """Return the source; or None and, in a sentence, why there is none."""
    if not 0 < model.njoints - 1 <= _MOST_JOINTS or not model.nv:
        return None, f"it has {model.njoints - 1} joints, not 1 to {_MOST_JOINTS} that move"
    robot = Robot.of(model)
    if isinstance(robot, str):
        kind = model.joints[model.getJointId(robot)].shortname().removeprefix("JointModel")
        return None, f"joint '{robot}' is of the kind {kind}, which is not compiled"
    mimics = len(model.mimicking_joints) > 0
    steps = "".join(_step(robot, k) for k in range(len(robot.bodies)))
    blocks = composite(robot) if mimics else articulated(robot)
    try:
        recursion = functions("recursion", blocks, _ARGUMENTS, _CALL, _LONGEST)
    except ZeroDivisionError:
        return None, "a joint of it moves no mass"
    sizes = {
        "nq": model.nq,
        "nv": model.nv,
        "njoints": model.njoints,
        "forces": 6 * model.njoints,
        "size": robot.storage.size + 1,
        "square": model.nv**2 if mimics else 1,
        "steps": ", ".join(f"step_{k}" for k in range(len(robot.bodies))),
        "armature": ", ".join(repr(float(x)) for x in model.armature),
    }
    solving = {"begin": _BEGIN if mimics else "", "end": _END if mimics else ""}
    filled = {name: text.format(**sizes) for name, text in solving.items()}
    parts = [_HEAD.format(**sizes), recursion, _ACCELERATION.format(**sizes, **filled)]
    return "".join([*parts, steps, _KINEMATICS.format(**sizes)]), ""


def _step(robot: Robot, k: int) -> str:
    storage = Storage("k")
    place, move = (block.text()[0] for block in placing(robot, robot.bodies[k], storage))
    return (
        f"static void step_{k}(const double* q, const double* v, double* o, double* s) {{\n"
        f"double k[{storage.size + 1}];\n{place}\nif (v) {move}\n}}\n"
    )
