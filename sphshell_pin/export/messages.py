"""The definitions of the ROS 2 messages that a run is written as, without their comments.

They are those of ROS 2 Jazzy (github.com/ros2/common_interfaces, geometry2 and rcl_interfaces,
branch jazzy; licenses Apache 2.0 and BSD); `tests/export/test_messages.py` compares their hashes.
"""

from __future__ import annotations

import re

DEFINITIONS = {
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/TwistStamped": "std_msgs/Header header\ngeometry_msgs/Twist twist",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque",
    "geometry_msgs/WrenchStamped": "std_msgs/Header header\ngeometry_msgs/Wrench wrench",
    "rcl_interfaces/Log": """\
byte DEBUG=10
byte INFO=20
byte WARN=30
byte ERROR=40
byte FATAL=50
builtin_interfaces/Time stamp
uint8 level
string name
string msg
string file
string function
uint32 line""",
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data",
    "sensor_msgs/JointState": """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort""",
    "std_msgs/Bool": "bool data",
    "std_msgs/ColorRGBA": "float32 r\nfloat32 g\nfloat32 b\nfloat32 a",
    "std_msgs/Float64": "float64 data",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "visualization_msgs/Marker": """\
int32 ARROW=0
int32 CUBE=1
int32 SPHERE=2
int32 CYLINDER=3
int32 LINE_STRIP=4
int32 LINE_LIST=5
int32 CUBE_LIST=6
int32 SPHERE_LIST=7
int32 POINTS=8
int32 TEXT_VIEW_FACING=9
int32 MESH_RESOURCE=10
int32 TRIANGLE_LIST=11
int32 ARROW_STRIP=12
int32 ADD=0
int32 MODIFY=0
int32 DELETE=2
int32 DELETEALL=3
std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string texture_resource
sensor_msgs/CompressedImage texture
visualization_msgs/UVCoordinate[] uv_coordinates
string text
string mesh_resource
visualization_msgs/MeshFile mesh_file
bool mesh_use_embedded_materials""",
    "visualization_msgs/MarkerArray": "visualization_msgs/Marker[] markers",
    "visualization_msgs/MeshFile": "string filename\nuint8[] data",
    "visualization_msgs/UVCoordinate": "float32 u\nfloat32 v",
}
"""By type (package/Name), the lines of its .msg file."""

_OTHER = re.compile(r"^([a-z]\w*/\w+)", re.MULTILINE)
_LINE = "=" * 80


def schema_of(kind: str) -> str:
    """Return the definition of the message `kind` followed by those of all types within it.

    So MCAP's "ros2msg" schemas are written: the parts are separated by a line of 80 "=" and "MSG: "
    with the name of the type.
    """
    whole = [DEFINITIONS[kind]]
    inner: list[str] = []
    for text in whole:  # grows
        for name in _OTHER.findall(text):
            if name not in inner:
                inner.append(name)
                whole.append(DEFINITIONS[name])
    parts = [f"MSG: {name}\n{DEFINITIONS[name]}" for name in inner]
    return f"\n{_LINE}\n".join([DEFINITIONS[kind], *parts]) + "\n"


def full_name(kind: str) -> str:
    """Return the name that ROS 2 has for the message `kind`: package/msg/Name."""
    return kind.replace("/", "/msg/")
