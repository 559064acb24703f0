"""What a new scenario consists of, chosen: the values that its text states and explains."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.scenario.materials import Material, friction_between, restitution_between
from sphshell_pin.scenario.poses import Stance
from sphshell_pin.scenario.spots import Spot, find_spot, way_across
from sphshell_pin.scenario.tips import Tip

Array = npt.NDArray[np.float64]

GRAVITY = 9.81
UP = np.array([0.0, 0.0, 1.0])

# Of a tip at the start, as a part of its radius; of a body that falls, and of feet.
TIP_GAP, FALL_GAP, FOOT_GAP = 0.02, 2.0, 0.1
# Largest normal force by default [N], and in weights of the tip's effective mass.
MOST_FORCE, MOST_WEIGHTS = 5.0, 2.0
# The way across a surface: radii long, part of the robot's reach, radii a second.
WAY_RADII, WAY_REACH, WAY_RATE = 10.0, 0.15, 3.0
LEAD_IN = 0.5
# How fast a drawn tip comes back to its way [rad/s], and how far friction may hold it behind, in
# radii.
TIP_RATE, TIP_LAG = 20.0, 0.2
# Sag of a standing robot's joints under its weight [rad].
SAG = 0.05


@dataclass(frozen=True)
class Contact:
    """Law and friction of a tip, as the scenario states them."""

    material: Material
    against: Material
    restitution: float
    speed: float
    """At which the restitution holds: of the first touch [m/s]."""
    mu_static: float
    mu_dynamic: float
    v_static: float
    """Slip speed [m/s] at which friction is full."""
    bristle: tuple[float, float] | None = None
    """Stiffness [N/m] and damping [N s/m] of bristles, for what has to stand."""


@dataclass(frozen=True)
class Press:
    """A tip that is drawn along a way and pressed on the surface."""

    force: float
    way: Array
    """Points (k, 3) in the shell's frame [m]."""
    speed: float
    lead_in: float
    stiffness: float
    damping: float
    rotational_stiffness: float
    rotational_damping: float
    posture_stiffness: tuple[float, ...]
    joint_damping: tuple[float, ...]


@dataclass(frozen=True)
class Hold:
    """Joints held in the posture of the start."""

    kp: float
    kd: float


@dataclass(frozen=True)
class Plan:
    """A scenario before it is text."""

    tips: tuple[Tip, ...]
    contact: Contact
    control: Press | Hold | None
    duration: float
    gap: float
    placement: Any
    """pinocchio.SE3 of the shell in the world."""
    root: Array | None
    """Where the free root starts: x y z and quaternion x y z w."""
    why: tuple[str, ...] = field(default=())
    """One sentence for each choice that was made for the user."""


def plan_press(
    shell: Any,
    tip: Tip,
    stance: Stance,
    materials: tuple[Material, Material],
    press: float | None,
    *,
    toward: Array | None = None,
) -> Plan:
    """Plan a scenario in which a tip of a robot with a fixed base presses and slides.

    `press` [N] is the normal force asked for; `toward` (3,) the side of the surface to touch.
    """
    gap = TIP_GAP * tip.radius
    spot = find_spot(shell, tip.radius, gap, toward=toward)
    turned = _turn(spot.normal, -stance.approach)
    placement = pin.SE3(turned, stance.centre - turned @ spot.centre)
    force = _round(_suitable_force(stance) if press is None else press)
    rate = _round(WAY_RATE * tip.radius)
    way = _way(shell, spot, tip, stance, turned)
    contact = _contact(materials, math.sqrt(2 * force * gap / stance.mass), 0.1 * rate)
    softest = contact.mu_static * force / (TIP_LAG * tip.radius)
    stiffness = max(stance.slide_mass * TIP_RATE**2, softest)
    mass = math.sqrt(stance.mass * stance.slide_mass)
    length = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    turning = stance.inertia * TIP_RATE**2
    spare = stance.model.nv > (6 if turning else 3)
    # The posture's pull may take a fiftieth of the normal force at the end of the way.
    pull = min(0.02 * force / (stance.mass * max(length, tip.radius)), 100.0) if spare else 0.0
    control = Press(
        force=force,
        way=way,
        speed=rate,
        lead_in=LEAD_IN,
        stiffness=_round(stiffness),
        damping=_round(1.4 * math.sqrt(stiffness * mass)),
        rotational_stiffness=_round(turning),
        rotational_damping=_round(1.4 * stance.inertia * TIP_RATE),
        posture_stiffness=tuple(_round(pull * one) for one in stance.joint_inertia),
        joint_damping=tuple(_round(1.4 * math.sqrt(pull) * one) for one in stance.joint_inertia),
    )
    why = [f"the sphere of radius {_mm(tip.radius)} on frame '{tip.frame}': {tip.said}"]
    why.append(
        f"the surface's middle is {_mm(gap)} from the sphere, across the way it moves best: "
        f"the tip presses along {_axis(stance.approach)}"
    )
    if stance.bent:
        why.append("the posture of the start was bent, as the tip could not move in the given one")
    if stance.lock:
        why.append(f"{_count(len(stance.lock), 'joint')} that do not move the tip are locked")
    if press is None:
        why.append(
            f"normal force {force:g} N, for an effective mass of {stance.mass:.3g} kg at the tip"
        )
    if len(way) < 2:
        why.append("the tip stays where it is: there is no room to slide")
    duration = math.ceil(10 * (LEAD_IN + length / rate + 0.5)) / 10
    return Plan((tip,), contact, control, duration, gap, placement, None, tuple(why))


def plan_fall(
    shell: Any, tip: Tip, centre: Array, root: Array, materials: tuple[Material, Material]
) -> Plan:
    """Plan a scenario in which a free body falls on the surface, which stands as its file says.

    `centre` (3,) [m] is the sphere's in the world when the root is at `root` (7,).
    """
    gap = FALL_GAP * tip.radius
    spot = find_spot(shell, tip.radius, gap, toward=UP)
    start = root.copy()
    start[:3] += spot.centre - centre
    speed = math.sqrt(2 * GRAVITY * gap)
    why = (
        f"the sphere of radius {_mm(tip.radius)} on frame '{tip.frame}': {tip.said}",
        f"it falls {_mm(gap)} on the middle of the surface, at {speed:.2g} m/s",
    )
    contact = _contact(materials, speed, 0.005)
    return Plan((tip,), contact, None, 1.0, gap, pin.SE3.Identity(), start, why)


def plan_stand(
    shell: Any,
    tips: tuple[Tip, ...],
    centres: Array,
    mass: float,
    joint_inertia: Array,
    leg: float,
    materials: tuple[Material, Material],
) -> Plan:
    """Plan a scenario in which a floating robot of `mass` [kg] stands on spheres.

    `centres` (k, 3) [m] are those of the `tips` in the world, `joint_inertia` [kg m^2] the
    diagonal of the mass matrix of its motors, `leg` [m] the height of its root above the tips.
    """
    gap = FOOT_GAP * min(tip.radius for tip in tips)
    place = _under(shell, centres, np.array([tip.radius for tip in tips]), gap)
    load = mass * GRAVITY / len(tips)
    kp = load * 0.5 * leg / SAG
    # A leg turns the body above it as much as itself.
    inertia = float(np.median(joint_inertia)) + mass / len(tips) * (0.5 * leg) ** 2
    base = _contact(materials, math.sqrt(2 * GRAVITY * gap), 0.005)
    radius = tips[0].radius
    slope = 1.5 * hertz_stiffness(radius, *materials) ** (2 / 3) * load ** (1 / 3)
    bristle = (_round(slope), _round(0.2 * math.sqrt(slope * mass / len(tips))))
    contact = replace(base, bristle=bristle)
    why = [
        f"the sphere of radius {_mm(tip.radius)} on frame '{tip.frame}': {tip.said}" for tip in tips
    ]
    why.append(f"the robot floats, {_mm(gap)} above the surface, and its joints hold the posture")
    if len(tips) < 3:
        why.append("it will fall over: nothing but its sphere touches")
    why.append("friction sticks, so that it can stand")
    control = Hold(_round(kp), _round(1.4 * math.sqrt(kp * inertia)))
    return Plan(tips, contact, control, 2.0, gap, place, None, tuple(why))


def hertz_stiffness(radius: float, one: Material, other: Material) -> float:
    """Return Hertz's stiffness [N/m^1.5] of a sphere of `radius` [m] on a plane."""
    softness = (1 - one.poisson**2) / one.young + (1 - other.poisson**2) / other.young
    return 4 / 3 * math.sqrt(radius) / softness


def _contact(materials: tuple[Material, Material], speed: float, slip: float) -> Contact:
    static, dynamic = friction_between(*materials)
    return Contact(
        materials[0],
        materials[1],
        restitution_between(*materials),
        _round(speed),
        round(static, 3),
        round(dynamic, 3),
        _round(slip),
    )


def _suitable_force(stance: Stance) -> float:
    return min(MOST_FORCE, 0.1 * stance.force, MOST_WEIGHTS * stance.mass * GRAVITY)


def _way(shell: Any, spot: Spot, tip: Tip, stance: Stance, turned: Array) -> Array:
    """Return the way of the tip's frame, which need not stand in the sphere's centre."""
    aside = turned.T @ (stance.origin - stance.centre)
    aside = aside - spot.normal * (spot.normal @ aside)
    points = spot.point[None]
    if stance.slide is not None:
        length = min(WAY_RADII * tip.radius, WAY_REACH * stance.reach)
        points = way_across(shell, spot, turned.T @ stance.slide, length, 0.5 * tip.radius)
    return points + aside


def _under(shell: Any, centres: Array, radii: Array, gap: float) -> Any:
    """Return where the shell stands so that the nearest of the spheres has the `gap` [m] to it."""
    spot = find_spot(shell, float(radii[0]), gap, toward=UP)
    middle = np.array([*centres[:, :2].mean(axis=0), float((centres[:, 2] - radii).min()) - gap])
    shift = middle - spot.point
    for _ in range(50):
        distances = shell.closest_points(centres - shift).distances - radii
        over = float(np.abs(distances).min() if (distances > 0).all() else distances.min()) - gap
        if abs(over) < 1e-3 * gap:
            break
        shift = shift + over * UP
    return pin.SE3(np.eye(3), shift)


def _turn(source: Array, target: Array) -> Array:
    rotation: Array = pin.Quaternion.FromTwoVectors(source, target).toRotationMatrix()
    return rotation


def _round(x: float, digits: int = 2) -> float:
    return float(f"{x:.{digits}g}")


def _mm(x: float) -> str:
    return f"{x * 1e3:.3g} mm"


def _axis(direction: Array) -> str:
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) > 0.999:
        return f"{'-' if direction[k] < 0 else '+'}{'xyz'[k]}"
    return f"[{', '.join(f'{one:.2f}' for one in direction)}]"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
