"""What a scene models in the joints: stops, damping, dry friction, armature, limits of motors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TypeVar

import numpy as np
import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.base import checks
from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.laws import HuntCrossleyLaw
from sphshell_pin.contact.normal_law import NormalLaw, check_law
from sphshell_pin.dynamics.scene.models import find_joint, mass_matrix
from sphshell_pin.errors import InvalidParameter, NameNotFound

T = TypeVar("T")
# One number for all velocities of a joint, or one for each.
Numbers = float | Sequence[float]

WHICH = ("limits", "damping", "friction", "armature", "effort", "speed")
"""What `JointComponents.from_model` takes from a model."""

# No limit is stated by infinity, or by the largest float.
_NO_LIMIT = 1e300
# How far a stop gives way at the joint's highest speed, and a spring of dry friction before it
# slides: [rad], or of a prismatic joint [m].
_STOP_DEPTH, _STICK_DEPTH = (0.01, 0.001), (1e-3, 1e-4)
# The default stop: the share of the speed that is left after an impact at the highest speed.
_RESTITUTION = 0.5
# Speed of a joint whose file states none [rad/s], [m/s].
_SPEED = (1.0, 0.1)
# Damping of the springs of dry friction, as a share of the critical one.
_STICK_DAMPING = 0.7
# Coordinates of these joints are the integrals of their velocities.
_PLAIN = ("JointModelR", "JointModelP", "JointModelH", "JointModelTranslation")


@dataclass(frozen=True)
class JointLimits:
    """The range of a joint, with the law of the stops at both ends.

    `lower` and `upper` [rad or m], infinite where there is no stop; `law` gives the torque [N m] or
    force [N] that pushes back at a depth [rad or m] beyond an end. It is a normal law as of
    contacts, with generalized units: a stiffness in N m/rad^e, a damping in N m s/rad.
    """

    lower: Numbers
    upper: Numbers
    law: NormalLaw

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a law that is none, and for an empty range."""
        check_law(self.law, "at a joint's stop")
        try:
            right = bool(np.all(checks.as_floats(self.lower) < checks.as_floats(self.upper)))
        except (TypeError, ValueError, OverflowError):
            right = False
        if not right:
            raise InvalidParameter(
                "lower, upper", (self.lower, self.upper), "must be a range: lower below upper"
            )


@dataclass(frozen=True)
class JointFriction:
    """Dry friction of a joint: an elastic, perfectly plastic spring, which sticks without creep.

    Up to `torque` [N m or N] the joint is held by a spring of `stiffness` [N m/rad or N/m] with
    `damping` [N m s/rad or N s/m]; beyond it slides. By default the spring gives way by 1 mrad
    (0.1 mm) before the joint slides, and its damping is 0.7 of critical with the joint's inertia in
    the neutral posture. `relaxation` [s] is the time in which the spring follows a motion that has
    turned round (see BristleFriction).
    """

    torque: float
    stiffness: float | None = None
    damping: float | None = None
    relaxation: float = 1e-3

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless the numbers are positive; damping may be zero."""
        checks.check_positive("torque", self.torque, "N m or N")
        if self.stiffness is not None:
            checks.check_positive("stiffness", self.stiffness, "N m/rad or N/m")
        if self.damping is not None:
            checks.check_not_negative("damping", self.damping, "N m s/rad or N s/m")
        checks.check_positive("relaxation", self.relaxation, "s")


@dataclass(frozen=True)
class JointComponents:
    """What a scene models in its joints, by joint name; nothing where a joint is not named.

    `limits`: stops; `damping` [N m s/rad or N s/m]: viscous; `friction`: dry; `armature` [kg m^2 or
    kg]: inertia of the rotor behind its gear, in place of that of the model; `effort` [N m or N]:
    what a controller may ask of the motor, (lower, upper) or the same both ways: beyond it torques
    are cut; `speed` [rad/s or m/s]: reported where it is exceeded. Numbers may be sequences, one
    for each velocity of the joint.
    """

    limits: Mapping[str, JointLimits] = field(default_factory=dict)
    damping: Mapping[str, Numbers] = field(default_factory=dict)
    friction: Mapping[str, JointFriction] = field(default_factory=dict)
    armature: Mapping[str, Numbers] = field(default_factory=dict)
    effort: Mapping[str, float | tuple[float, float]] = field(default_factory=dict)
    speed: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raise InvalidParameter for what is no mapping from names, or has a wrong type."""
        for one in fields(self):
            values = checks.check_type(
                one.name, getattr(self, one.name), Mapping, "must map joint names"
            )
            object.__setattr__(self, one.name, dict(values))
        for name, limits in self.limits.items():
            checks.check_type(f"limits.{name}", limits, JointLimits, "must be JointLimits")
        for name, friction in self.friction.items():
            checks.check_type(
                f"friction.{name}", friction, JointFriction, "must be a JointFriction"
            )

    @classmethod
    def from_model(
        cls, model: pin.Model, which: Iterable[str] = WHICH, law: NormalLaw | None = None
    ) -> JointComponents:
        """Return what `model` states, of `which` kinds (default: all of WHICH).

        Pinocchio reads URDF's `<limit>` and `<dynamics>`, MJCF's range, damping, frictionloss,
        armature and actuatorfrcrange; zero efforts, speeds and empty ranges count as not stated,
        rotorInertia rotorGearRatio^2 as the armature where there is none. The stops have the law
        `law`, by default one that gives way by 0.01 rad (1 mm) at the joint's highest speed (1
        rad/s, 0.1 m/s where none is stated), also holds the highest effort there, and throws the
        joint back at half that speed. NameNotFound for another kind.
        """
        wanted = tuple(which)
        for one in wanted:
            if one not in WHICH:
                raise NameNotFound("kind", one, "JointComponents.from_model", WHICH)
        found: dict[str, dict[str, object]] = {one: {} for one in WHICH}
        inertia = joint_inertia(model) if "limits" in wanted and law is None else None
        for name, joint in list(zip(model.names, model.joints, strict=True))[1:]:
            if not joint.nv:
                continue
            at = slice(joint.idx_v, joint.idx_v + joint.nv)
            speed = _stated(model.upperVelocityLimit[at])
            effort = _stated(np.maximum(model.upperEffortLimit[at], -model.lowerEffortLimit[at]))
            dry = np.maximum(model.upperDryFrictionLimit[at], -model.lowerDryFrictionLimit[at])
            damping, armature = model.damping[at], np.array(model.armature[at])
            if not armature.any():
                armature = model.rotorInertia[at] * model.rotorGearRatio[at] ** 2
            if joint.nv == 1:
                if speed is not None:
                    found["speed"][name] = float(speed[0])
                if effort is not None:
                    lower, high = float(model.lowerEffortLimit[at][0]), float(effort[0])
                    upper = float(model.upperEffortLimit[at][0])
                    even = lower >= 0 or not 0 < upper < _NO_LIMIT or -lower == upper
                    found["effort"][name] = high if even else (lower, upper)
                if 0 < float(dry[0]) < _NO_LIMIT:
                    found["friction"][name] = JointFriction(float(dry[0]))
            for kind, values in (("damping", damping), ("armature", armature)):
                if np.all(np.isfinite(values)) and np.any(values > 0):
                    found[kind][name] = _short(values)
            ends = _range(model, joint)
            if ends is not None and "limits" in wanted:
                given = law
                if inertia is not None:
                    slides = joint_slides(joint)
                    highest = _SPEED[slides] if speed is None else float(speed.max())
                    load = 0.0 if effort is None else float(effort.max())
                    given = _default_stop(float(inertia[at].max()), highest, load, slides)
                assert given is not None
                found["limits"][name] = JointLimits(_short(ends[0]), _short(ends[1]), given)
        return cls(**{one: found[one] for one in wanted})  # type: ignore[arg-type]  # each its own

    def replaced(self, joint: str, **changes: object) -> JointComponents:
        """Return these with other values of one joint; None takes one away.

        replaced("elbow", friction=JointFriction(0.2), speed=None)
        """
        unknown = set(changes) - set(WHICH)
        if unknown:
            raise NameNotFound("kind", unknown.pop(), "a joint", WHICH)
        parts = {}
        for one, value in changes.items():
            others = {k: v for k, v in getattr(self, one).items() if k != joint}
            parts[one] = others if value is None else {**others, joint: value}
        return replace(self, **parts)

    def kinds(self) -> tuple[str, ...]:
        """Those of WHICH that some joint has."""
        return tuple(one for one in WHICH if getattr(self, one))

    def without(self, joints: Iterable[str]) -> JointComponents:
        """Return these without what they say of `joints`."""
        left_out = set(joints)
        parts = {
            one: {k: v for k, v in getattr(self, one).items() if k not in left_out} for one in WHICH
        }
        return replace(self, **parts)

    def stopped_joints(self, model: pin.Model) -> tuple[str, ...]:
        """Return the joint of each stop, in the order in which the compiled core numbers them."""
        return tuple(name for name, *_ in self._stops(model))

    def alike(self, other: JointComponents, model: pin.Model) -> bool:
        """Whether both model the same in the same joints of `model`, if with other numbers."""
        same = all(list(getattr(self, one)) == list(getattr(other, one)) for one in WHICH)
        return same and self.stopped_joints(model) == other.stopped_joints(model)

    def _bind(self, model: pin.Model) -> _core.JointEffects | None:
        """Build the C++ binding for `model`; None where nothing is modelled but armature.

        NameNotFound lists the joints; InvalidParameter names a joint that cannot have what is said.
        """
        if not set(self.kinds()) - {"armature"}:
            return None
        lower, upper = self._efforts(model)
        core = _core.JointEffects(
            self._each(model, "damping", 0.0), lower, upper, self._each(model, "speed", math.inf)
        )
        for _, in_q, in_v, end, sign, law in self._stops(model):
            core.add_stop(in_q, in_v, end, sign, law._binding)
        for dry in self.springs(model):
            core.add_friction(dry.index, dry.torque, dry.stiffness, dry.damping, dry.relaxation)
        return core

    def with_armature(self, model: pin.Model) -> pin.Model:
        """Return `model`, or a copy with the armature that is said here."""
        if not self.armature:
            return model
        changed = pin.Model(model)
        changed.armature = self._each(model, "armature", None, np.array(model.armature))
        return changed

    def springs(self, model: pin.Model) -> list[Spring]:
        """Return the springs of dry friction, with what follows from the inertia of the joints."""
        if not self.friction:
            return []
        inertia, out = joint_inertia(model), []
        for name, dry in self.friction.items():
            joint = find_joint(model, name)
            if joint.nv != 1:
                raise InvalidParameter(
                    f"friction.{name}", dry, f"needs a joint with one velocity, not {joint.nv}"
                )
            stiffness = dry.stiffness or dry.torque / _STICK_DEPTH[joint_slides(joint)]
            damping = dry.damping
            if damping is None:
                critical = 2 * math.sqrt(stiffness * float(inertia[joint.idx_v]))
                damping = _STICK_DAMPING * critical
            out.append(Spring(joint.idx_v, dry.torque, stiffness, damping, dry.relaxation))
        return out

    def time_scales(self, model: pin.Model) -> dict[str, float]:
        """Return the shortest time [s] of each joint's stops and springs: half a period."""
        if not (self.limits or self.friction):
            return {}
        inertia, out = joint_inertia(model), dict[str, float]()
        names = {joint.idx_v: name for name, joint in moving_joints(model)}
        for dry in self.springs(model):
            out[names[dry.index]] = math.pi * math.sqrt(float(inertia[dry.index]) / dry.stiffness)
        for name, _, in_v, *_, law in self._stops(model):
            mass, joint = float(inertia[in_v]), find_joint(model, name)
            speed = float(self.speed.get(name, _SPEED[joint_slides(joint)]))
            time = law.contact_time(law.depth_of(0.5 * mass * speed**2), speed)
            out[name] = min(time, out.get(name, math.inf))
        return out

    def _stops(self, model: pin.Model) -> list[tuple[str, int, int, float, float, NormalLaw]]:
        """Return joint, index in q and in v, end, sign and law of each stop."""
        out = []
        for name, limits in self.limits.items():
            joint = find_joint(model, name)
            if not _plain(joint):
                raise InvalidParameter(
                    f"limits.{name}",
                    joint.shortname(),
                    "is a joint without a range: its coordinates are no lengths or angles that "
                    "its velocities are the rates of",
                )
            for sign, ends in ((-1.0, limits.lower), (1.0, limits.upper)):
                each = _per_velocity(f"limits.{name}", ends, joint.nv)
                out += [
                    (name, joint.idx_q + k, joint.idx_v + k, float(end), sign, limits.law)
                    for k, end in enumerate(each)
                    if abs(end) < _NO_LIMIT
                ]
        return out

    def _each(
        self, model: pin.Model, kind: str, absent: float | None, start: Array | None = None
    ) -> Array:
        """Return the numbers of one kind as (nv,); (0,) where no joint has any."""
        values: Mapping[str, Numbers] = getattr(self, kind)
        if not values:
            return np.zeros(0)
        each = np.full(model.nv, absent) if start is None else start
        for name, value in values.items():
            joint = find_joint(model, name)
            numbers = _per_velocity(f"{kind}.{name}", value, joint.nv)
            for number in numbers:
                checks.check_not_negative(f"{kind}.{name}", number)
            each[joint.idx_v : joint.idx_v + joint.nv] = numbers
        return each

    def _efforts(self, model: pin.Model) -> tuple[Array, Array]:
        if not self.effort:
            return np.zeros(0), np.zeros(0)
        lower, upper = np.full(model.nv, -math.inf), np.full(model.nv, math.inf)
        for name, value in self.effort.items():
            joint = find_joint(model, name)
            at = slice(joint.idx_v, joint.idx_v + joint.nv)
            if isinstance(value, Sequence):
                low, high = checks.check_vector(f"effort.{name}", value, 2, ": lower and upper")
            else:
                high = checks.check_not_negative(f"effort.{name}", value, "N m or N")
                low = -high
            if not low <= 0 <= high:
                raise InvalidParameter(
                    f"effort.{name}", value, "must allow no torque: lower <= 0 <= upper"
                )
            lower[at], upper[at] = low, high
        return lower, upper


@dataclass(frozen=True)
class Spring:
    """Dry friction of one velocity, with all numbers; `index` is that in v (nv,)."""

    index: int
    torque: float
    stiffness: float
    damping: float
    relaxation: float


def joint_inertia(model: pin.Model) -> Array:
    """Return the inertia (nv,) [kg m^2 or kg] that each joint moves in the neutral posture."""
    return np.maximum(np.diag(mass_matrix(model, pin.neutral(model))), 1e-12)


def check_joints(joints: object, model: pin.Model, lock: Iterable[str]) -> JointComponents:
    """Return `joints` (None: nothing) for a scene of `model` in which `lock` are held.

    NameNotFound and InvalidParameter as of JointComponents._bind.
    """
    if joints is None:
        return JointComponents()
    given = checks.check_type(
        "joints",
        joints,
        JointComponents,
        "must be JointComponents: JointComponents.from_model(model)",
    )
    kept = given.without(lock)
    kept._bind(model)
    kept.with_armature(model)
    return kept


def moving_joints(model: pin.Model) -> list[tuple[str, pin.JointModel]]:
    """Return the joints that have velocities of their own, in the order of these velocities."""
    joints = zip(list(model.names)[1:], list(model.joints)[1:], strict=True)  # 0 is the universe
    return [(name, joint) for name, joint in joints if joint.nv]


def _plain(joint: pin.JointModel) -> bool:
    kind = joint.shortname()
    if kind == "JointModelComposite":
        return all(_plain(part) for part in joint.extract().joints)
    return bool(joint.nq == joint.nv and kind.startswith(_PLAIN))


def joint_slides(joint: pin.JointModel) -> bool:
    """Whether the joint's numbers are lengths, not angles."""
    kind = joint.shortname()
    return bool(kind.startswith(("JointModelP", "JointModelTranslation")))


def _range(model: pin.Model, joint: pin.JointModel) -> tuple[Array, Array] | None:
    """Return the ends of a joint's range, infinite where there are none; None without a range."""
    if not _plain(joint):
        return None
    at = slice(joint.idx_q, joint.idx_q + joint.nq)
    lower, upper = np.array(model.lowerPositionLimit[at]), np.array(model.upperPositionLimit[at])
    lower[lower < -_NO_LIMIT], upper[upper > _NO_LIMIT] = -math.inf, math.inf
    stated = np.isfinite(lower).any() or np.isfinite(upper).any()
    return (lower, upper) if stated and np.all(lower < upper) else None


def _default_stop(inertia: float, speed: float, load: float, slides: bool) -> HuntCrossleyLaw:
    """Return the law of a stop whose joint has this inertia, highest speed and effort."""
    depth = _STOP_DEPTH[slides]
    stiffness = max(inertia * (speed / depth) ** 2, load / depth)
    return HuntCrossleyLaw.with_restitution(stiffness, 1.0, _RESTITUTION, speed)


def _stated(values: Array) -> Array | None:
    """Return positive limits, of which all are stated; else None."""
    return values if np.all((values > 0) & (values < _NO_LIMIT)) else None


def _short(values: Array) -> Numbers:
    return float(values[0]) if len(values) == 1 else tuple(float(one) for one in values)


def _per_velocity(name: str, value: Numbers, count: int) -> Array:
    each = np.asarray(value, dtype=float)
    if each.ndim == 0:
        return np.full(count, float(each))
    if each.shape != (count,):
        raise InvalidParameter(name, value, f"must be one number or {count}")
    return each
