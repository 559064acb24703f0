"""A robot compiled once: generated, compiled, kept in the cache, and checked against Pinocchio."""

import hashlib
import logging
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
import time
import warnings
from pathlib import Path

import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.base import regular_file
from sphshell_pin.base.cache import cache_folder, is_own, keep_newest, mark_used, write_own
from sphshell_pin.dynamics.compiled.joint_motion import Storage, functions
from sphshell_pin.dynamics.compiled.recursions import Robot, articulated, composite, placing
from sphshell_pin.errors import InvalidParameter, SetupWarning, SphshellError

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


_log = logging.getLogger("sphshell_pin")

# Without contraction the same bits follow on all machines whose sine and cosine are the same.
_FLAGS = "-O2 -march=native -ffp-contract=off -fno-math-errno -fno-trapping-math -shared -fPIC"
_MOST_BYTES = 200_000_000
_SECONDS = 600


def compile_robot(model: pin.Model) -> Path:
    """Return a shared object with the forward dynamics and kinematics of `model`.

    It is generated by CasADi (extra "compile") and compiled by the system's C compiler (CC, by
    default cc), once: it is kept in the cache. What it takes and answers is checked against
    Pinocchio by those who load it: Scene(model, compiled=True), and in C++ Scene::use_compiled.

    Raises
    ------
    InvalidParameter
        `model` has a joint of a kind that is not compiled, or one that moves no mass.
    MissingExtra
        CasADi is not installed.
    SphshellError
        There is no compiler, or no folder that only this user can write to.
    """
    folder = cache_folder("robots")
    if folder is None:
        raise SphshellError(
            "the cache folder cannot be used, as it cannot be made or others can write to it or "
            "replace it: set SPHSHELL_PIN_CACHE to a folder of your own"
        )
    path = folder / f"{_key(model)}.so"
    if is_own(path):
        mark_used(path)
        return path
    began = time.monotonic()
    _log.info("compiling the robot, once: %d joints, some seconds", model.njoints - 1)
    source, why = c_source(model)
    if source is None:
        raise InvalidParameter("model", model.name, f"cannot be compiled: {why}")
    with tempfile.TemporaryDirectory() as making:
        made = Path(making) / "robot.so"
        _compile(source, made)
        write_own(path, regular_file.read_bytes(made))
    keep_newest(folder, _MOST_BYTES)
    _log.info("the robot is compiled: %.1f s", time.monotonic() - began)
    return path


def load_compiled(model: pin.Model) -> _core.CompiledRobot | None:
    """Return the compiled robot, checked; None, with a SetupWarning, where there can be none."""
    try:
        path = compile_robot(model)
        try:
            return _core.CompiledRobot(str(path), model)
        except RuntimeError:  # damaged, or of another version: made once more
            path.unlink(missing_ok=True)
            return _core.CompiledRobot(str(compile_robot(model)), model)
    except (SphshellError, RuntimeError, OSError, ValueError) as fault:  # ValueError: inexact
        warnings.warn(
            f"the robot moves by Pinocchio's own algorithms, not compiled: {fault}",
            SetupWarning,
            stacklevel=4,
        )
        return None


def _key(model: pin.Model) -> str:
    """Return what the object depends on, as a hash: model, generator, compiler, processor."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(regular_file.read_bytes(path))
    compiler = shutil.which(_compiler()[0]) or ""
    about = os.stat(compiler) if compiler else None
    digest.update(repr((_compiler(), about and (about.st_size, about.st_mtime_ns))).encode())
    digest.update(repr((platform.machine(), _processor(), pin.__version__)).encode())
    digest.update(model.saveToString().encode())
    return digest.hexdigest()


def _compiler() -> list[str]:
    return shlex.split(os.environ.get("CC", "")) or ["cc"]


def _processor() -> str:
    """Return what instructions the processor has: the folder may be that of several machines."""
    try:
        lines = regular_file.read_text("/proc/cpuinfo").splitlines()
        return next((line for line in lines if line.startswith(("flags", "Features"))), "")
    except OSError:
        return platform.processor()


def _compile(source: str, made: Path) -> None:
    """Compile `source`; SphshellError says why that is not possible."""
    text = made.with_suffix(".c")
    text.write_text(source)
    command = [*_compiler(), *_FLAGS.split(), "-o", str(made), str(text), "-lm"]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_SECONDS, check=False
        )
    except FileNotFoundError:
        raise SphshellError(
            f"there is no C compiler '{command[0]}': install one (on Debian or Ubuntu, apt-get "
            "install gcc libc6-dev), or state yours in CC"
        ) from None
    except subprocess.TimeoutExpired:
        raise SphshellError(f"the compiler took more than {_SECONDS} s") from None
    if done.returncode:
        first = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)
        raise SphshellError(f"the compiler '{command[0]}' failed: {first.strip()[-300:]}")
