"""The definitions of the ROS 2 messages that a run is written as, without their comments.

The file messages.txt has them, each behind its type. They are those of ROS 2 Jazzy
(github.com/ros2/common_interfaces, geometry2 and rcl_interfaces,
branch jazzy; licenses Apache 2.0 and BSD); `tests/export/test_messages.py` compares their hashes.
"""

import re
from pathlib import Path

_TEXT = Path(__file__).with_name("messages.txt").read_text(encoding="utf-8")

DEFINITIONS = dict(text.strip().split("\n", 1) for text in _TEXT.split("\n\n"))
"""By type (package/Name), the lines of its .msg file."""

_OTHER = re.compile(r"^([a-z]\w*/\w+)", re.MULTILINE)


def schema_of(kind: str) -> str:
    """Return the definition of the message `kind` followed by those of all types within it.

    So MCAP's "ros2msg" schemas are written: the parts are separated by a line of 80 "=" and "MSG: "
    with the name of the type.
    """
    kinds = [kind]
    for one in kinds:  # grows
        kinds += [k for k in dict.fromkeys(_OTHER.findall(DEFINITIONS[one])) if k not in kinds]
    parts = [f"MSG: {one}\n{DEFINITIONS[one]}" for one in kinds[1:]]
    return f"\n{'=' * 80}\n".join([DEFINITIONS[kind], *parts]) + "\n"


def full_name(kind: str) -> str:
    """Return the name that ROS 2 has for the message `kind`: package/msg/Name."""
    return kind.replace("/", "/msg/")
