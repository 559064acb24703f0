"""A planned scenario as text: TOML with comments beside the values that say where they are from."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Formatter

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.part import part_file
from sphshell_pin.scenario.drafting.plan import Hold, Plan, Press
from sphshell_pin.scenario.drafting.wording import rounded
from sphshell_pin.scenario.format.schema import RobotSection, ShellSection

HELD, HELD_IN_HAND = 0.05, 0.15
"""How well a scenario holds its normal force, as a part of it, and a hand its largest one."""

_SIDES = {
    "both": "spheres may touch it from both sides",
    "outside": "a closed body: spheres touch it from outside",
    "inside": "a hollow: spheres touch it from inside",
}
# Column of the comments beside values.
_COLUMN = 34

# A line whose value is marked !o (optional) and is nothing, or zero, is left out, with the comment
# line above it.
_PARTS = re.split(
    r"^==== (.*)\n", Path(__file__).with_name("draft.template").read_text("utf-8"), flags=re.M
)
_TEMPLATES = dict(zip(_PARTS[1::2], _PARTS[2::2], strict=True))


def draft_text(name: str, title: str, robot: RobotSection, shell: ShellSection, plan: Plan) -> str:
    """Return the text of the scenario called `name`."""
    digits, part, contact, tips = decimals(plan.gap), plan.part, plan.contact, plan.tips
    text = _fill(
        "robot", name=name, title=title, robot=robot, table="[[robot]]" if part else "[robot]"
    )
    if not robot.mimic:
        text += "mimic = false # joints that mimic others move freely\n"
    if robot.start:
        text += _fill("posture") + _table(robot.start)
    if part:
        root = _rounded(pin.SE3ToXYZQUAT(plan.placement), 9)
        text += _fill("part", body=part, material=contact.against, urdf=part_file(name), root=root)
    sides = {"side": _SIDES[shell.side], "frame": "part/part" if part else shell.frame}
    text += _fill("shell", shell=shell, primitive=shell.model_dump()["primitive"], **sides)
    if plan.placement is not None and part is None:
        angles = np.rad2deg(pin.rpy.matrixToRpy(plan.placement.rotation))
        angles[np.abs(angles) < 1e-6] = 0.0
        xyz, rpy = _rounded(plan.placement.translation, digits), _rounded(angles, digits)
        text += _fill("placement", gap=1e3 * plan.gap, xyz=xyz, rpy_deg=rpy)
    label = f"{robot.label}/" if robot.label else ""
    group = f"tip{'s' if len(tips) > 1 else ''}-{shell.name}"
    text += _contact_text(group, shell, plan, label, digits)
    brakes = bool({"damping", "friction"} & set(robot.joints))
    pair = _pair_name(group, tips, label, plan.strongest)
    control, mean_force = plan.control, None
    if isinstance(control, Press):
        path = _rounded(control.path, digits)
        offset = _rounded(plan.tips[0].offset, digits)
        moves = "follows a path on the surface and presses on it"
        told = f"The tip {moves if control.slides else 'presses on one place of the surface'}."
        values = {"offset": offset, "path": path, "told": told, "brakes": brakes}
        text += _fill("press", tip=tips[0], shell=shell, press=control, **values)
        if control.way.even:
            # Over the time of contact; while the force comes on, half of it on average.
            full = plan.duration - 0.5 * control.force_rise
            mean = control.force * full / (plan.duration - control.first_touch)
            mean_force = {"value": rounded(mean, 3), "rtol": HELD}
    elif isinstance(control, Hold):
        text += _fill("hold", hold=control, brakes=brakes and part is not None)
        if part:
            text += _fill("drawn") + _table(control.drawn)
            mean_force = {"value": rounded(control.force, 3), "rtol": HELD_IN_HAND}
    # Measured on balls, arms, hands and legs: the implicit integrator is never much slower than
    # others, and ten times faster than fixed steps that resolve the contact.
    record_dt, slow = (1e-3, 0.5) if control is None else (5e-3, None)
    text += _fill("run", plan=plan, record_dt=record_dt, slow=slow)
    text += _fill("knobs", group=group, contact=contact)
    keys = [] if control is None else ["kp", "kd"]
    if isinstance(control, Press):
        keys = ["normal_force", *(["speed"] if control.slides else []), "stiffness", "damping"]
    else:
        text += _fill("knob of gravity")
    text += "".join(_fill("knob", key=key) for key in keys)
    return text + _fill("expect", pair=pair, mean_force=mean_force)


def _contact_text(group: str, shell: ShellSection, plan: Plan, label: str, digits: int) -> str:
    """Return the tables of the contact of all tips, whose robot has a `label`."""
    contact, tips = plan.contact, plan.tips
    spheres = [
        {"frame": label + tip.frame, "radius": tip.radius}
        | ({"offset": _rounded(tip.offset, digits)} if tip.offset.any() else {})
        for tip in tips
    ]
    one, several = (spheres[0], None) if len(tips) == 1 else (None, spheres)
    radius = min(tip.radius for tip in tips)
    values = {"sphere": one, "spheres": several, "shell": shell, "radius": radius}
    kind = "coulomb" if contact.bristle is None else "bristle"
    text = _fill("contact", pair=group, plan=plan, **values)
    return text + _fill(kind, contact=contact, torsional=plan.part is not None)


def _pair_name(group: str, tips: Sequence[Tip], label: str, k: int) -> str:
    """Return the name of the contact of `tips[k]`, one of a `group`."""
    if len(tips) == 1:
        return group
    frames = [tip.frame for tip in tips]
    number = f"-{frames[:k].count(frames[k])}" if frames.count(frames[k]) > 1 else ""
    return f"{group}/{label}{frames[k]}{number}"


def decimals(gap: float) -> int:
    """Return how many decimals of a meter keep the `gap` [m] at the start to half a percent."""
    return max(4, math.ceil(-math.log10(gap / 200)))


def _fill(part: str, **values: object) -> str:
    """Return a part of the template with `values` in place of the {names}.

    Where a value stands, it is as TOML writes it; marked !s, and elsewhere, plain text.
    """
    formatter, lines = Formatter(), list[str]()
    for line in _TEMPLATES[part].splitlines():
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
            plain = str if conversion == "s" else toml
            text += literal if name is None else literal + plain(value)
        else:
            start = formatter.format(key, **values)
            text = f"{start} = {text}"
            if isinstance(value, list) and (isinstance(value[0], list) or len(text) > 96):
                text = f"{start} = [\n" + "".join(f"  {toml(one)},\n" for one in value) + "]"
            if mark:
                text = f"{text.ljust(_COLUMN)} # {formatter.format(comment, **values)}"
            lines.append(text)
            continue
        if lines and lines[-1].startswith("#"):
            lines.pop()
    return "\n".join(lines) + "\n"


def _table(values: Mapping[str, object]) -> str:
    """Return lines of a table."""
    return "".join(f"{_key(name)} = {toml(value)}\n" for name, value in values.items())


def _rounded(values: ArrayLike, digits: int) -> list[float]:
    rounded: list[float] = (np.round(np.asarray(values), digits) + 0.0).tolist()  # no -0.0
    return rounded


def toml(value: object) -> str:
    """Return `value` as TOML writes it; very large and very small numbers in powers of ten."""
    if isinstance(value, bool | str | int):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(k)} = {toml(one)}' for k, one in value.items())} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    if not isinstance(value, float):
        raise TypeError(f"no TOML for {value!r}")
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        return repr(value)
    mantissa, exponent = f"{value:.15e}".split("e")
    return f"{float(mantissa)!r}e{int(exponent)}"


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml(name)
