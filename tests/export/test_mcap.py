"""MCAP files read back by an independent reader: every number, every time."""

import json
import sys
from collections import defaultdict
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pinocchio as pin
import pytest
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_typestore

import sphshell_pin as sp
from sphshell_pin.dynamics.result.result_parts import Origin
from sphshell_pin.errors import InvalidParameter, MissingExtra, ResultError
from sphshell_pin.export import mcap as exporting
from tests.export.runs import linkless_run

JAZZY = get_typestore(Stores.ROS2_JAZZY)
START = 1_800_000_000_123_456_789


def xyz(one):
    return [one.x, one.y, one.z]


def stamp(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


class Read:
    """Messages, by rosbags' own definitions of ROS 2's, and log times, by topic."""

    def __init__(self, path):
        self.path = path
        self.topics, self.times = defaultdict(list), defaultdict(list)
        self.order = []
        with open(path, "rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            self.summary, self.header = reader.get_summary(), reader.get_header()
            self.metadata = {one.name: one.metadata for one in reader.iter_metadata()}
            self.attachments = {one.name: one.data for one in reader.iter_attachments()}
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                decoded = JAZZY.deserialize_cdr(message.data, schema.name)
                self.topics[channel.topic].append(decoded)
                self.times[channel.topic].append(message.log_time)
                self.order.append(message.log_time)

    def numbers(self, topic, *fields):
        """The numbers of a field, by message."""
        found = []
        for value in self.topics[topic]:
            for field in fields:
                value = getattr(value, field)  # noqa: PLW2901
            found.append(xyz(value) if hasattr(value, "x") else value)
        return np.array(found)

    def transforms(self, frame):
        """The transforms of a frame that moves, in order of time."""
        every = (one for message in self.topics["/tf"] for one in message.transforms)
        return [one for one in every if one.child_frame_id == frame]


@pytest.fixture(scope="module")
def finger(finger, tmp_path_factory):
    return finger, Read(finger.to_mcap(tmp_path_factory.mktemp("f") / "finger.mcap", start=START))


@pytest.fixture(scope="module")
def table(table, tmp_path_factory):
    return table, Read(table.to_mcap(tmp_path_factory.mktemp("t") / "table.mcap"))


def nanoseconds(t, start=START):
    return [start + round(float(one) * 1e9) for one in t]


def test_the_numbers_of_rows_are_those_of_the_result(finger):
    result, read = finger
    joints = read.topics["/joint_states"]
    assert joints[0].name == list(result.scene.model.names)[1:]
    np.testing.assert_array_equal([one.position for one in joints], result.q)
    np.testing.assert_array_equal([one.velocity for one in joints], result.v)
    assert all(len(one.effort) == 0 for one in joints)
    for part in ("kinetic", "potential", "elastic", "damping_loss", "control_work", "residual"):
        values = getattr(result.energy, part)
        np.testing.assert_array_equal(read.numbers(f"/energy/{part}", "data"), values)
    rows = result.row_columns()
    for topic, column in (("normal_force", "normal_force [N]"), ("depth", "depth [m]")):
        sent = read.numbers(f"/contacts/tip_wall/{topic}", "data")
        np.testing.assert_array_equal(sent, rows[f"pairs.tip-wall.{column}"])
    assert max(rows["pairs.tip-wall.normal_force [N]"]) > 0.1


def test_wrenches_are_about_the_center_of_the_sphere_in_the_axes_of_the_world(finger):
    result, read = finger
    force = np.column_stack([result.row_columns()[f"pairs.tip-wall.force_{a} [N]"] for a in "xyz"])
    topic = "/contacts/tip_wall/wrench"
    np.testing.assert_array_equal(read.numbers(topic, "wrench", "force"), force)
    assert {one.header.frame_id for one in read.topics[topic]} == {"contact/tip-wall"}
    torque = read.numbers(topic, "wrench", "torque")
    place = {stamp(one): one.transform for one in read.transforms("contact/tip-wall")}
    for row, t in enumerate(read.times[topic]):
        contacts = result.contacts.at_row(row)
        arms = contacts.point_world - xyz(place[t].translation)
        own = np.cross(arms, contacts.force_world).sum(axis=0)
        np.testing.assert_allclose(torque[row], own, rtol=0, atol=1e-15)
        r = place[t].rotation
        assert (r.x, r.y, r.z, r.w) == (0, 0, 0, 1)
        np.testing.assert_allclose(np.linalg.norm(arms, axis=1), 0.010 - contacts.depth, rtol=1e-9)


def test_times_are_whole_nanoseconds_in_order(finger):
    result, read = finger
    wanted = nanoseconds(result.t)
    for topic in ("/joint_states", "/tf", "/energy/kinetic"):
        assert read.times[topic] == wanted
    assert list(map(stamp, read.topics["/joint_states"])) == wanted
    assert read.order == sorted(read.order)
    assert read.summary.statistics.message_start_time == wanted[0]
    for topic in ("/tf_static", "/shells", "/spheres"):
        assert read.times[topic] == wanted[:1]


def test_events_and_readings_of_sensors_when_they_arrived(finger):
    result, read = finger
    log = result.sensors["fingertip"]
    for column, values in zip(log.columns, log.values.T, strict=True):
        topic = f"/sensors/fingertip/{column.partition(' ')[0]}"
        np.testing.assert_array_equal(read.numbers(topic, "data"), values)
        assert read.times[topic] == nanoseconds(log.t)
    knuckle = result.sensors["knuckle"].values[:, 0]
    np.testing.assert_array_equal(read.numbers("/sensors/knuckle/torque", "data"), knuckle)
    said = [(one.name, one.msg) for one in read.topics["/events"]]
    assert said == [(event.pair, event.kind) for event in result.events]
    assert read.times["/events"] == nanoseconds([event.t for event in result.events])
    closed = read.numbers("/sensors/touch/closed", "data")
    np.testing.assert_array_equal(closed, result.sensors["touch"].values[:, 0])
    assert closed.any()


def poses(read, row):
    """Where every frame is in the world, from /tf and /tf_static alone."""
    told = (*read.topics["/tf_static"][0].transforms, *read.topics["/tf"][row].transforms)
    stated = {one.child_frame_id: (one.header.frame_id, one.transform) for one in told}

    def pose(name):
        if name == "universe":
            return pin.SE3.Identity()
        parent, at = stated[name]
        turn = pin.Quaternion(at.rotation.w, at.rotation.x, at.rotation.y, at.rotation.z)
        return pose(parent) * pin.SE3(turn.matrix(), np.array(xyz(at.translation)))

    return {name: pose(name) for name in stated}


@pytest.mark.parametrize("run", ["finger", "table"])
def test_frames_are_where_pinocchio_has_them(run, request):
    result, read = request.getfixturevalue(run)
    model, scene = result.scene.model, result.scene
    data = model.createData()
    for row in (0, len(result.t) // 2, len(result.t) - 1):
        pin.framesForwardKinematics(model, data, result.q[row])
        found = poses(read, row)
        for index, frame in enumerate(model.frames):
            if frame.type == pin.FrameType.BODY:
                assert near(found[frame.name], data.oMf[index]), frame.name
        for pair in scene.pairs:
            center = data.oMi[pair.joint_i] * pair.placement_i
            assert near(found[f"sphere/{pair.name}"], center)
    shells = {name for name in found if name.startswith("shell/")}
    assert shells == ({"shell/wall", "shell/wall-2"} if run == "finger" else {"shell/disc"})
    for name, pair in zip(sorted(shells), scene.pairs, strict=True):
        assert near(found[name], data.oMi[pair.joint_j] * pair.placement_j)


def near(one, other):
    """Whether two poses are equal but for the rounding of quaternions."""
    return np.abs(one.homogeneous - other.homogeneous).max() < 2e-15


def test_joints_without_end_and_free_bodies(table):
    result, read = table
    states = read.topics["/joint_states"]
    assert {tuple(one.name) for one in states} == {("axle",)}
    angles = [one.position[0] for one in states]
    np.testing.assert_array_equal(angles, np.arctan2(result.q[:, 1], result.q[:, 0]))
    ball = [xyz(one.transform.translation) for one in read.transforms("ball")]
    np.testing.assert_array_equal(ball, result.q[:, 2:5])
    assert "/contacts/_1st_ball_disc/wrench" in read.topics
    assert read.metadata["sphshell_pin"]["contact 1st ball/disc"] == "/contacts/_1st_ball_disc"


def test_a_joint_without_a_link_has_its_own_frame(tmp_path):
    result = linkless_run()
    read = Read(result.to_mcap(tmp_path / "run.mcap"))
    model = result.scene.model
    data = model.createData()
    pin.forwardKinematics(model, data, result.q[-1], result.v[-1])
    found = poses(read, -1)
    assert near(found["moves"], data.oMi[2])
    assert near(found["moves-2"], data.oMi[1])


def test_shells_and_spheres_are_drawn_once(table):
    _, read = table
    (shells,), (bodies,) = read.topics["/shells"], read.topics["/spheres"]
    (shell,) = shells.markers
    corners = np.array(list(map(xyz, shell.points))).reshape(-1, 3, 3)
    edges = corners[:, 1:] - corners[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum()
    assert area == pytest.approx(0.04, rel=1e-12)
    assert (shell.type, shell.frame_locked, shell.header.frame_id) == (11, True, "shell/disc")
    ball = bodies.markers[0]
    assert (ball.header.frame_id, ball.type) == ("sphere/1st ball/disc", 2)
    assert xyz(ball.scale) == [0.04, 0.04, 0.04]
    latched = {"/tf_static", "/shells", "/spheres"}
    channels = read.summary.channels.values()
    assert {one.topic for one in channels if "offered_qos_profiles" in one.metadata} == latched


def test_the_file_says_where_it_comes_from(finger, tmp_path):
    result, read = finger
    assert read.header.profile == "ros2"
    about = read.metadata["sphshell_pin"]
    assert about["version"] == sp.__version__
    assert about["start [ns]"] == str(START)
    settings = {"run": {"dt": 1e-4}, "sensor": [{"name": "fingertip", "frame": "tip"}]}
    origin = Origin("some/finger.toml", settings)
    path = tmp_path / "finger.mcap"
    exporting.write_mcap(path, replace(result, origin=origin))
    read = Read(path)
    assert read.metadata["sphshell_pin"]["scenario"] == "some/finger.toml"
    assert json.loads(read.attachments["settings.json"]) == settings


def test_a_run_that_diverged_is_written_up_to_there(finger, tmp_path):
    result, _ = finger
    q = result.q.copy()
    q[20:] = np.nan
    read = Read(replace(result, q=q).to_mcap(tmp_path / "part.mcap"))
    assert read.times["/tf"] == nanoseconds(result.t[:20], 0)
    with pytest.raises(ResultError, match="no row of finite numbers"):
        replace(result, q=np.full_like(q, np.nan)).to_mcap(tmp_path / "none.mcap")
    assert not (tmp_path / "none.mcap").exists()


def test_times_that_ros_2_does_not_have_are_refused(finger, tmp_path):
    result, _ = finger
    path = tmp_path / "early.mcap"
    early = replace(result, t=result.t - 0.02)
    for run, start, kind, words in (
        (early, 0, ResultError, r"from -0\.02 to 0\.06 s.*give another start"),
        (result, 2**31 * 10**9 - 1, ResultError, "from 1970 to 2038"),
        (result, 1.5, InvalidParameter, "nanoseconds since 1970"),
    ):
        with pytest.raises(kind, match=words):
            run.to_mcap(path, start=start)
    assert not path.exists()
    assert Read(early.to_mcap(path, start=20_000_000)).times["/tf"][0] == 0


def test_the_file_is_written_whole_or_not_at_all(finger, tmp_path, monkeypatch):
    result, _ = finger
    path = tmp_path / "run.mcap"
    before = result.to_mcap(path).read_bytes()
    full = Mock(side_effect=[*99 * [None], OSError(28, "No space left on device")])
    monkeypatch.setattr("mcap_ros2.writer.Writer.write_message", full)
    with pytest.raises(ResultError, match="No space left"):
        result.to_mcap(path)
    assert path.read_bytes() == before
    assert [one.name for one in tmp_path.iterdir()] == ["run.mcap"]
    with pytest.raises(ResultError, match="cannot be written"):
        result.to_mcap(tmp_path / "no" / "such" / "run.mcap")


def test_a_scene_of_another_run_is_refused(finger, table, tmp_path):
    result, _ = finger
    with pytest.raises(ResultError, match="its model had nq"):
        result.to_mcap(tmp_path / "x.mcap", table[0].scene)
    loaded = sp.Result.load(result.save(tmp_path / "run.npz"))
    with pytest.raises(ResultError, match=r"give scene=\.\.\."):
        loaded.to_mcap(tmp_path / "x.mcap")
    path = loaded.to_mcap(tmp_path / "x.mcap", result.scene, start=START)
    assert path.read_bytes() == finger[1].path.read_bytes()


def test_without_the_package_the_extra_is_named(finger, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mcap_ros2.writer", None)
    with pytest.raises(MissingExtra, match=r"sphshell-pin\[mcap\]"):
        finger[0].to_mcap(tmp_path / "x.mcap")


def test_names_that_ros_2_does_not_allow_or_that_coincide_get_their_own_topics():
    topics = exporting._topics("sensors", ["a-b", "a_b", "1 µ"])
    assert list(topics.values()) == ["/sensors/a_b", "/sensors/a_b_2", "/sensors/_1__"]
