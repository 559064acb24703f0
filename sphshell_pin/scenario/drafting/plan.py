"""What a new scenario consists of, chosen: the values that its text states and explains."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.materials import Material
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.part import Part
from sphshell_pin.scenario.drafting.paths import Way
from sphshell_pin.scenario.drafting.placing import Place
from sphshell_pin.scenario.drafting.poses import NO_LIMIT, Stance
from sphshell_pin.scenario.drafting.tip_contact import (
    GRAVITY,
    Contact,
    bearable,
    contact_of,
    hertz_stiffness,
)
from sphshell_pin.scenario.drafting.wording import axis_name, listed, mm, rounded

# Gap of a tip at the start, as a part of its radius.
TIP_GAP = 0.02
# How far friction and force may turn a tip that is to keep its orientation [rad].
TIP_TURN = 0.02
# Largest normal force by default [N], and in weights of the tip's effective mass.
MOST_FORCE, MOST_WEIGHTS = 5.0, 2.0
# Speed of the path across a surface: radii a second.
PATH_RATE = 3.0
LEAD_IN = 0.5
FORCE_RISE = 0.25
# Energy of a mass that touches, as a part of force times depth at rest: it presses then less than
# half as hard again.
TOUCH_ENERGY = 0.3
# Ramps of the target's speed and acceleration, each [s].
RAMP = 0.25
# How fast a moved tip returns to its path [rad/s], and how far friction may delay it, in
# radii.
TIP_RATE, TIP_LAG = 20.0, 0.2
WEAK = (
    "the effort limits that the robot's file states for its joints are not modeled, because they "
    "do not bear its own weight, friction and this motion"
)


@dataclass(frozen=True)
class Press:
    """A tip that is moved along a path and pressed on the surface."""

    force: float
    path: Array
    """Points (k, 3) in the shell's frame [m]."""
    speed: float
    lead_in: float
    force_rise: float
    first_touch: float
    """When the sphere has crossed the gap, about [s]."""
    stiffness: float
    damping: float
    rotational_stiffness: float
    rotational_damping: float
    even: bool
    """Whether the sphere touches one face along the whole path: all of `force` acts there."""
    posture_stiffness: tuple[float, ...]
    joint_damping: tuple[float, ...]
    smooth: bool = True
    """Whether a path of more than two points bends, and has no corners."""
    damped: float = 0.7
    """Damping as a part of the critical one."""

    @property
    def spline(self) -> bool:
        """Whether the path is one smooth curve."""
        return self.smooth and len(self.path) > 2

    def calmed(self) -> Press:
        """Return it with four times the damping, and joints that nothing pulls to a posture."""
        return replace(
            self,
            posture_stiffness=(),
            damping=rounded(4.0 * self.damping),
            rotational_damping=rounded(4.0 * self.rotational_damping),
            damped=4.0 * self.damped,
        )

    @property
    def slides(self) -> bool:
        """Whether the tip moves; then the robot's inertia is to be kept from the surface."""
        return len(self.path) > 1

    @property
    def acceleration(self) -> float | None:
        """Limit of the target's acceleration [m/s2], where it moves."""
        return rounded(self.speed / RAMP) if self.slides else None

    @property
    def jerk(self) -> float | None:
        """Limit of the target's jerk [m/s3], where it moves."""
        return rounded(self.speed / RAMP**2) if self.slides else None


@dataclass(frozen=True)
class Hold:
    """Joints held in the posture of the start."""

    kp: float
    kd: float
    sag: float
    """How far the load draws the springs, about [rad]."""
    drawn: Mapping[str, object] = field(default_factory=dict)
    """Where the springs of fingers would take them, by joint."""
    force: float = 0.0
    """Largest normal force of fingers [N]."""


@dataclass(frozen=True)
class Plan:
    """A scenario before it is text."""

    tips: tuple[Tip, ...]
    contact: Contact
    control: Press | Hold | None
    duration: float
    gap: float
    placement: pin.SE3
    """Placement of the shell in the world."""
    root: Array | None
    """Where the free root starts: x y z and quaternion x y z w."""
    why: tuple[str, ...] = ()
    """One sentence for each choice that was made for the user."""
    part: Part | None = None
    """The free part that carries the shell, at `root`."""
    strongest: int = 0
    """Which of the tips is checked, the one that presses most."""
    repair: str = ""
    """What was changed of a draft that failed; "" of the first draft."""


def press_force(
    stance: Stance, tip: Tip, materials: tuple[Material, Material], press: float | None
) -> float:
    """Return the normal force [N]; SphshellError where the joints cannot push as hard."""
    if press is None:
        return rounded(_suitable_force(stance, tip.radius, materials))
    if press > stance.force:
        raise SphshellError(
            f"the joints' effort limits allow a push of {rounded(stance.force, 3):g} N along "
            f"{_direction(stance.approach)}, not {press:g} N"
        )
    deepest = hertz_stiffness(tip.radius, *materials) * (0.5 * tip.radius) ** 1.5
    if press > deepest:
        raise SphshellError(
            f"{press:g} N would press a {materials[0].name} sphere of radius {mm(tip.radius)} in "
            "by more than half of it: a smaller --press, a larger --radius, or a harder --law"
        )
    return press


def press_gap(
    radius: float, force: float, mass: float, materials: tuple[Material, Material]
) -> float:
    """Return the gap at the start [m]: in parts of the depth under `force` [N] at rest.

    One and a half; less of a large `mass` [kg], whose energy at the first touch, 4 gap^1.5
    sqrt(mass force) / rise by the motion in `press_plan`, is then a part of force times depth.
    """
    rest = float((force / hertz_stiffness(radius, *materials)) ** (2 / 3))
    calm = float((TOUCH_ENERGY * FORCE_RISE / (4 * math.sqrt(mass * rest / force))) ** (2 / 3))
    return min(TIP_GAP * radius, min(1.5, calm) * rest)


def press_plan(
    tip: Tip,
    place: Place,
    way: Way,
    materials: tuple[Material, Material],
    force: float,
    gap: float,
    weak: bool,
) -> Plan:
    """Plan a scenario in which a tip of a robot with a fixed base presses with `force` [N].

    The sphere begins with the `gap` [m] at the first point of the `way`; the efforts of motors that
    are too `weak` are not modeled.
    """
    stance, path = place.stance, way.points
    rate = rounded(min(PATH_RATE * tip.radius, NO_LIMIT if weak else stance.fastest))
    # Over the gap the mass is moved by 3 force (t / rise)^2, the beginning of the rise: the gap is
    # force t^4 / (4 mass rise^2), the speed four times that by t.
    crossing = (4 * stance.mass * FORCE_RISE**2 * gap / force) ** 0.25
    contact = contact_of(materials, 4 * gap / crossing, 0.1 * rate)
    softest = contact.mu_static * force / (TIP_LAG * tip.radius)
    stiffness = max(stance.slide_mass * TIP_RATE**2, softest)
    mass = math.sqrt(stance.mass * stance.slide_mass)
    turning = 0.0
    if stance.inertia:
        moment = contact.mu_static * force * tip.radius
        turning = max(stance.inertia * TIP_RATE**2, moment / TIP_TURN)
    spare = stance.joints > (6 if turning else 3)
    # The posture's pull may take a fiftieth of the normal force at the end of the path.
    pull = min(0.02 * force / (stance.mass * max(way.length, tip.radius)), 100.0) if spare else 0.0
    control = Press(
        force=force,
        path=path,
        even=way.even,
        speed=rate,
        lead_in=LEAD_IN,
        force_rise=FORCE_RISE,
        first_touch=crossing,
        stiffness=rounded(stiffness),
        damping=rounded(1.4 * math.sqrt(stiffness * mass)),
        rotational_stiffness=rounded(turning),
        rotational_damping=rounded(1.4 * math.sqrt(turning * stance.inertia)),
        posture_stiffness=tuple(rounded(pull * one) for one in stance.joint_inertia),
        joint_damping=tuple(rounded(0.7 * math.sqrt(pull) * one) for one in stance.joint_inertia),
        smooth=way.smooth,
    )
    why = [f"the sphere of radius {mm(tip.radius)} on frame '{tip.frame}': {tip.source}"]
    why.append(
        f"the surface is {mm(gap)} in front of the sphere, which presses along "
        f"{_direction(stance.approach)}"
    )
    why.append("the joints are bent to a posture in which the tip moves well and can press")
    why.append(place.told)
    if stance.lock:
        why.append(f"joints that do not move the tip are locked: {len(stance.lock)}")
    why.append(
        f"normal force {force:g} N, for an effective mass of {stance.mass:.3g} kg at the tip"
    )
    why += [WEAK] if weak else []
    if not way.even:
        why.append("the force on the surface is the resultant of several")
    if len(path) < 2:
        why.append(f"the tip presses in one place and does not slide: {way.why}")
    else:
        why.append(f"the tip slides over {mm(way.length)}")
    corners = 0 if len(path) < 2 else 1 if control.spline else len(path) - 1
    duration = math.ceil(10 * (LEAD_IN + way.length / rate + 2 * RAMP * corners + 0.5)) / 10
    return Plan((tip,), contact, control, duration, gap, place.placement, None, tuple(why))


def _direction(direction: Array) -> str:
    return axis_name(direction) or listed(direction, ".2f")


def _suitable_force(stance: Stance, radius: float, materials: tuple[Material, Material]) -> float:
    weights = MOST_WEIGHTS * stance.mass * GRAVITY
    return min(MOST_FORCE, 0.1 * stance.force, weights, bearable(radius, *materials))
