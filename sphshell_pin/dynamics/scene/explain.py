"""What a scene models, on which time scales, and what to expect of it before it runs."""

from __future__ import annotations

import itertools
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.summary import names as listed
from sphshell_pin.base.texts import counted
from sphshell_pin.contact.laws import HuntCrossleyLaw
from sphshell_pin.dynamics.scene.joint_components import WHICH, JointComponents
from sphshell_pin.dynamics.scene.models import beyond_limits, unit_warning
from sphshell_pin.dynamics.scene.sphere_arguments import corner_warning

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.pairs import ContactPair
    from sphshell_pin.dynamics.scene.scene import Scene


# Speed of approach where neither v nor a fall gives one [m/s].
DEFAULT_SPEED = 0.1
# Stands for the law of stops that are only listed.
_ANY_LAW = HuntCrossleyLaw(1.0, 1.0)
# Steps in the shortest time scale: enough for a few percent with fixed steps.
STEPS_PER_SCALE = 30
# Longest of the bristles' relaxation time [s].
LONGEST_RELAXATION = 2e-5


@dataclass(frozen=True)
class PairExplanation:
    """Time scales and depths of one pair; nan where the pair cannot move along the normal.

    `gap` [m] at q (negative in overlap; nan for a source that finds nothing at q);
    `effective_mass` [kg] along the normal; `approach_speed` [m/s] the figures below are for;
    `contact_time` [s] of an undamped impact at that speed, `impact_depth` [m] its largest depth;
    `resting_depth` [m] under the effective mass's own weight; `depth_limit_speed` [m/s] at which
    the depth would reach the radius; `shortest_time` [s] of all time scales, damping and friction
    included; `group` names the pairs that were stated together.
    """

    name: str
    modelled: tuple[str, ...]
    gap: float
    effective_mass: float
    approach_speed: float
    contact_time: float
    impact_depth: float
    resting_depth: float
    depth_limit_speed: float
    shortest_time: float
    group: str = ""


@dataclass(frozen=True, repr=False)
class Explanation:
    """The answer of Scene.explain; str() gives it as text."""

    modelled: tuple[str, ...]
    not_modelled: tuple[str, ...]
    pairs: tuple[PairExplanation, ...]
    recommended_dt: float
    warnings: tuple[str, ...] = field(default=())

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        """Return the explanation as text."""
        lines = ["Modeled:", *(f"  {line}" for line in self.modelled)]
        lines += ["Not modeled:", *(f"  {line}" for line in self.not_modelled)]
        for pair, others in _shown(self.pairs):
            alike = f", the nearest of {others + 1} of '{pair.group}'" if others else ""
            lines += [f"Contact '{pair.name}'{alike}:", *(f"  {line}" for line in pair.modelled)]
            for label, value, unit in (
                ("gap at q", pair.gap * 1e3, "mm"),
                ("effective mass along the normal", pair.effective_mass, "kg"),
                ("speed of approach", pair.approach_speed, "m/s"),
                ("contact time at that speed", pair.contact_time * 1e3, "ms"),
                ("depth at that speed", pair.impact_depth * 1e3, "mm"),
                ("resting depth under its own weight", pair.resting_depth * 1e3, "mm"),
                ("speed at which the depth reaches the radius", pair.depth_limit_speed, "m/s"),
            ):
                if math.isfinite(value):
                    lines.append(f"  {label}: {value:.4g} {unit}")
        lines.append(f"Recommended dt of a fixed step: {self.recommended_dt:.3g} s")
        lines += [f"Warning: {w}" for w in self.warnings]
        return "\n".join(lines)


def _shown(pairs: tuple[PairExplanation, ...]) -> Iterator[tuple[PairExplanation, int]]:
    """Yield the pairs as they are shown, of a group the nearest, with the number of its others."""
    for group, several in itertools.groupby(pairs, lambda pair: pair.group):
        members = list(several)
        if group:
            nearest = min(members, key=lambda pair: (math.isnan(pair.gap), pair.gap))
            yield nearest, len(members) - 1
        else:
            yield from ((pair, 0) for pair in members)


def explain_scene(scene: Scene, q: Array, v: Array, dt: float | None) -> Explanation:
    """Work out the explanation of `scene` at q (nq,), v (nv,), for a step of `dt` [s]."""
    model = scene.model
    scene._check_moved_mass()
    gravity = float(np.linalg.norm(model.gravity.linear))
    pairs = tuple(map(_with_curvature, scene.pairs, explain_pairs(scene, q, v)))
    warnings = beyond_limits(model, q)
    # The first of the pairs stated together speaks for those with the same warning.
    seen: dict[tuple[str, str], list[str]] = {}
    for pair, figures in zip(scene.pairs, pairs, strict=True):
        for warning in _warnings_of(scene, pair, figures):
            kind = (
                re.sub(r"[-+\d.]+", "", warning.replace(pair.name, "")) if pair.group else warning
            )
            seen.setdefault((pair.group, kind), []).append(warning)
    for (group, _), alike in seen.items():
        more = (
            f" (and {counted(len(alike) - 1, 'other')} of '{group}')" if group and alike[1:] else ""
        )
        warnings.append(f"{alike[0]}{more}")
    coarse = coarseness(scene, pairs, dt)
    if coarse is not None:
        warnings.append(coarse)
    free = sum(1 for j in model.joints[1:] if j.nv)
    modelled = [
        f"{counted(free, 'joint')} with {counted(model.nv, 'degree')} of freedom",
        f"gravity {gravity:.4g} m/s^2" if gravity else "no gravity",
        counted(len(pairs), "contact pair"),
    ]
    modelled += _joints_modelled(scene)
    absent = ["contact between other pairs of bodies", *_joints_stated(scene)]
    if scene.lock:
        absent.append(f"motion of the locked joints {', '.join(scene.lock)}")
    recommended = _recommended_dt(_shortest_scale(scene, pairs))
    return Explanation(tuple(modelled), tuple(absent), pairs, recommended, tuple(warnings))


def coarseness(scene: Scene, pairs: tuple[PairExplanation, ...], dt: float | None) -> str | None:
    """Say so where steps of `dt` [s] are longer than recommended; `pairs` are those of `scene`."""
    shortest = _shortest_scale(scene, pairs)
    recommended = _recommended_dt(shortest)
    if dt is None or dt <= 1.0001 * recommended or math.isinf(shortest):
        return None
    return (
        f"dt = {dt:.3g} s is larger than the recommended {recommended:.3g} s: the shortest "
        f"time scale {shortest:.3g} s would get {shortest / dt:.2g} steps"
    )


def _shortest_scale(scene: Scene, pairs: tuple[PairExplanation, ...]) -> float:
    """Return the shortest time scale [s] of pairs and joints, inf where there is none."""
    scales = [pair.shortest_time for pair in pairs if math.isfinite(pair.shortest_time)]
    return min([*scales, *scene.joints.time_scales(scene.model).values()], default=math.inf)


def _recommended_dt(shortest: float) -> float:
    if math.isinf(shortest):
        return 1e-3
    return _round_down(max(shortest / STEPS_PER_SCALE, sys.float_info.min))


# What a model may state of its joints, as a reader calls it.
_JOINT_KINDS = {
    "limits": "position limits",
    "damping": "damping",
    "friction": "dry friction",
    "armature": "armature",
    "effort": "effort limits",
    "speed": "speed limits",
}


def _joints_modelled(scene: Scene) -> list[str]:
    out = []
    for kind in scene.joints.kinds():
        names = list(getattr(scene.joints, kind))
        only = " (reported where they are exceeded)" if kind == "speed" else ""
        out.append(f"{_JOINT_KINDS[kind]} of {listed(names)}{only}")
    model = scene.model
    mimics = [str(model.names[j]) for j in model.mimicking_joints]
    if mimics:
        out.append(f"joints that mimic others, exactly: {listed(mimics)}")
    return out


def _joints_stated(scene: Scene) -> list[str]:
    """List what the model states of its joints and the scene leaves out."""
    # In ABA the model's armature acts anyhow.
    kinds = [one for one in WHICH if one != "armature"]
    stated = JointComponents.from_model(scene.model, kinds, _ANY_LAW)
    out = []
    for kind in stated.kinds():
        modelled = getattr(scene.joints, kind)
        left_out = [name for name in getattr(stated, kind) if name not in modelled]
        if left_out:
            out.append(f"{_JOINT_KINDS[kind]} that the robot's file states, of {listed(left_out)}")
    return out


def explain_pairs(
    scene: Scene, q: Array, v: Array, cores: list[_core.Pair] | None = None
) -> tuple[PairExplanation, ...]:
    """Work out the explanation of each pair at q (nq,), v (nv,); `cores`: its C++ pairs."""
    pairs = scene.pairs
    if not pairs:
        return ()
    model = scene.model
    gravity = math.hypot(*model.gravity.linear)
    touches = _core.touches_at(model, cores or [pair._bind() for pair in pairs], q, v)
    return tuple(
        _explain_pair(pair, gravity, *touch) for pair, touch in zip(pairs, touches, strict=True)
    )


def _with_curvature(pair: ContactPair, figures: PairExplanation) -> PairExplanation:
    """Say how far the curved elements of a pair, if it has any, stand off the flat ones."""
    said = [
        f"{label}: {text}"
        for one in pair.shells
        if one.is_smooth
        for label, text in one.shell.curvature_report().rows()
    ]
    return replace(figures, modelled=(*figures.modelled, *said))


def relaxation_time(pair: ContactPair, figures: PairExplanation) -> float:
    """Return the time [s] in which the bristles of a pair relax beyond their limit.

    A fiftieth of the shortest impact that the pair's law can stop (its depth would reach the
    radius): friction then follows a slip that turns round within an impact.
    """
    limit = figures.depth_limit_speed
    if not pair.spheres or not math.isfinite(limit):
        return LONGEST_RELAXATION
    shortest = pair.plane_law.contact_time(pair.least_radius, limit)
    return min(0.02 * shortest, LONGEST_RELAXATION)


def core_pairs(
    scene: Scene, q: Array, v: Array, *, explained: bool = False
) -> tuple[list[_core.Pair], tuple[PairExplanation, ...]]:
    """Build the C++ pairs of `scene` for a motion from q (nq,), v (nv,), with the explanation.

    That is left out, (), where neither bristles need it, which relax by it, nor it is asked for.
    """
    cores = [pair._bind() for pair in scene.pairs]
    if not explained and not has_state(scene):
        return cores, ()
    figures = explain_pairs(scene, q, v, cores)
    for pair, core, figure in zip(scene.pairs, cores, figures, strict=True):
        if _has_bristles(pair):
            core.relaxation = relaxation_time(pair, figure)
    return cores, figures


def has_state(scene: Scene) -> bool:
    """Whether a pair has bristles: only they need to know how fast an impact is."""
    return any(map(_has_bristles, scene.pairs))


def _has_bristles(pair: ContactPair) -> bool:
    return pair.friction is not None and pair.friction.has_state


def weakness(pair: ContactPair, figures: PairExplanation) -> str | None:
    """Say so where the law of a pair cannot stop the sphere."""
    if not figures.impact_depth >= pair.least_radius:
        return None
    return (
        f"contact '{pair.name}': at {figures.approach_speed:.3g} m/s the depth would reach the "
        "radius: the law cannot stop the sphere, make it stiffer"
    )


def _explain_pair(
    pair: ContactPair, gravity: float, gap: float, mass: float, slip_mass: float, closing: float
) -> PairExplanation:
    # Of what the core finds where a pair touches, or would: nan where there is nothing.
    speed = closing
    if math.isfinite(gap):
        speed = max(closing, math.sqrt(2 * gravity * max(gap, 0.0))) or DEFAULT_SPEED
    law = pair.plane_law
    weight = mass * gravity
    load = depth = contact_time = resting_depth = limit = math.nan
    times = []
    if math.isfinite(mass):
        load = max(weight, law.normal_force(-gap))
        depth = law.depth_of(0.5 * mass * speed**2)
        contact_time = law.contact_time(depth, speed)
        resting_depth = law.depth_at(weight)
        times.append(law.shortest_time(mass, speed, load))
        if pair.spheres:
            limit = math.sqrt(2 * law.energy(pair.least_radius) / mass)
    if pair.friction is not None and math.isfinite(slip_mass):
        times.append(pair.friction.slip_time(slip_mass, load, _disc(pair, max(depth, -gap))))
    return PairExplanation(
        name=pair.name,
        modelled=pair.modelled,
        gap=gap,
        effective_mass=mass,
        approach_speed=speed,
        contact_time=contact_time,
        impact_depth=depth,
        resting_depth=resting_depth,
        depth_limit_speed=limit,
        shortest_time=min(times, default=math.inf),
        group=pair.group,
    )


def _disc(pair: ContactPair, depth: float) -> float:
    """Return the radius [m] of the disc of contact at this depth, nan of a source."""
    curvature = sum(1 / one.radius for one in pair.spheres)
    return math.sqrt(depth / curvature) if curvature and depth > 0 else math.nan


def _warnings_of(scene: Scene, pair: ContactPair, figures: PairExplanation) -> list[str]:
    out: list[str] = []
    where = f"contact '{pair.name}'"
    radius = pair.least_radius
    for shell in (one.shell for one in pair.shells):
        sentence = unit_warning(scene.model, radius, shell.size) if pair.spheres else None
        out += [f"{where}: {sentence}"] if sentence else []
        out += [f"{where}: shell '{shell.name}': {problem}" for problem in shell.health.problems]
    corners = corner_warning(pair)
    out += [corners] if corners else []
    if not pair.spheres:
        return out
    weak = weakness(pair, figures)
    if weak is not None:
        out.append(weak)
    elif figures.resting_depth > 0.1 * radius:
        out.append(
            f"{where}: at rest the depth is {figures.resting_depth / radius:.0%} of the radius: "
            "the law is soft for this mass"
        )
    if figures.gap < -0.5 * radius:
        out.append(f"{where}: starts at depth {-figures.gap * 1e3:.4g} mm, deep inside")
    if not math.isfinite(figures.effective_mass):
        out.append(f"{where}: neither body can move along the normal at this q")
    out += [
        f"{where}: shell '{one.shell.name}' is open and one-sided: a sphere that goes round its "
        "rim is thrown out on the other side and gains energy"
        for one in pair.shells
        if one.shell.side != "both" and not one.shell.is_closed
    ]
    if pair.friction is not None and (creep := pair.friction.creep_speed) > radius:
        out.append(
            f"{where}: under half of what friction can hold, the sphere creeps at {creep:.2g} m/s, "
            "more than its radius per second: a smaller v_static, or BristleFriction, which sticks"
        )
    if any(one.method == "elements" for one in pair.shells):
        out.append(f"{where}: method 'elements' counts a place of touch once per touched element")
    return out


def _round_down(x: float) -> float:
    """Round to the next lower 1, 2 or 5 times a power of ten."""
    scale = 10.0 ** math.floor(math.log10(x))
    return max(f for f in (1, 2, 5, 10) if f * scale <= x * (1 + 1e-12)) * scale
