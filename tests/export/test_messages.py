"""The messages are those of ROS 2, by the hashes of their definitions."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sphshell_pin.dynamics.scene.scene_contacts import ROW, SceneContacts
from sphshell_pin.export.markers import ARROW, contact_markers
from sphshell_pin.export.messages import DEFINITIONS, full_name, schema_of
from sphshell_pin.view.arrows import ArrowScale

JAZZY = get_typestore(Stores.ROS2_JAZZY)


@pytest.mark.parametrize("kind", DEFINITIONS)
def test_a_definition_is_that_of_ros_2(kind):
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema_of(kind), full_name(kind)))
    assert store.hash_rihs01(full_name(kind)) == JAZZY.hash_rihs01(full_name(kind))


def test_arrows_of_contacts_add_up_to_the_force_and_none_pulls():
    rows = np.zeros(4, ROW)
    rows["pair"], rows["normal_force"] = [1, 0, 0, 0], [7.0, 3.0, -2.5, 3.0]
    rows["normal_world"] = [[0, 0, 1], [0.6, 0, 0.8], [0, 0, 1], [-0.6, 0, 0.8]]
    rows["point_world"][:, 0] = [5.0, 0.0, 1.0, 2.0]
    contacts = SceneContacts.from_rows(rows.tobytes())
    drawn = contact_markers(contacts, ("a", "b"), ArrowScale(1.0, 1.0), 0.1, 0)["markers"]
    arrows = [one for one in drawn if one.get("type") == ARROW]
    assert [one["ns"] for one in arrows] == ["normal/b", "normal/a", "normal/a"]
    ends = np.array([[list(point.values()) for point in one["points"]] for one in arrows])
    forces = ends[:, 1] - ends[:, 0]
    assert (forces[:, 2] > 0.0).all()
    total = rows["normal_force"] @ rows["normal_world"]
    np.testing.assert_allclose(forces.sum(axis=0), total, atol=1e-12)
