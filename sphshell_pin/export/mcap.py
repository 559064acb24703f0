"""A result as an MCAP file of ROS 2 messages; the page docs/export.md lists the topics."""

import heapq
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin._versions import __version__
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.base.checks import check_type
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.base.tables import quantity_of
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import PairSeries
from sphshell_pin.dynamics.result.result_scene import check_scene, scene_of, sound_rows
from sphshell_pin.dynamics.scene.mimic import joint_angle
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import ResultError, import_extra
from sphshell_pin.export.frames import WORLD, Frames, Message, header, take_name, transform, xyz
from sphshell_pin.export.markers import shell_markers, sphere_markers
from sphshell_pin.export.messages import full_name, schema_of

_LAST = (1 << 31) * 10**9  # ROS 2 has the seconds in 31 bits
_INFO = 20  # of rcl_interfaces/Log
# As rosbag2 writes it: `ros2 bag play` offers the last message to those who come later, too.
_FOREVER = "    sec: 9223372036\n    nsec: 854775807\n"
_LATCHED = (
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"
    f"  deadline:\n{_FOREVER}  lifespan:\n{_FOREVER}"
    f"  liveliness: 1\n  liveliness_lease_duration:\n{_FOREVER}"
    "  avoid_ros_namespace_conventions: false\n"
)


_Sent = tuple[int, str, str, Message]
"""Time of a message [ns], topic, type, content."""


def write_mcap(
    path: StrPath, result: Result, scene: Scene | None = None, *, start: int = 0
) -> Path:
    """Write `result` as an MCAP file; see `Result.to_mcap`."""
    mcap = import_extra("mcap_ros2.writer", "mcap", "Result.to_mcap", "mcap-ros2-support")
    scene = scene_of(result, scene)
    check_scene(result, scene, "the result")
    check_type("start", start, int, "must be a whole number of nanoseconds since 1970")
    run = _Run(result, scene, start)
    path, origin, first = Path(path), result.origin, run.times[0]
    about = {"version": __version__, "start [ns]": str(start)}
    about |= {f"contact {name}": topic for name, topic in run.topics.items()}
    try:
        with atomic_file(path) as stream, mcap.Writer(stream) as writer:
            if origin is not None:
                about["scenario"] = origin.scenario
                data = json.dumps(origin.settings, indent=1).encode()
                writer.add_attachment(first, first, "settings.json", "text/json", data)
            writer.add_metadata("sphshell_pin", about)
            schemas, static = {}, list(run.static())
            for k, (time, topic, kind, message) in enumerate(chain(static, run.messages())):
                if kind not in schemas:
                    schemas[kind] = writer.register_msgdef(full_name(kind), schema_of(kind))
                if k < len(static):
                    # A channel has metadata only if it is registered by MCAP's own writer.
                    writer._channel_ids[topic] = writer._writer.register_channel(
                        topic, "cdr", schemas[kind].id, {"offered_qos_profiles": _LATCHED}
                    )
                writer.write_message(topic, schemas[kind], message, time, time)
    except OSError as error:
        raise ResultError(path, f"cannot be written: {error.strerror or error}") from error
    return path


class _Run:
    """A result in its scene, as messages in the order of time."""

    def __init__(self, result: Result, scene: Scene, start: int) -> None:
        self.result, self.scene, self.start = result, scene, start
        # A run that diverged is written up to where its numbers end.
        self.count = sound_rows("the result", result.q, result.v)
        self.times = _nanoseconds(result.t[: self.count], start)
        self.frames = Frames.of(scene)
        touched = np.unique(result.contacts.pair).tolist()
        self.series = {k: PairSeries.of(result, k) for k in touched}
        self.topics = _topics("contacts", [series.name for series in self.series.values()])
        self.sensors = _topics("sensors", result.sensors)

    def static(self) -> Iterator[_Sent]:
        """Yield what is said once."""
        t, scene, frames = self.times[0], self.scene, self.frames
        fixed = [transform(t, parent, name, at) for name, parent, at in frames.fixed]
        yield t, "/tf_static", "tf2_msgs/TFMessage", {"transforms": fixed}
        yield t, "/shells", "visualization_msgs/MarkerArray", shell_markers(scene, frames, t)
        yield t, "/spheres", "visualization_msgs/MarkerArray", sphere_markers(scene, frames, t)

    def messages(self) -> Iterator[_Sent]:
        """Yield all other messages in the order of their times."""
        energy = self.result.energy_columns()
        t = energy.pop("t [s]")[: self.count]
        floats = [
            self._floats(topic, t, {"normal_force": series.normal, "depth": series.depth})
            for topic, series in zip(self.topics.values(), self.series.values(), strict=True)
        ]
        floats.append(self._floats("/energy", t, energy))
        for name, log in self.result.sensors.items():
            columns = dict(zip(log.columns, log.values.T, strict=True))
            floats.append(self._floats(self.sensors[name], log.t, columns))
        yield from heapq.merge(self._rows(), *floats, self._events(), key=lambda sent: sent[0])

    def _floats(self, above: str, t: Array, columns: Mapping[str, Array]) -> Iterator[_Sent]:
        """Yield the numbers of columns (n,) by their titles, at the times t (n,) [s]."""
        topics = {f"{above}/{_token(quantity_of(title)[0])}": c for title, c in columns.items()}
        for row, time in enumerate(_nanoseconds(t, self.start)):
            for topic, values in topics.items():
                yield time, topic, "std_msgs/Float64", {"data": float(values[row])}

    def _rows(self) -> Iterator[_Sent]:
        model, data = self.scene.model, self.scene.model.createData()
        joints = [
            (model.names[j], joint)
            for j, joint in enumerate(model.joints)
            if j and joint.nv == 1 and joint.shortname() != "JointModelMimic"
        ]
        for row, t in enumerate(self.times):
            q, v = self.result.q[row], self.result.v[row]
            pin.forwardKinematics(model, data, q)
            moved = [
                transform(t, WORLD, name, data.oMi[joint] * placed)
                for joint, (name, placed) in self.frames.moving.items()
            ]
            wrenches = [self._wrench(k, row, data) for k in self.series]
            moved += [
                transform(t, WORLD, frame, pin.SE3(np.eye(3), center))
                for frame, center, _ in wrenches
            ]
            if moved:
                yield t, "/tf", "tf2_msgs/TFMessage", {"transforms": moved}
            if joints:
                state = {
                    "header": header(t, ""),
                    "name": [name for name, _ in joints],
                    "position": [joint_angle(q[j.idx_q : j.idx_q + j.nq]) for _, j in joints],
                    "velocity": [float(v[joint.idx_v]) for _, joint in joints],
                }
                yield t, "/joint_states", "sensor_msgs/JointState", state
            for topic, (frame, _, wrench) in zip(self.topics.values(), wrenches, strict=True):
                message = {"header": header(t, frame), "wrench": wrench}
                yield t, f"{topic}/wrench", "geometry_msgs/WrenchStamped", message

    def _wrench(self, index: int, row: int, data: pin.Data) -> tuple[str, Array, Message]:
        """Return the frame at the center of a pair's sphere, that center, and the wrench there."""
        contacts, pair = self.result.contacts.at_row(row), self.scene.pairs[index]
        own = contacts.pair == index
        center = (data.oMi[pair.joint_i] * pair.placement_i).translation
        torque = np.cross(contacts.point_world[own] - center, contacts.force_world[own]).sum(axis=0)
        force = self.series[index].force_world[row]
        return self.frames.names[pair.name], center, {"force": xyz(force), "torque": xyz(torque)}

    def _events(self) -> Iterator[_Sent]:
        times = _nanoseconds(np.array([event.t for event in self.result.events]), self.start)
        for t, event in zip(times, self.result.events, strict=True):
            said = {"stamp": header(t, "")["stamp"], "level": _INFO}
            yield t, "/events", "rcl_interfaces/Log", said | {"name": event.pair, "msg": event.kind}


def _nanoseconds(t: Array, start: int) -> list[int]:
    """Return the time stamps of the times `t` [s]: whole nanoseconds since 1970."""
    # As floats first: the nanoseconds of what is far too large are no whole number.
    if np.abs(t).max(initial=0.0) < _LAST * 1e-9:
        stamps = [start + round(one) for one in (t * 1e9).tolist()]
        if all(0 <= stamp < _LAST for stamp in stamps):
            return stamps
    raise ResultError(
        "the result",
        f"has times from {t.min():.6g} to {t.max():.6g} s, which with start = {start} ns are "
        "not all from 1970 to 2038, as ROS 2 has them: give another start",
    )


def _topics(above: str, names: Iterable[str]) -> dict[str, str]:
    """Return a topic of its own for each of `names`: ROS 2 allows letters, digits, underscores."""
    used: set[str] = set()
    return {name: f"/{above}/{take_name(_token(name), used, '_')}" for name in names}


def _token(name: str) -> str:
    token = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return f"_{token}" if token[:1].isdigit() else token
