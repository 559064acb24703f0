"""The messages are those of ROS 2, by the hashes of their definitions."""

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sphshell_pin.export.messages import DEFINITIONS, full_name, schema_of

JAZZY = get_typestore(Stores.ROS2_JAZZY)


@pytest.mark.parametrize("kind", DEFINITIONS)
def test_a_definition_is_that_of_ros_2(kind):
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema_of(kind), full_name(kind)))
    assert store.hash_rihs01(full_name(kind)) == JAZZY.hash_rihs01(full_name(kind))
