"""The messages are those of ROS 2: definitions by their hashes, bytes by another implementation."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sphshell_pin.dynamics.scene.scene_contacts import ROW, SceneContacts
from sphshell_pin.export.cdr import encode
from sphshell_pin.export.markers import ARROW, contact_markers
from sphshell_pin.export.messages import DEFINITIONS, full_name, schema_of
from sphshell_pin.view.arrows import ArrowScale

JAZZY = get_typestore(Stores.ROS2_JAZZY)
POINTS = np.random.default_rng(3).normal(size=(5, 3))


@pytest.mark.parametrize("kind", DEFINITIONS)
def test_a_definition_is_that_of_ros_2(kind):
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema_of(kind), full_name(kind)))
    assert store.hash_rihs01(full_name(kind)) == JAZZY.hash_rihs01(full_name(kind))


MESSAGES = {
    "std_msgs/Bool": {"data": True},
    "std_msgs/Float64": {"data": 0.1},
    "sensor_msgs/JointState": {
        "header": {"stamp": {"sec": 3, "nanosec": 999_999_999}, "frame_id": "ä"},
        "name": ["a", "", "long name"],
        "position": [1.0, -0.0, np.nan],
        "velocity": np.array([np.inf, 5e-324, 0.1]),
    },
    "tf2_msgs/TFMessage": {
        "transforms": [
            {
                "child_frame_id": "x" * k,
                "transform": {"translation": point, "rotation": (0, 0, 0, 1)},
            }
            for k, point in enumerate(POINTS)
        ]
    },
    "visualization_msgs/Marker": {
        "ns": "odd",
        "type": 11,
        "color": (0.1, 0.2, 0.3, 1.0),
        "frame_locked": True,
        "points": POINTS,
        "colors": [(1, 0, 0, 1), {"g": 0.5}],
        "text": "end",
    },
    "rcl_interfaces/Log": {"level": 20, "name": "pair", "msg": "touch", "line": 7},
}


@pytest.mark.parametrize("kind", MESSAGES)
def test_another_implementation_has_the_same_bytes(kind):
    data = encode(kind, MESSAGES[kind])
    there = JAZZY.deserialize_cdr(data, full_name(kind))
    assert bytes(JAZZY.serialize_cdr(there, full_name(kind))) == data


def test_what_the_other_implementation_reads():
    marker = JAZZY.deserialize_cdr(
        encode("visualization_msgs/Marker", MESSAGES["visualization_msgs/Marker"]),
        "visualization_msgs/msg/Marker",
    )
    assert [(p.x, p.y, p.z) for p in marker.points] == [tuple(point) for point in POINTS.tolist()]
    assert (marker.ns, marker.type, marker.frame_locked, marker.text) == ("odd", 11, True, "end")
    assert marker.color.b == pytest.approx(0.3, rel=1e-7)
    assert marker.colors[1].g == 0.5
    assert marker.mesh_file.data.size == 0


def test_a_message_that_does_not_fit_its_type_is_refused():
    with pytest.raises(KeyError, match="no field"):
        encode("std_msgs/Bool", {"date": True})
    with pytest.raises(KeyError, match="fields"):
        encode("geometry_msgs/WrenchStamped", {"header": (0, 0)})
    with pytest.raises(KeyError, match="rows of 3"):
        encode("visualization_msgs/Marker", {"points": np.zeros((4, 2))})


def test_arrows_of_contacts_add_up_to_the_force_and_none_pulls():
    rows = np.zeros(4, ROW)
    rows["pair"], rows["normal_force"] = [1, 0, 0, 0], [7.0, 3.0, -2.5, 3.0]
    rows["normal_world"] = [[0, 0, 1], [0.6, 0, 0.8], [0, 0, 1], [-0.6, 0, 0.8]]
    rows["point_world"][:, 0] = [5.0, 0.0, 1.0, 2.0]
    contacts = SceneContacts.from_rows(rows.tobytes())
    drawn = contact_markers(contacts, ("a", "b"), ArrowScale(1.0, 1.0), 0.1, (0, 0))["markers"]
    arrows = [one for one in drawn if one.get("type") == ARROW]
    assert [one["ns"] for one in arrows] == ["normal/b", "normal/a", "normal/a"]
    forces = np.array([np.diff(one["points"], axis=0)[0] for one in arrows])
    assert (forces[:, 2] > 0.0).all()
    total = rows["normal_force"] @ rows["normal_world"]
    np.testing.assert_allclose(forces.sum(axis=0), total, atol=1e-12)
