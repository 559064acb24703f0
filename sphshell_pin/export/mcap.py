"""A result as an MCAP file of ROS 2 messages; the page docs/export.md lists the topics."""

import contextlib
import heapq
import json
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields
from importlib import metadata
from os import PathLike
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.base.checks import check_type
from sphshell_pin.base.tables import quantity_of
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import PairSeries
from sphshell_pin.dynamics.result.result_scene import check_scene, scene_of, sound_rows
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.scene.scene_contacts import SceneContacts
from sphshell_pin.dynamics.sensing.sensor_log import SensorLog
from sphshell_pin.errors import ResultError, import_extra
from sphshell_pin.export.frames import WORLD, Frames, Message, free_name, quaternion, xyz
from sphshell_pin.export.markers import (
    ROD,
    body_markers,
    contact_markers,
    least_radius,
    shell_markers,
    stamp_of,
)
from sphshell_pin.export.messages import full_name, schema_of
from sphshell_pin.view.arrows import ArrowScale, largest_force

_ARROW = 8.0  # length of a usual force's arrow, in radii of the smallest sphere
_INFO, _WARN = 20, 30  # of rcl_interfaces/Log
_ONCE = ("/tf_static", "/shells", "/bodies")
_USUAL = ("touch", "lift_off")
_LAST = (1 << 31) * 10**9  # ROS 2 has the seconds in 31 bits

# As rosbag2 writes it: `ros2 bag play` offers the last message to those who come later, too.
_FOREVER = "    sec: 9223372036\n    nsec: 854775807\n"
_LATCHED = (
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"
    f"  deadline:\n{_FOREVER}  lifespan:\n{_FOREVER}"
    f"  liveliness: 1\n  liveliness_lease_duration:\n{_FOREVER}"
    "  avoid_ros_namespace_conventions: false\n"
)


_Sent = tuple[int, int, str, str, Message]
"""Times at which a message is logged and published [ns], topic, type, content."""
_Part = tuple[str, str, Message]


def write_mcap(
    path: str | PathLike[str],
    result: Result,
    scene: Scene | None = None,
    *,
    start: int = 0,
    command: str = "",
    progress: Callable[[float], object] | None = None,
) -> Path:
    """Write `result` as an MCAP file; see `Result.to_mcap`.

    `command` goes into its metadata; `progress` gets the share that is done.
    """
    mcap = import_extra("mcap_ros2.writer", "mcap", "Result.to_mcap", "mcap-ros2-support")
    scene = scene_of(result, scene)
    check_scene(result, scene, "the result")
    run = _Run(result, scene, start)
    path = Path(path)
    try:
        with atomic_file(path) as stream, mcap.Writer(stream) as writer:
            writer.add_metadata("sphshell_pin", run.about(command))
            if result.origin is not None:
                data = json.dumps(result.origin.settings, indent=1).encode()
                writer.add_attachment(run.first, run.first, "settings.json", "text/json", data)
            schemas = {}
            counts: dict[str, int] = {}
            for logged, published, topic, kind, message in run.messages():
                if kind not in schemas:
                    schemas[kind] = writer.register_msgdef(full_name(kind), schema_of(kind))
                # A channel has metadata only if it is registered by MCAP's own writer.
                if topic in _ONCE:
                    about = {"offered_qos_profiles": _LATCHED}
                    writer._channel_ids[topic] = writer._writer.register_channel(
                        topic, "cdr", schemas[kind].id, about
                    )
                counts[topic] = counts.get(topic, -1) + 1
                writer.write_message(
                    topic, schemas[kind], message, logged, published, counts[topic]
                )
                if progress is not None and topic == "/tf":
                    progress(counts[topic] / run.count)
    except OSError as error:
        raise ResultError(path, f"cannot be written: {error.strerror or error}") from error
    return path


class _Run:
    """A result in its scene, as messages in the order of time."""

    def __init__(self, result: Result, scene: Scene, start: int) -> None:
        check_type("start", start, int, "must be a whole number of nanoseconds since 1970")
        self.result, self.scene, self.start = result, scene, start
        # A run that diverged is written up to where its numbers end.
        self.count = sound_rows("the result", result.q, result.v)
        self.times = _nanoseconds(result.t[: self.count], start).tolist()
        self.first = self.times[0]
        self.stated = _stated_frames(result, scene)
        self.frames = Frames.of(scene, self.stated.values())
        touched = sorted({int(k) for k in result.contacts.pair})
        self.series = {k: PairSeries.of(result, k) for k in touched}
        self.least = least_radius(scene)
        self.scale = ArrowScale.from_forces(largest_force(result.contacts), _ARROW * self.least)
        self.topics = _topics("contacts", [result.pairs[k] for k in touched], ["markers"])
        self.sensors = _topics("sensors", result.sensors)
        self.twists = _topics("twists", [name for name, _ in self.frames.moving.values()])

    def about(self, command: str) -> dict[str, str]:
        """Return what the file says of itself."""
        result, stats = self.result, self.result.stats
        said = {}
        for name in ("sphshell-pin", "pin", "coal", "numpy", "mcap"):
            with contextlib.suppress(metadata.PackageNotFoundError):
                said[f"version.{name}"] = metadata.version(name)
        said |= {
            "scenario": "" if result.origin is None else result.origin.scenario,
            "command": command,
            "start [ns]": str(self.start),
            "integrator": stats.integrator,
            "dt [s]": repr(stats.dt),
            "arrows [m/N]": repr(self.scale.meters_per_newton),
            "longest arrow [m]": repr(self.scale.longest),
        }
        said |= {f"contact {name}": topic for name, topic in self.topics.items()}
        return {name: text for name, text in said.items() if text}

    def messages(self) -> Iterator[_Sent]:
        """Yield all messages in the order of their times."""
        t = self.first
        static = [_transform(t, parent, name, at) for name, parent, at in self.frames.fixed]
        for topic, kind, message in (
            ("/tf_static", _TRANSFORMS, {"transforms": static}),
            ("/shells", _MARKERS, shell_markers(self.scene, self.frames, t)),
            ("/bodies", _MARKERS, body_markers(self.scene, self.frames, t)),
        ):
            yield t, t, topic, kind, message
        sensors = (self._readings(name, log) for name, log in self.result.sensors.items())
        yield from heapq.merge(self._rows(), self._events(), *sensors, key=lambda one: one[0])

    def _rows(self) -> Iterator[_Sent]:
        data = self.scene.model.createData()
        energy = {f.name: getattr(self.result.energy, f.name) for f in fields(self.result.energy)}
        energy["residual"] = self.result.energy.residual
        drawn = False
        for row, t in enumerate(self.times):
            contacts = self.result.contacts.at_row(row)
            pin.forwardKinematics(self.scene.model, data, self.result.q[row], self.result.v[row])
            moved = [
                _transform(t, WORLD, name, data.oMi[joint] * placed)
                for joint, (name, placed) in self.frames.moving.items()
            ]
            parts: list[_Part] = []
            for k in self.series:
                parts += self._pair(k, row, contacts, data, moved)
            if moved:
                parts.append(("/tf", _TRANSFORMS, {"transforms": moved}))
            parts += self._joints(row, data)
            if len(contacts) or drawn:
                size = ROD * self.least
                marked = contact_markers(contacts, self.result.pairs, self.scale, size, t)
                parts.append(("/contacts/markers", _MARKERS, marked))
                drawn = bool(len(contacts))
            parts += [(f"/energy/{name}", _FLOAT, {"data": e[row]}) for name, e in energy.items()]
            for topic, kind, message in parts:
                yield t, t, topic, kind, message

    def _joints(self, row: int, data: pin.Data) -> Iterator[_Part]:
        """Yield the state of joints with one coordinate of their own, and twists of the others."""
        model, t = self.scene.model, self.times[row]
        q, v = self.result.q[row], self.result.v[row]
        joints = [(name, model.joints[j]) for j, name in enumerate(model.names) if j]
        plain = [
            (name, joint)
            for name, joint in joints
            if joint.nv == 1 and joint.shortname() != "JointModelMimic"
        ]
        if plain:
            state = {
                "header": _header(t, ""),
                "name": [name for name, _ in plain],
                "position": [_position(joint, q) for _, joint in plain],
                "velocity": [float(v[joint.idx_v]) for _, joint in plain],
            }
            yield "/joint_states", "sensor_msgs/JointState", state
        for _, joint in joints:
            if joint.nv > 1:
                name, place = self.frames.on(joint.id)
                twist = place.actInv(data.v[joint.id])
                moving = {"linear": xyz(twist.linear), "angular": xyz(twist.angular)}
                message = {"header": _header(t, name), "twist": moving}
                yield self.twists[name], "geometry_msgs/TwistStamped", message

    def _pair(
        self, index: int, row: int, contacts: SceneContacts, data: pin.Data, moved: list[Message]
    ) -> Iterator[_Part]:
        """Yield what one pair exerts in a row; add the frame of its wrench to `moved`."""
        t, pair = self.times[row], self.series[index]
        own, placed = contacts.pair == index, self.scene.pairs[index]
        center = (data.oMi[placed.joint_i] * placed.placement_i).translation
        torque = np.cross(contacts.point_world[own] - center, contacts.force_world[own]).sum(axis=0)
        frame, topic = self.frames.names[pair.name], self.topics[pair.name]
        moved.append(_transform(t, WORLD, frame, pin.SE3(np.eye(3), center)))
        slip = np.linalg.norm(contacts.slip_velocity_world[own], axis=1)
        wrench = _wrench(np.concatenate([pair.force_world[row], torque]))
        message = {"header": _header(t, frame), "wrench": wrench}
        yield f"{topic}/wrench", _WRENCH, message
        yield f"{topic}/normal_force", _FLOAT, {"data": pair.normal[row]}
        yield f"{topic}/depth", _FLOAT, {"data": pair.depth[row]}
        yield f"{topic}/slip", _FLOAT, {"data": slip.max(initial=0.0)}

    def _events(self) -> Iterator[_Sent]:
        for event in self.result.events:
            (t,) = _nanoseconds(np.array([event.t]), self.start).tolist()
            usual = event.kind in _USUAL or event.kind.endswith("_left")
            said = {
                "stamp": stamp_of(t),
                "level": _INFO if usual else _WARN,
                "name": event.pair,
                "msg": event.kind,
            }
            yield t, t, "/events", "rcl_interfaces/Log", said

    def _readings(self, name: str, log: SensorLog) -> Iterator[_Sent]:
        """Yield the readings when they arrived; they are published when they were taken."""
        topic = self.sensors[name]
        arrived, taken = (_nanoseconds(t, self.start).tolist() for t in (log.t, log.sampled))
        columns = [quantity_of(column)[0] for column in log.columns]
        wrench = [f"{part}_{axis}" for part in ("force", "torque") for axis in "xyz"]
        for t, sampled, values in zip(arrived, taken, log.values, strict=True):
            if columns == wrench:
                header = _header(sampled, self.stated.get(name, name))
                yield t, sampled, topic, _WRENCH, {"header": header, "wrench": _wrench(values)}
            elif columns == ["closed"]:
                yield t, sampled, topic, "std_msgs/Bool", {"data": values[0] > 0}
            else:
                for column, value in zip(columns, values, strict=True):
                    yield t, sampled, f"{topic}/{_token(column)}", _FLOAT, {"data": value}


_FLOAT, _MARKERS = "std_msgs/Float64", "visualization_msgs/MarkerArray"
_TRANSFORMS, _WRENCH = "tf2_msgs/TFMessage", "geometry_msgs/WrenchStamped"


def _nanoseconds(t: Array, start: int) -> Longs:
    """Return the time stamps of the times `t` [s]: whole nanoseconds since 1970."""
    # As floats first: the nanoseconds of what is far too large are no whole number.
    near = np.abs(t).max(initial=0.0) < _LAST * 1e-9
    ends = (t.min(initial=0), t.max(initial=0)) if near else ()
    stamps = [start + round(float(one) * 1e9) for one in ends]
    if len(t) and not (near and stamps[0] >= 0 and stamps[1] < _LAST):
        raise ResultError(
            "the result",
            f"has times from {t.min():.6g} to {t.max():.6g} s, which with start = {start} ns are "
            "not all from 1970 to 2038, as ROS 2 has them: give another start",
        )
    return start + np.rint(t * 1e9).astype(np.int64)


def _header(time: int, frame: str) -> Message:
    return {"stamp": stamp_of(time), "frame_id": frame}


def _wrench(values: Array) -> Message:
    return {"force": xyz(values[:3]), "torque": xyz(values[3:])}


def _transform(time: int, parent: str, name: str, place: pin.SE3) -> Message:
    transform = {"translation": xyz(place.translation), "rotation": quaternion(place.rotation)}
    return {"header": _header(time, parent), "child_frame_id": name, "transform": transform}


def _position(joint: pin.JointModel, q: Array) -> float:
    """Return a joint's angle [rad] or length [m]; one that turns without end from -pi to pi."""
    at = joint.idx_q
    return float(q[at] if joint.nq == 1 else np.arctan2(q[at + 1], q[at]))


def _stated_frames(result: Result, scene: Scene) -> dict[str, str]:
    """Return the frames of the sensors, as far as the settings of the scenario say them."""
    settings = {} if result.origin is None else result.origin.settings
    stated = settings.get("sensor")
    known = {frame.name for frame in scene.model.frames}
    return {
        str(one["name"]): str(one["frame"])
        for one in (stated if isinstance(stated, list) else ())
        if isinstance(one, dict) and one.get("frame") in known and one.get("name") in result.sensors
    }


def _topics(above: str, names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """Return a topic of its own for each of `names`: ROS 2 allows letters, digits, underscores."""
    used = set(taken)
    return {name: f"/{above}/{free_name(_token(name), used, '_')}" for name in names}


def _token(name: str) -> str:
    token = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return f"_{token}" if token[:1].isdigit() else token
