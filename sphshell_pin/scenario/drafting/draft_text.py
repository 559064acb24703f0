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

# Sections by the name of the value that they need. A line whose value is marked !o (optional) and
# is nothing, or zero, is left out, with the comment line above it.
_PARTS = re.split(
    r"^==== (.*)\n", Path(__file__).with_name("draft.template").read_text("utf-8"), flags=re.M
)
_SECTIONS = tuple(zip(_PARTS[1::2], _PARTS[2::2], strict=True))


def draft_text(name: str, title: str, robot: RobotSection, shell: ShellSection, plan: Plan) -> str:
    """Return the text of the scenario called `name`."""
    digits, part, contact, tips = decimals(plan.gap), plan.part, plan.contact, plan.tips
    press = plan.control if isinstance(plan.control, Press) else None
    hold = plan.control if isinstance(plan.control, Hold) else None
    label = f"{robot.label}/" if robot.label else ""
    group = f"tip{'s' if len(tips) > 1 else ''}-{shell.name}"
    values = {"always": True, "name": name, "title": title, "robot": robot, "plan": plan}
    values |= {"shell": shell, "part": part, "press": press, "hold": hold, "tips": tips}
    values |= {"free": not robot.mimic, "start": _table(robot.start), "urdf": part_file(name)}
    values |= {"table": "[[robot]]" if part else "[robot]", "unpressed": not press}
    place = plan.placement or pin.SE3.Identity()
    angles = np.rad2deg(pin.rpy.matrixToRpy(place.rotation))
    angles[np.abs(angles) < 1e-6] = 0.0
    values |= {"xyz": _rounded(place.translation, digits), "rpy_deg": _rounded(angles, digits)}
    values |= {"placed": plan.placement and not part, "gap": 1e3 * plan.gap}
    values |= {"root": _rounded(pin.SE3ToXYZQUAT(place), 9)}
    values |= {"primitive": shell.model_dump()["primitive"], "side": _SIDES[shell.side]}
    values |= {"frame": "part/part" if part else shell.frame}
    spheres = [
        {"frame": label + tip.frame, "radius": tip.radius}
        | ({"offset": _rounded(tip.offset, digits)} if tip.offset.any() else {})
        for tip in tips
    ]
    one, several = (spheres[0], None) if len(tips) == 1 else (None, spheres)
    values |= {"sphere": one, "spheres": several, "radius": min(tip.radius for tip in tips)}
    values |= {"contact": contact, "coulomb": not contact.bristle, "bristle": contact.bristle}
    values |= {"group": group, "pair": _pair_name(group, tips, label, plan.strongest)}
    brakes = bool({"damping", "friction"} & set(robot.joints))
    values |= {"brakes": brakes, "grips": brakes and part is not None, "held": part is not None}
    slides, mean_force = press is not None and press.slides, None
    if press:
        does = "follows a path on the surface and presses on it"
        values |= {"does": does if slides else "presses on one place of the surface"}
        values |= {"path": _rounded(press.path, digits), "offset": _rounded(tips[0].offset, digits)}
    if press and press.way.even:
        # Over the time of contact; while the force comes on, half of it on average.
        full = plan.duration - 0.5 * press.force_rise
        mean = press.force * full / (plan.duration - press.first_touch)
        mean_force = {"value": rounded(mean, 3), "rtol": HELD}
    elif hold and part:
        mean_force = {"value": rounded(hold.force, 3), "rtol": HELD_IN_HAND}
    values |= {"slides": slides, "mean_force": mean_force}
    values |= {"drawn": _table(hold.drawn) if hold and part else ""}
    # Measured on balls, arms, hands and legs: the implicit integrator is never much slower than
    # others, and ten times faster than fixed steps that resolve the contact.
    record_dt, slow = (5e-3, None) if plan.control else (1e-3, 0.5)
    values |= {"record_dt": record_dt, "slow": slow}
    return "".join(_fill(text, values) for needs, text in _SECTIONS if values[needs])


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


def _fill(section: str, values: Mapping[str, object]) -> str:
    """Return a section of the template with `values` in place of the {names}.

    Where a value stands, it is as TOML writes it; marked !s, and elsewhere, plain text.
    """
    formatter, lines = Formatter(), list[str]()
    for line in section.splitlines():
        key, equals, rest = line.partition(" = ")
        code, mark, comment = rest.partition(" # ")
        if not equals or line.startswith("#"):
            lines.append(formatter.vformat(line, (), values))
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
            start = formatter.vformat(key, (), values)
            text = f"{start} = {text}"
            if isinstance(value, list) and (isinstance(value[0], list) or len(text) > 96):
                text = f"{start} = [\n" + "".join(f"  {toml(one)},\n" for one in value) + "]"
            if mark:
                text = f"{text.ljust(_COLUMN)} # {formatter.vformat(comment, (), values)}"
            lines.append(text)
            continue
        if lines and lines[-1].startswith("#"):
            lines.pop()
    return "\n".join(lines) + "\n"


def _table(values: Mapping[str, object]) -> str:
    """Return lines of a table."""
    return "\n".join(f"{_key(name)} = {toml(value)}" for name, value in values.items())


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
