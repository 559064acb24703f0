"""What a new scenario consists of, chosen: the values that its text states and explains."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.materials import (
    Material,
    find_material,
    friction_between,
    restitution_between,
)
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.part import GRAVITY, Part
from sphshell_pin.scenario.drafting.paths import Way
from sphshell_pin.scenario.drafting.placing import Place
from sphshell_pin.scenario.drafting.poses import NO_LIMIT, Stance
from sphshell_pin.scenario.drafting.wording import axis_name, listed, mm, rounded

# Gap of a tip at the start, as a part of its radius.
TIP_GAP = 0.02
# How far friction and force may turn a tip that is to keep its orientation [rad].
TIP_TURN = 0.02
# Largest normal force by default [N], and in weights of the tip's effective mass.
MOST_FORCE, MOST_WEIGHTS = 5.0, 2.0
# Speed of the path across a surface: radii a second.
PATH_RATE = 3.0
# The force comes on in that time [s] at least, and in so many periods of the mass on the contact,
# beside which it would be a step; the tip stands still twice as long.
FORCE_RISE, PERIODS = 0.25, 2.0
# Energy of a mass that touches, as a part of force times depth at rest: it presses then less than
# a quarter as hard again.
TOUCH_ENERGY = 0.15
# Ramps of the target's speed and acceleration, each [s].
RAMP = 0.25
# How fast a moved tip returns to its path [rad/s], and how far friction may delay it, in
# radii.
TIP_RATE, TIP_LAG = 20.0, 0.2
# Damping as a part of the critical one, and how much more there is of it where that failed.
DAMPED, CALM = 0.7, 4.0
WEAK = (
    "the effort limits that the robot's file states for its joints are not modeled, because they "
    "do not bear its own weight, friction and this motion"
)


class Materials(NamedTuple):
    """What a sphere and a surface are made of; lengths in [m], forces in [N]."""

    sphere: Material
    surface: Material

    @property
    def friction(self) -> float:
        """Coefficient of static friction."""
        return friction_between(*self)[0]

    def stiffness(self, radius: float) -> float:
        """Return Hertz's stiffness [N/m^1.5] of a sphere on a plane."""
        return 4 / 3 * math.sqrt(radius) / sum((1 - one.poisson**2) / one.young for one in self)

    def depth(self, force: float, radius: float) -> float:
        """Return the depth [m] at which a force [N] holds a sphere."""
        return float((force / self.stiffness(radius)) ** (2 / 3))

    def bearable(self, radius: float) -> float:
        """Return the load that presses a sphere in by a fifteenth of its radius."""
        return float(self.stiffness(radius) * (radius / 15) ** 1.5)

    def too_deep(self, force: float, radius: float) -> str:
        """Say that a force presses a sphere too far in; "" if it does not."""
        if self.depth(force, radius) <= 0.5 * radius:
            return ""
        ball = f"a {self.sphere.name} sphere of radius {mm(radius)}"
        return f"{force:.3g} N would press {ball} in by more than half of it"

    def sticking(self, radius: float, speed: float, load: float, mass: float) -> Contact:
        """Return a contact whose friction sticks under a load, that of a `mass` [kg]."""
        slope = 1.5 * self.stiffness(radius) ** (2 / 3) * load ** (1 / 3)
        bristle = (rounded(slope), rounded(0.2 * math.sqrt(slope * mass)))
        return Contact(self, speed, bristle=bristle)


class Contact:
    """Law and friction of a tip, as the scenario states them.

    The first touch is at `speed` [m/s], at which the restitution holds; friction is full at the
    slip speed `v_static` [m/s]. `bristle` is stiffness [N/m] and damping [N s/m] of bristles, for
    what has to stand.
    """

    def __init__(
        self,
        materials: Materials,
        speed: float,
        v_static: float = 0.005,
        bristle: tuple[float, float] | None = None,
    ) -> None:
        self.material, self.against = materials
        self.restitution = restitution_between(*materials)
        self.mu_static, self.mu_dynamic = (round(mu, 3) for mu in friction_between(*materials))
        self.speed, self.v_static, self.bristle = rounded(speed), rounded(v_static), bristle
        self.v_dynamic = rounded(10 * self.v_static)

    @property
    def note(self) -> str:
        """Where the values are from."""
        pair = f"{self.material.name} on {self.against.name}"
        return f"law and friction of {pair}, typical values: --law and --against name others"


def chosen_materials(asked: Asked, tips: Sequence[Tip], load: float) -> Materials:
    """Return what sphere and surface are made of; `load` [kg] rests on each, 0: it falls."""
    rubber = Materials(find_material("rubber"), find_material(asked.against or "steel"))
    # A tip is of rubber, unless the mass behind it would press rubber in too far.
    bears = rubber.bearable(min(tip.radius for tip in tips)) >= load * GRAVITY
    name = asked.material or (("rubber" if bears else "plastic") if load else "steel")
    return rubber._replace(sphere=find_material(name))


@dataclass
class Press:
    """A tip of a robot with a fixed base that is moved along a `way` and pressed on the surface.

    The sphere begins with the `gap` [m] at the first point of the way and presses with `force` [N],
    from `lead_in` [s] on while it slides. The efforts of motors that are too `weak` are not
    modeled. A `calm` one has more damping, and joints that nothing pulls to a posture. `repair` is
    what was changed of a draft that failed; "" of the first draft. The surface is `hollow` if it is
    touched from inside.

    Attributes
    ----------
    first_touch
        When the sphere has crossed the gap, about [s].
    slides
        Whether the tip moves; then the robot's inertia is to be kept from the surface.
    spline
        Whether the path is one smooth curve.
    acceleration, jerk
        Limits of the target's [m/s2, m/s3], where it moves.
    """

    place: Place
    way: Way
    materials: Materials
    force: float
    gap: float
    weak: bool = False
    lead_in: float = 0.0
    calm: bool = False
    repair: Literal["", "calmed", "cut", "stays", "slower"] = ""
    hollow: bool = False

    def __post_init__(self) -> None:
        stance, force, self.slides = self.place.stance, self.force, self.way.slides
        radius = stance.tip.radius
        # As it comes into the part, its spring shall not pull it back to where it was before.
        beside = (self.gap + self.materials.depth(force, radius)) * stance.aside
        self.path = self.way.points + self.place.placement.rotation.T @ beside
        rise = force_rise(radius, force, stance.mass, self.materials)
        self.force_rise = max(0.5 * self.lead_in, rise)
        self.lead_in = 2 * self.force_rise
        self.speed = rounded(min(PATH_RATE * radius, NO_LIMIT if self.weak else stance.fastest))
        self.spline = self.way.smooth and len(self.path) > 2
        self.acceleration = rounded(self.speed / RAMP) if self.slides else None
        self.jerk = rounded(self.speed / RAMP**2) if self.slides else None
        # Over the gap the mass is moved by 3 force (t / rise)^2, the beginning of the rise: the gap
        # is force t^4 / (4 mass rise^2), the speed four times that by t.
        self.first_touch = (4 * stance.mass * self.force_rise**2 * self.gap / force) ** 0.25
        # What slides as it comes to rest does so at once, where nothing makes it slide later.
        slip = self.speed * (1.0 if stance.slide is None else 0.1)
        self.contact = Contact(self.materials, 4 * self.gap / self.first_touch, slip)
        self.damped = DAMPED * (CALM if self.calm else 1.0)
        friction = self.contact.mu_static * force
        # What cannot slide follows no path: its mass would be damped more than the contact bears.
        follows = 0.0 if stance.slide is None else stance.slide_mass * TIP_RATE**2
        stiffness = max(follows, friction / (TIP_LAG * radius))
        mass = math.sqrt(stance.mass * stance.slide_mass)
        turning = 0.0
        if stance.inertia:
            turning = max(stance.inertia * TIP_RATE**2, friction * radius / TIP_TURN)
        self.stiffness, self.rotational_stiffness = rounded(stiffness), rounded(turning)
        self.damping = rounded(2 * self.damped * math.sqrt(stiffness * mass))
        self.rotational_damping = rounded(2 * self.damped * math.sqrt(turning * stance.inertia))
        # The posture's pull may take a fiftieth of the normal force at the end of the path.
        pull = min(0.02 * force / (stance.mass * max(self.way.length, radius)), 100.0)
        pull = pull if len(stance.joint_inertia) > (6 if turning else 3) else 0.0
        joints = stance.joint_inertia
        self.posture_stiffness = [] if self.calm else [rounded(pull * one) for one in joints]
        self.joint_damping = [rounded(0.7 * math.sqrt(pull) * one) for one in joints]

    def plan(self) -> Plan:
        """Return the scenario."""
        place, way, stance, tip = self.place, self.way, self.place.stance, self.place.stance.tip
        lock, farther = stance.limb.lock, f": farther {way.why}" if way.why else ""
        why = (
            f"the sphere of radius {mm(tip.radius)} on frame '{tip.frame}': {tip.source}",
            f"the surface is {mm(self.gap)} in front of the sphere, which presses along "
            f"{_direction(stance.approach)}",
            "the joints are bent to a posture in which the tip moves well and can press",
            place.told,
            lock and f"joints that do not move the tip are locked: {len(lock)}",
            f"normal force {self.force:g} N, for an effective mass of {stance.mass:.3g} kg at the "
            "tip",
            self.weak and WEAK,
            self.hollow
            and "the limb comes in through the upper half of the bowl, which is open to it",
            not way.even and "the force on the surface is the resultant of several",
            f"the tip slides over {mm(way.length)}{farther}"
            if self.slides
            else f"the tip presses in one place and does not slide: {way.why}",
        )
        corners = 0 if not self.slides else 1 if self.spline else len(self.path) - 1
        moving = way.length / self.speed + 2 * RAMP * corners
        duration = math.ceil(10 * (self.lead_in + (moving or 0.5) + 0.5)) / 10
        said = tuple(one for one in why if one)
        control = self.contact, self, duration, self.gap
        return Plan((tip,), *control, stance.q, lock, place.placement, said, weak=self.weak)


@dataclass(frozen=True)
class Hold:
    """Joints held in the posture of the start.

    The load draws the springs by about `sag` [rad]. Those of fingers would take them where they are
    `drawn`, by joint; the largest normal force of a finger is `force` [N].
    """

    kp: float
    kd: float
    sag: float
    drawn: Mapping[str, object] = field(default_factory=dict)
    force: float = 0.0


@dataclass(frozen=True)
class Plan:
    """A scenario before it is text.

    The robot starts at q (nq,), without the joints to `lock`; the effort limits of motors that are
    too `weak` are not modeled. `placement` is that of the shell in the world, or of a free `part`
    that carries it; None: it stands as in its file. `why` has one sentence for each choice that was
    made for the user. The tip number `strongest` presses most, and is checked.
    """

    tips: tuple[Tip, ...]
    contact: Contact
    control: Press | Hold | None
    duration: float
    gap: float
    q: Array
    lock: tuple[str, ...]
    placement: pin.SE3 | None = None
    why: tuple[str, ...] = ()
    part: Part | None = None
    weak: bool = False
    strongest: int = 0


def press_force(stance: Stance, materials: Materials, press: float | None) -> float:
    """Return the normal force [N]; SphshellError where the joints cannot push as hard."""
    radius, most = stance.tip.radius, stance.force or NO_LIMIT
    if press is None:
        weights = MOST_WEIGHTS * stance.mass * GRAVITY
        return rounded(min(MOST_FORCE, 0.1 * most, weights, materials.bearable(radius)))
    if press > most:
        raise SphshellError(
            f"the joints' effort limits allow a push of {rounded(most, 3):g} N along "
            f"{_direction(stance.approach)}, not {press:g} N"
        )
    if said := materials.too_deep(press, radius):
        raise SphshellError(f"{said}: a smaller --press, a larger --radius, or a harder --law")
    return press


def force_rise(radius: float, force: float, mass: float, materials: Materials) -> float:
    """Return how long the force [N] that moves a `mass` [kg] comes on [s]."""
    slope = 1.5 * force / materials.depth(force, radius)
    return max(FORCE_RISE, rounded(PERIODS * 2 * math.pi * math.sqrt(mass / slope)))


def press_gap(radius: float, force: float, mass: float, materials: Materials) -> float:
    """Return the gap at the start [m]: in parts of the depth under `force` [N] at rest.

    One and a half; less of a large `mass` [kg], whose energy at the first touch, 4 gap^1.5
    sqrt(mass force) / rise by the motion in `Press`, is then a part of force times depth.
    """
    rest, rise = materials.depth(force, radius), force_rise(radius, force, mass, materials)
    calm = float((TOUCH_ENERGY * rise / (4 * math.sqrt(mass * rest / force))) ** (2 / 3))
    return min(TIP_GAP * radius, min(1.5, calm) * rest)


def _direction(direction: Array) -> str:
    return axis_name(direction) or listed(direction, ".2f")
