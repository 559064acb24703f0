"""A planned scenario as text: TOML with comments beside the values that say where they are from."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from string import Formatter

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.scenario.drafting.fingertips import Tip
from sphshell_pin.scenario.drafting.plan import Hold, Plan, Press
from sphshell_pin.scenario.format.schema import RobotSection, RunSection, ShellSection

HELD = 0.05
"""How well a scenario holds its normal force, as a part of it."""

_SIDES = {
    "both": "spheres may touch it from both sides",
    "outside": "a closed body: spheres touch it from outside",
    "inside": "a hollow: spheres touch it from inside",
}
# Column of the comments beside values.
_COLUMN = 34

# A line whose value is marked !o (optional) and is nothing, or zero, is left out, with the comment
# line above it.
_ROBOT = """\
# {title}.
#
#   sphshell-pin run {name}.toml
#   sphshell-pin view {name}.toml
#
# Units are SI (m, kg, s, N, rad) unless a key says otherwise.

title = {title}

[robot]
name = {robot.name!o}
urdf = {robot.urdf!o}
file = {robot.file!o}
package_dirs = {robot.package_dirs!o}
xacro_args = {robot.xacro_args!o}
base = {robot.base!o} # the root link
free_flyer = {robot.free_flyer!o} # the root link floats
# They do not move the tip: locked, they cost nothing.
lock = {robot.lock!o}
# What acts in the joints, as the robot's file states it{left_out}.
joints = {robot.joints!o}
"""
_ROOT = """
[robot.start]
# x y z [m] and the quaternion x y z w: the sphere stands above the surface.
root_joint = {root}
"""
_POSTURE = """
[robot.start]
# A posture in which the tip can move: joints [rad, m].
"""
_SHELL = """
[[shell]]
name = {shell.name}
file = {shell.file!o} # relative to this file
unit = {shell.unit!o} # length unit of the file's numbers
bodies = {shell.bodies!o} # of the CAD file
faces = {shell.faces!o} # of the CAD file
primitive = {primitive!o}
side = {shell.side} # {side}
frame = "universe" # fixed to the world; any frame of the robot may do
"""
_PLACEMENT = """\
# It stands {gap:.3g} mm before the sphere.
[shell.placement]
xyz = {xyz}
rpy_deg = {rpy_deg!o}
"""
_CONTACT = """
[[contact]]
name = {pair}
sphere = {sphere}
shell = {shell.name}

# Hertz: a {plan.contact.material.name} ball on {plan.contact.against.name}.
[contact.law]
type = "hertz"
radius = {tip.radius} # of the ball; less where it lies in a hollow
young = {plan.contact.material.young} # [Pa] {plan.contact.material.name}, a typical value
poisson = {plan.contact.material.poisson}
young_2 = {plan.contact.against.young} # [Pa] {plan.contact.against.name}, a typical value
poisson_2 = {plan.contact.against.poisson}
restitution = {plan.contact.restitution} # speed of rebound, as a part
speed = {plan.contact.speed} # [m/s] at which it holds: the first touch

"""
_COULOMB = """\
[contact.friction]
type = "coulomb"
mu_static = {contact.mu_static} # {materials}, dry: a typical value
mu_dynamic = {contact.mu_dynamic}
v_static = {contact.v_static} # [m/s] slip at which friction is full
v_dynamic = {v_dynamic} # [m/s] slip of mu_dynamic
"""
_BRISTLE = """\
# Friction that sticks.
[contact.friction]
type = "bristle"
mu_static = {contact.mu_static} # {materials}, dry: a typical value
mu_dynamic = {contact.mu_dynamic}
stiffness = {contact.bristle[0]} # [N/m] as stiff as the law under the load
damping = {contact.bristle[1]} # [N s/m] a tenth of critical
"""
_PRESS = """
# {told}
[controller]
type = "cartesian-impedance"
frame = {tip.frame}
offset = {offset!o} # of the sphere's center in this frame [m]
shell = {shell.name}
# Points in the shell's own coordinates [m], projected on it.
path = {path}
normal_force = {press.force} # [N]
speed = {press.speed} # [m/s] along the path
spline = {press.spline!o} # a smooth curve through the points
acceleration = {press.acceleration!o} # [m/s2] it sets out and stops softly
jerk = {press.jerk!o} # [m/s3]
lead_in = {press.lead_in} # [s] stand still while the force comes on
stiffness = {press.stiffness} # [N/m] friction holds the tip a fifth of a radius behind at most
damping = {press.damping} # [N s/m] {press.damped} of critical
rotational_stiffness = {press.rotational_stiffness!o} # [N m/rad] keeps the tip's orientation
rotational_damping = {press.rotational_damping!o}
decoupled = {press.decoupled!o} # the robot's inertia does not act on the surface
# Null-space posture damping, in proportion to the joints' own inertia.
posture_stiffness = {press.posture_stiffness!o}
joint_damping = {press.joint_damping!o}
"""
_HOLD = """
# Springs and dampers at the joints hold the posture of the start.
[controller]
type = "joint-pd"
kp = {hold.kp} # [N m/rad] gives 0.05 rad under the weight
kd = {hold.kd} # [N m s/rad] 0.7 of critical
"""
_RUN = """
[run]
duration = {run.duration}
integrator = {run.integrator} # its steps follow the contact
dt = {run.dt!o}
rtol = {run.rtol!o}
record_dt = {run.record_dt!o}
recording_speed = {slow!o} # the recording in slow motion

# The parameters that have a slider in sphshell-pin view.
"""
_EXPECT = """\
# What the run is checked against.
[expect]
"pairs.{pair}.mean_force" = {mean_force!o}
"pairs.{pair}.touches" = {{ min = 1 }}
"energy.relative_residual" = {{ max = 1e-3 }}
"""


def draft_text(
    name: str,
    title: str,
    robot: RobotSection,
    shell: ShellSection,
    plan: Plan,
    run: RunSection,
) -> str:
    """Return the text of the scenario called `name`."""
    pairs = pair_names(plan.tips, shell.name)
    digits = decimals(plan.gap)
    left_out = ""
    if plan.left_out:
        left_out = f", without {' and '.join(plan.left_out)}: the tip would not hold its force"
    text = _fill(_ROBOT, name=name, title=title, robot=robot, left_out=left_out)
    if plan.root is not None:
        text += _fill(_ROOT, root=_rounded(plan.root, digits))
    elif robot.start:
        text += _POSTURE
        text += "".join(f"{_key(joint)} = {_toml(q)}\n" for joint, q in robot.start.items())
    primitive = shell.model_dump()["primitive"]
    text += _fill(_SHELL, shell=shell, primitive=primitive, side=_SIDES[shell.side])
    if plan.root is None:
        angles = np.rad2deg(pin.rpy.matrixToRpy(plan.placement.rotation))
        angles[np.abs(angles) < 1e-6] = 0.0
        xyz, rpy = _rounded(plan.placement.translation, digits), _rounded(angles, digits)
        text += _fill(_PLACEMENT, gap=1e3 * plan.gap, xyz=xyz, rpy_deg=rpy)
    for tip, pair in zip(plan.tips, pairs, strict=True):
        sphere: dict[str, object] = {"frame": tip.frame, "radius": tip.radius}
        if tip.offset.any():
            sphere["offset"] = _rounded(tip.offset, digits)
        text += _fill(_CONTACT, pair=pair, sphere=sphere, shell=shell, tip=tip, plan=plan)
        materials = f"{plan.contact.material.name} on {plan.contact.against.name}"
        friction = {"materials": materials, "v_dynamic": float(f"{10 * plan.contact.v_static:.2g}")}
        template = _COULOMB if plan.contact.bristle is None else _BRISTLE
        text += _fill(template, contact=plan.contact, **friction)
    control, mean_force = plan.control, None
    if isinstance(control, Press):
        path = _rounded(control.path, digits)
        offset = _rounded(plan.tips[0].offset, digits)
        moves = "follows a path on the surface and presses on it"
        told = f"The tip {moves if len(path) > 1 else 'presses on one place of the surface'}."
        values = {"offset": offset, "path": path, "told": told}
        text += _fill(_PRESS, tip=plan.tips[0], shell=shell, press=control, **values)
        if control.even:
            mean_force = {"value": control.force, "rtol": HELD}
    elif isinstance(control, Hold):
        text += _fill(_HOLD, hold=control)
    slow = None if run.recording_speed == 1.0 else run.recording_speed
    text += _fill(_RUN, run=run, slow=slow)
    for key, limits in _parameters(plan, pairs).items():
        text += f"[[knob]]\nkey = {_toml(key)}\n"
        text += "".join(f"{bound} = {_toml(value)}\n" for bound, value in limits.items()) + "\n"
    # Of several feet a rough surface may leave one in the air.
    return text + _fill(_EXPECT, pair=pairs[0], mean_force=mean_force)


def pair_names(tips: Sequence[Tip], shell: str) -> list[str]:
    """Return the names of the contacts of the `tips` with the `shell`."""
    if len(tips) == 1:
        return [f"tip-{shell}"]
    frames = [tip.frame for tip in tips]
    # A foot may stand on several spheres.
    numbers = [
        frames[:i].count(one) + 1 if frames.count(one) > 1 else "" for i, one in enumerate(frames)
    ]
    return [f"{one}{k}-{shell}" for one, k in zip(frames, numbers, strict=True)]


def decimals(gap: float) -> int:
    """Return how many decimals of a metre keep the `gap` [m] at the start to half a percent."""
    return max(4, math.ceil(-math.log10(gap / 200)))


def _parameters(plan: Plan, pairs: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return the keys of the parameters that get a slider, and its ends where they are stated."""
    contact = plan.contact
    found: dict[str, dict[str, float]] = {}
    for pair in pairs:
        at = f"contact.{pair}"
        found |= {
            f"{at}.law.young": {},
            f"{at}.law.restitution": {"min": 0.05, "max": 1.0},
            f"{at}.friction.mu_static": {"min": contact.mu_dynamic, "max": 1.5},
            f"{at}.friction.mu_dynamic": {"min": 0.0, "max": contact.mu_static},
        }
    if plan.control is None:
        return found | {"gravity.2": {"min": -20.0, "max": 0.0}}
    keys = ["kp", "kd"]
    if isinstance(plan.control, Press):
        speed = ["speed"] if len(plan.control.path) > 1 else []
        keys = ["normal_force", *speed, "stiffness", "damping"]
    return found | {f"controller.{key}": {} for key in keys}


def _fill(template: str, **values: object) -> str:
    """Put `values` in place of the {names}: as TOML where a value stands, else as plain text."""
    formatter, lines = Formatter(), list[str]()
    for line in template.splitlines():
        key, equals, rest = line.partition(" = ")
        code, mark, comment = rest.partition(" # ")
        if not equals or line.startswith("#"):
            lines.append(formatter.format(line, **values))
            continue
        text = ""
        for literal, name, _, conversion in formatter.parse(code):
            value = None if name is None else formatter.get_field(name, (), values)[0]
            if conversion == "o" and (
                not value or (isinstance(value, list | tuple) and not any(value))
            ):
                break
            text += literal if name is None else literal + _toml(value)
        else:
            start = formatter.format(key, **values)
            text = f"{start} = {text}"
            if isinstance(value, list) and (isinstance(value[0], list) or len(text) > 96):
                text = f"{start} = [\n" + "".join(f"  {_toml(one)},\n" for one in value) + "]"
            if mark:
                text = f"{text.ljust(_COLUMN)} # {formatter.format(comment, **values)}"
            lines.append(text)
            continue
        if lines and lines[-1].startswith("#"):
            lines.pop()
    return "\n".join(lines) + "\n"


def _rounded(values: ArrayLike, digits: int) -> list[float]:
    rounded: list[float] = (np.round(np.asarray(values), digits) + 0.0).tolist()  # no -0.0
    return rounded


def _toml(value: object) -> str:
    """Return `value` as TOML writes it; very large and very small numbers in powers of ten."""
    if isinstance(value, bool | str | int):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(k)} = {_toml(one)}' for k, one in value.items())} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if not isinstance(value, float):
        raise TypeError(f"no TOML for {value!r}")
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        return repr(value)
    mantissa, exponent = f"{value:.15e}".split("e")
    return f"{float(mantissa)!r}e{int(exponent)}"


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _toml(name)
