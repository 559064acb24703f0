"""A planned scenario as text: TOML with a comment beside each value that says where it is from."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin.scenario.plan import Contact, Hold, Plan, Press
from sphshell_pin.scenario.schema import RobotSection, RunSection, ShellSection
from sphshell_pin.scenario.tips import Tip

# Column of the comments beside values.
_COLUMN = 34


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
    parts = [
        [
            f"# {title}.",
            "#",
            f"#   sphshell-pin run {name}.toml",
            f"#   sphshell-pin view {name}.toml",
            "#",
            "# Units are SI (m, kg, s, N, rad) unless a key says otherwise.",
        ],
        [f"title = {_string(title)}"],
        _robot(robot, plan, digits),
        _shell(shell, plan, digits),
    ]
    for tip, pair in zip(plan.tips, pairs, strict=True):
        parts.append(_contact(tip, pair, shell.name, plan, digits))
    if isinstance(plan.control, Press):
        parts.append(_press(plan.control, plan.tips[0], shell.name, digits))
    if isinstance(plan.control, Hold):
        parts.append(_hold(plan.control))
    parts.append(_run(run))
    parts += _knobs(plan, pairs)
    parts.append(_expect(plan, pairs))
    return "\n\n".join("\n".join(part) for part in parts) + "\n"


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


def _robot(robot: RobotSection, plan: Plan, digits: int) -> list[str]:
    lines = ["[robot]"]
    if robot.name is not None:
        lines.append(f"name = {_string(robot.name)}")
    if robot.urdf is not None:
        lines.append(f"urdf = {_string(robot.urdf)}")
    if robot.package_dirs:
        lines.append(f"package_dirs = {_list(map(_string, robot.package_dirs))}")
    if robot.free_flyer:
        lines.append(_beside("free_flyer = true", "the root link floats"))
    if robot.lock:
        lines.append("# They do not move the tip: held, they cost nothing.")
        lines += _wrapped("lock", map(_string, robot.lock))
    if robot.start or plan.root is not None:
        lines += ["", "[robot.start]"]
    if plan.root is not None:
        lines.append("# x y z [m] and the quaternion x y z w: the sphere stands above the surface.")
        lines.append(f"root_joint = {_numbers(plan.root, digits)}")
    elif robot.start:
        lines.append("# A posture in which the tip can move: joints [rad, m].")
    for joint, value in robot.start.items():
        if plan.root is None:
            lines.append(f"{_key(joint)} = {_value(value)}")
    return lines


def _shell(shell: ShellSection, plan: Plan, digits: int) -> list[str]:
    lines = ["[[shell]]", f"name = {_string(shell.name)}"]
    if shell.file is not None:
        lines.append(_beside(f"file = {_string(shell.file)}", "relative to this file"))
    if shell.unit is not None:
        lines.append(_beside(f"unit = {_string(shell.unit)}", "length unit of the file's numbers"))
    if shell.bodies is not None:
        lines.append(_beside(f"bodies = {_list(map(_string, shell.bodies))}", "of the CAD file"))
    if shell.faces is not None:
        faces = (str(one) if isinstance(one, int) else _string(one) for one in shell.faces)
        lines.append(_beside(f"faces = {_list(faces)}", "of the CAD file"))
    if shell.primitive is not None:
        table = ", ".join(f"{k} = {_value(v)}" for k, v in shell.primitive.model_dump().items())
        lines.append(f"primitive = {{ {table} }}")
    lines.append(_beside('side = "both"', "spheres may touch it from both sides"))
    lines.append(_beside('frame = "universe"', "fixed to the world; any frame of the robot may do"))
    if plan.root is None:
        angles = np.rad2deg(pin.rpy.matrixToRpy(plan.placement.rotation))
        lines.append(f"# Its middle stands {plan.gap * 1e3:.3g} mm before the sphere.")
        lines.append("[shell.placement]")
        lines.append(f"xyz = {_numbers(plan.placement.translation, digits)}")
        if np.abs(angles).max() > 1e-6:
            lines.append(f"rpy_deg = {_numbers(angles, digits)}")
    return lines


def _contact(tip: Tip, pair: str, shell: str, plan: Plan, digits: int) -> list[str]:
    contact = plan.contact
    one, other = contact.material, contact.against
    offset = "" if not tip.offset.any() else f", offset = {_numbers(tip.offset, digits)}"
    sphere = f"sphere = {{ frame = {_string(tip.frame)}, radius = {_value(tip.radius)}{offset} }}"
    return [
        "[[contact]]",
        f"name = {_string(pair)}",
        sphere,
        f"shell = {_string(shell)}",
        "",
        f"# Hertz: a {one.name} ball on {other.name}.",
        "[contact.law]",
        'type = "hertz"',
        _beside(f"radius = {_value(tip.radius)}", "of the ball; less where it lies in a hollow"),
        _beside(f"young_1 = {_value(one.young)}", f"[Pa] {one.name}, a typical value"),
        _beside(f"poisson_1 = {_value(one.poisson)}", ""),
        _beside(f"young_2 = {_value(other.young)}", f"[Pa] {other.name}, a typical value"),
        _beside(f"poisson_2 = {_value(other.poisson)}", ""),
        _beside(f"restitution = {_value(contact.restitution)}", "speed of rebound, as a part"),
        _beside(f"speed = {_value(contact.speed)}", "[m/s] at which it holds: the first touch"),
        "",
        *_friction(contact),
    ]


def _friction(contact: Contact) -> list[str]:
    static = _beside(
        f"mu_static = {_value(contact.mu_static)}",
        f"{contact.material.name} on {contact.against.name}, dry: a typical value",
    )
    dynamic = f"mu_dynamic = {_value(contact.mu_dynamic)}"
    if contact.bristle is not None:
        stiffness, damping = contact.bristle
        return [
            "# Friction that sticks.",
            "[contact.friction]",
            'type = "bristle"',
            static,
            dynamic,
            _beside(f"stiffness = {_value(stiffness)}", "[N/m] as stiff as the law under the load"),
            _beside(f"damping = {_value(damping)}", "[N s/m] a tenth of critical"),
        ]
    return [
        "[contact.friction]",
        'type = "coulomb"',
        static,
        dynamic,
        _beside(f"v_static = {_value(contact.v_static)}", "[m/s] slip at which friction is full"),
        _beside(f"v_dynamic = {_value(10 * contact.v_static)}", "[m/s] slip of mu_dynamic"),
    ]


def _press(press: Press, tip: Tip, shell: str, digits: int) -> list[str]:
    lines = [
        "# The tip follows a way across the surface and presses on it.",
        "[controller]",
        'type = "cartesian-impedance"',
        f"frame = {_string(tip.frame)}",
        f"shell = {_string(shell)}",
        "# Points in the shell's own coordinates [m], projected on it.",
        "path = [",
        *(f"  {_numbers(point, digits)}," for point in press.way),
        "]",
        _beside(f"normal_force = {_value(press.force)}", "[N]"),
        _beside(f"speed = {_value(press.speed)}", "[m/s] along the way: three radii a second"),
        _beside(f"lead_in = {_value(press.lead_in)}", "[s] stand still while the force comes on"),
        _beside(
            f"stiffness = {_value(press.stiffness)}",
            "[N/m] friction holds the tip a fifth of a radius behind at most",
        ),
        _beside(f"damping = {_value(press.damping)}", "[N s/m] 0.7 of critical"),
    ]
    if press.rotational_stiffness:
        lines += [
            _beside(
                f"rotational_stiffness = {_value(press.rotational_stiffness)}",
                "[N m/rad] keeps the tip's orientation",
            ),
            f"rotational_damping = {_value(press.rotational_damping)}",
        ]
    if any(press.posture_stiffness):
        lines += [
            "# What the tip does not show, the posture calms: by the joints' own inertia.",
            f"posture_stiffness = {_list(map(_value, press.posture_stiffness))}",
            f"joint_damping = {_list(map(_value, press.joint_damping))}",
        ]
    return lines


def _hold(hold: Hold) -> list[str]:
    return [
        "# Springs and dampers at the joints hold the posture of the start.",
        "[controller]",
        'type = "joint-pd"',
        _beside(f"kp = {_value(hold.kp)}", "[N m/rad] gives 0.05 rad under the weight"),
        _beside(f"kd = {_value(hold.kd)}", "[N m s/rad] 0.7 of critical"),
    ]


def _run(run: RunSection) -> list[str]:
    lines = ["[run]", f"duration = {_value(run.duration)}"]
    lines.append(_beside(f"integrator = {_string(run.integrator)}", "its steps follow the contact"))
    for key in ("dt", "rtol", "record_dt"):
        value = getattr(run, key)
        if value is not None:
            lines.append(f"{key} = {_value(value)}")
    if run.recording_speed != 1.0:
        lines.append(
            _beside(f"recording_speed = {_value(run.recording_speed)}", "the film in slow motion")
        )
    return lines


def _knobs(plan: Plan, pairs: Sequence[str]) -> list[list[str]]:
    contact = plan.contact
    knobs: list[tuple[str, Mapping[str, float]]] = []
    for pair in pairs:
        at = f"contact.{pair}"
        knobs += [
            (f"{at}.law.young_1", {}),
            (f"{at}.law.restitution", {"min": 0.05, "max": 1.0}),
            (f"{at}.friction.mu_static", {"min": contact.mu_dynamic, "max": 1.5}),
            (f"{at}.friction.mu_dynamic", {"min": 0.0, "max": contact.mu_static}),
        ]
    if isinstance(plan.control, Press):
        keys = ("normal_force", "speed", "stiffness", "damping")
        knobs += [(f"controller.{key}", {}) for key in keys]
    elif isinstance(plan.control, Hold):
        knobs += [("controller.kp", {}), ("controller.kd", {})]
    else:
        knobs.append(("gravity.2", {"min": -20.0, "max": 0.0}))
    parts = []
    for i, (key, limits) in enumerate(knobs):
        lines = ["# What one may turn while looking at it (sphshell-pin view)."] if i == 0 else []
        lines += ["[[knob]]", f"key = {_string(key)}"]
        parts.append([*lines, *(f"{name} = {_value(limit)}" for name, limit in limits.items())])
    return parts


def _expect(plan: Plan, pairs: Sequence[str]) -> list[str]:
    # Of several feet a rough surface may leave one in the air.
    lines = ["# What the run is checked against.", "[expect]"]
    if isinstance(plan.control, Press) and plan.control.even:
        force = f"{{ value = {_value(plan.control.force)}, rtol = 0.15, atol = 0.03 }}"
        lines.append(f'"pairs.{pairs[0]}.mean_force" = {force}')
    lines += [f'"pairs.{pair}.touches" = {{ min = 1 }}' for pair in pairs[:1]]
    lines.append('"energy.relative_residual" = { max = 1e-3 }')
    return lines


def _beside(code: str, comment: str) -> str:
    return f"{code.ljust(_COLUMN)} # {comment}" if comment else code


def _wrapped(key: str, items: Iterable[str]) -> list[str]:
    """Return a list on one line, or item by item where it is long."""
    all_items = list(items)
    line = f"{key} = {_list(all_items)}"
    return [line] if len(line) <= 96 else [f"{key} = [", *(f"  {i}," for i in all_items), "]"]


def _list(items: Iterable[str]) -> str:
    return f"[{', '.join(items)}]"


def _numbers(values: Iterable[float], digits: int) -> str:
    # + 0.0 turns -0.0 into 0.0
    return _list(repr(round(float(one), digits) + 0.0) for one in values)


def _value(value: Any) -> str:
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, list | tuple):
        return _list(map(_value, value))
    number = float(value)
    if number == 0 or 1e-3 <= abs(number) < 1e5:
        return repr(number)
    mantissa, exponent = f"{number:.15e}".split("e")
    return f"{float(mantissa)!r}e{int(exponent)}"


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _string(name)


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
