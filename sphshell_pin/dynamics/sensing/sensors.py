"""Sensors: what a robot's computer knows of its forces, sampled, filtered, noisy and late."""

import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_name, check_type
from sphshell_pin.base.parameters import Component, flat_fields, parameter
from sphshell_pin.dynamics.scene.joint_components import joint_slides
from sphshell_pin.dynamics.scene.models import find_frame, find_joint
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.scene.scene_contacts import Columns
from sphshell_pin.dynamics.sensing.sensor_log import Readings, SensorLog, split_logs
from sphshell_pin.dynamics.sensing.subtree_inertia import frames_of_subtree, subtree_of
from sphshell_pin.errors import InvalidParameter

__all__ = ["ContactSwitch", "ForceTorqueSensor", "JointTorqueSensor"]

_FASTEST = 1e6  # [Hz]


@dataclass(frozen=True, kw_only=True)
class Sensor(Component):
    """Base of the sensors of a simulation.

    The reading k is taken at the start of the run plus k / `rate` and arrives `delay` later.

    Parameters
    ----------
    name : of the sensor in results and for controllers
    rate : readings in a second
    delay : from taking a reading to its arrival at the controller
    """

    name: str = parameter()
    rate: float = parameter(1000.0, above=0, at_most=_FASTEST, unit="Hz")
    delay: float = parameter(0.0, at_least=0, unit="s")

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value of a wrong type or outside its bounds."""
        super().__post_init__()
        check_name("name", self.name)

    def columns(self, scene: Scene) -> tuple[str, ...]:
        """Return the names of the values of a reading, with their units."""
        raise NotImplementedError

    def _bind(self, scene: Scene) -> _core.Sensor:
        """Build the C++ binding for `scene`.

        Raises FrameNotFound, NameNotFound and InvalidParameter for what the scene does not have.
        """
        core = _core.Sensor(self.kind, flat_fields(self._measured(scene)))
        core.rate, core.delay = self.rate, self.delay
        return core

    def _measured(self, scene: Scene) -> dict[str, ArrayLike]:
        """Return what the C++ class of this kind is made of, by name."""
        raise NotImplementedError

    def reading(self, values: Array) -> Array | float | bool:
        """Return a reading as a controller gets it."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class _Analog(Sensor):
    """A signal, filtered before it is sampled, with noise and a range.

    Parameters
    ----------
    cutoff : of the first-order low-pass filter before the sampling; none by default
    seed : of the noise; other names have other noise
    """

    cutoff: float | None = parameter(None, above=0, at_most=_FASTEST, unit="Hz")
    seed: int = parameter(0)

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value of a wrong type or outside its bounds."""
        super().__post_init__()
        check_type("seed", self.seed, int, "must be a whole number")

    def _bind(self, scene: Scene) -> _core.Sensor:
        core = super()._bind(scene)
        core.cutoff = self.cutoff or 0.0
        core.range = [math.inf if most is None else most for most, _ in self._spread()]
        core.noise = [noise for _, noise in self._spread()]
        digest = hashlib.sha256(f"{self.seed} {self.name}".encode()).digest()
        core.seed = int.from_bytes(digest[:8], "little")
        return core

    def _spread(self) -> list[tuple[float | None, float]]:
        """Return the range and the noise of each value."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class ForceTorqueSensor(_Analog, kind="force-torque"):
    """The wrench that the parts before `frame` exert on those beyond it.

    It is stated in the frame, about its origin. Beyond the frame of a link is the link with all
    that is attached to it, beyond that of a joint the joint's link; their weight, their inertia and
    their contacts are included. A tool at rest that nothing touches reads its weight, upwards; a
    tip pressed on a surface reads the opposite of what the surface exerts on it, less the tool's
    weight.

    Parameters
    ----------
    frame : the link or joint beyond which it measures
    force_range : largest force along each axis
    torque_range : largest torque about each axis
    force_noise : standard deviation of each force reading
    torque_noise : standard deviation of each torque reading
    """

    frame: str = parameter()
    force_range: float | None = parameter(None, above=0, unit="N")
    torque_range: float | None = parameter(None, above=0, unit="N m")
    force_noise: float = parameter(0.0, at_least=0, unit="N")
    torque_noise: float = parameter(0.0, at_least=0, unit="N m")

    def columns(self, scene: Scene) -> tuple[str, ...]:
        """Return the names of the values of a reading, with their units."""
        parts = (("force", "N"), ("torque", "N m"))
        return tuple(f"{part}_{axis} [{unit}]" for part, unit in parts for axis in "xyz")

    def _measured(self, scene: Scene) -> dict[str, ArrayLike]:
        part = subtree_of(scene, self.frame)
        pairs_i, pairs_j = (
            [
                k
                for k, pair in enumerate(scene.pairs)
                if find_frame(scene.model, pair.core_sides[side].frame) in part.frames
            ]
            for side in (0, 1)
        )
        if not (part.inertia.mass > 0 or part.children or pairs_i or pairs_j):
            raise InvalidParameter(
                "frame",
                self.frame,
                "has nothing beyond it: no mass, no joint and no contact, so that it would always "
                "read zero",
            )
        return {
            "joint": part.joint,
            "frame": part.placement.homogeneous,
            "inertia": part.inertia.toDynamicParameters(),
            "children": list(part.children),
            "pairs_i": pairs_i,
            "pairs_j": pairs_j,
            "frames": sorted(part.frames),
        }

    def _spread(self) -> list[tuple[float | None, float]]:
        force = self.force_range, self.force_noise
        return [*3 * [force], *3 * [(self.torque_range, self.torque_noise)]]

    def reading(self, values: Array) -> Array:
        """Return the force [N] and the torque [N m] (6,)."""
        return values


@dataclass(frozen=True, kw_only=True)
class JointTorqueSensor(_Analog, kind="joint-torque"):
    """The torque that a joint transmits to the link that it moves, positive along its velocity.

    It is the controller's torque with what stops, friction and damping of the joint add, less what
    the rotor's inertia (the model's armature) takes. A sliding joint has a force [N]. Where other
    joints follow this one, what they transmit counts as seen from it.

    Parameters
    ----------
    joint : a joint with one degree of freedom
    range : largest torque
    noise : standard deviation of each reading
    """

    joint: str = parameter()
    range: float | None = parameter(None, above=0, unit="N m")
    noise: float = parameter(0.0, at_least=0, unit="N m")

    def columns(self, scene: Scene) -> tuple[str, ...]:
        """Return the names of the values of a reading, with their units."""
        slides = joint_slides(find_joint(scene.model, self.joint))
        return ("force [N]" if slides else "torque [N m]",)

    def _measured(self, scene: Scene) -> dict[str, ArrayLike]:
        check_name("joint", self.joint)
        joint = find_joint(scene.model, self.joint)
        if joint.nv != 1:
            raise InvalidParameter(
                "joint",
                self.joint,
                f"must have one degree of freedom, this has {joint.nv}"
                + (": it follows another joint, measure that one" if joint.nv == 0 else ""),
            )
        return {"index": joint.idx_v}

    def _spread(self) -> list[tuple[float | None, float]]:
        return [(self.range, self.noise)]

    def reading(self, values: Array) -> float:
        """Return the torque [N m], or force [N]."""
        return float(values[0])


@dataclass(frozen=True, kw_only=True)
class ContactSwitch(Sensor, kind="contact-switch"):
    """Whether the normal forces of a contact, or of all on a link, sum to more than a threshold.

    It closes above `threshold` and opens below `release`, by default the same.

    Parameters
    ----------
    contact : name of the contact
    frame : or the link whose contacts it feels
    threshold : closes above this force
    release : opens below this force
    """

    contact: str | None = parameter(None)
    frame: str | None = parameter(None)
    threshold: float = parameter(at_least=0, unit="N")
    release: float | None = parameter(None, at_least=0, unit="N")

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless there is one of contact and frame, and release fits."""
        super().__post_init__()
        if (self.contact is None) == (self.frame is None):
            raise InvalidParameter(
                "contact, frame",
                (self.contact, self.frame),
                "must be one of the two: the name of a contact, or a link",
            )
        if self.release is not None and self.release > self.threshold:
            raise InvalidParameter(
                "release", self.release, f"must not be above threshold = {self.threshold:g} [N]"
            )

    def columns(self, scene: Scene) -> tuple[str, ...]:
        """Return the names of the values of a reading, with their units."""
        return ("closed",)

    def _measured(self, scene: Scene) -> dict[str, ArrayLike]:
        if self.contact is not None:
            # A name may be that of several pairs that were stated together.
            names = [{pair.name, pair.group} for pair in scene.pairs]
            pairs = [k for k, known in enumerate(names) if self.contact in known]
            if not pairs:
                scene.pair(self.contact)
        else:
            assert self.frame is not None
            frames = self._frames(scene, self.frame)
            pairs = [
                k
                for k, pair in enumerate(scene.pairs)
                if {find_frame(scene.model, f) for f in (pair.frame_i, pair.frame_j)} & frames
            ]
            if not pairs:
                raise InvalidParameter(
                    "frame", self.frame, "has no contact on it or on what is fixed to it"
                )
        release = self.threshold if self.release is None else self.release
        return {"pairs": pairs, "threshold": self.threshold, "release": release}

    @staticmethod
    def _frames(scene: Scene, name: str) -> frozenset[int]:
        if scene.model.frames[find_frame(scene.model, name)].type == pin.FrameType.OP_FRAME:
            return frozenset(frames_of_subtree(scene.model, name))
        return subtree_of(scene, name).frames

    def reading(self, values: Array) -> bool:
        """Return whether it is closed."""
        return bool(values[0])


class SensorSet:
    """The sensors of a simulation, bound to the scene of a run.

    Raises what `Sensor._bind` raises; the text names the sensor.
    """

    def __init__(self, sensors: tuple[Sensor, ...], scene: Scene) -> None:
        self.sensors = sensors
        self.core = [sensor._bind(scene) for sensor in sensors]
        self._columns = [sensor.columns(scene) for sensor in sensors]
        widths = [len(one) for one in self._columns]
        self._spans = [
            slice(end - width, end) for end, width in zip(accumulate(widths), widths, strict=True)
        ]

    def readings(self, memory: bytes | bytearray) -> Readings:
        """Return the latest readings by name from the core's memory of them."""
        values = np.frombuffer(memory)
        return Readings(
            (one.name, one.reading(values[span]))
            for one, span in zip(self.sensors, self._spans, strict=True)
        )

    def logs(self, record: Columns) -> dict[str, SensorLog]:
        """Return what the core has recorded of each sensor."""
        names = [one.name for one in self.sensors]
        parts = [record[f"sensor{part}"] for part in ("", "_t", "_sampled", "_values")]
        return split_logs(dict(zip(names, self._columns, strict=True)), *parts)


def check_sensors(sensors: Iterable[object]) -> tuple[Sensor, ...]:
    """Return the sensors as a tuple; raise InvalidParameter for others and for equal names."""
    if isinstance(sensors, Sensor):
        raise InvalidParameter("sensors", sensors, "must be a list of sensors: write [...]")
    try:
        given = list(sensors)
    except TypeError:
        raise InvalidParameter("sensors", sensors, "must be a list of sensors") from None
    found: dict[str, Sensor] = {}
    must = "must be a sensor, as ForceTorqueSensor(name, frame)"
    for k, sensor in enumerate(given):
        one = check_type(f"sensors[{k}]", sensor, Sensor, must)
        if one.name in found:
            raise InvalidParameter(f"sensors[{k}].name", one.name, "is taken by another sensor")
        found[one.name] = one
    return tuple(found.values())
