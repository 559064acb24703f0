"""A scenario of which every part is a file, code or both: its results must not need any of them."""

import shutil
from pathlib import Path

from sphshell_pin.robots.plain_mesh import FORMATS
from sphshell_pin.scenario import run_scenario, shipped_scenarios
from tests.fuzz.strangers import mesh_corpus
from tests.scenario.files import without_pictures

DATA = Path(__file__).parents[1] / "data"

SCENARIO = """
title = "a ball falls on a plate beside two arms"

[[robot]]
file = "arm/arm.urdf.xacro"
xacro_args = { angle = 0.3 }
srdf = "arm/arm.srdf"
pose = "bent"
label = "arm"
lock = ["elbow"]

[[robot]]
name = "ball"
start = { root_joint = [0.31, 0.02, 0.0125, 0, 0, 0, 1] }

[[robot]]
file = "meshes.xml"
label = "link"
placement = { xyz = [-1, 0, 0] }

[[shell]]
name = "plate"
file = "plate.obj"
unit = "m"

[[shell]]
name = "below"
primitive = { type = "box", size = [0.2, 0.2, 0.02] }
placement = { xyz = [0, 0, -0.5] }

[[contact]]
name = "ball-plate"
sphere = { frame = "ball/ball", radius = 0.012 }
shell = "plate"
law = { type = "hunt-crossley", stiffness = 1e6, exponent = 1.5, dissipation = 0.2 }
friction = { type = "coulomb", mu_static = 0.4, mu_dynamic = 0.3 }

[[contact]]
name = "tips"
spheres = "collision"
shell = "below"
law = { type = "table", file = "law.csv" }

[[source]]
name = "points"
find = "routine.py:find"
frame_i = "ball/ball"
law = { type = "table", file = "law.csv" }

[[sensor]]
name = "wrist"
type = "force-torque"
frame = "ball/ball"
rate = 300

[controller]
type = "python"
function = "routine.py:torque"

[run]
duration = 0.05
dt = 1e-4
record_dt = 1e-3
record = ["patch"]

[figures]
own = "routine.py:figure"
"""

CAD = """
[[shell]]
name = "valve"
file = "valve_body.step"
chord_error = 1e-3
placement = { xyz = [0, 1, 0] }

[[contact]]
name = "ball-valve"
sphere = { frame = "ball/ball", radius = 0.012 }
shell = "valve"
method = "smooth"
law = { type = "impact", stiffness = 1e6 }
"""

ROUTINE = """
from pathlib import Path

Path(__file__).with_name("executed").touch()


def find(pose_i, pose_j):
    return [], [], []


def torque(t, q, v, contacts):
    return [0.0] * len(v)


def figure(result, scene):
    return 1.0
"""

LINK = """
<link name="NAME">
  <inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>
  </inertial>
  <visual><geometry><mesh filename="package://finger_description/meshes/cube.stl" scale="0.02 0.02
    0.1"/></geometry></visual>
  <collision><geometry><sphere radius="0.02"/></geometry></collision>
</link>
"""
JOINT = """
<joint name="NAME" type="revolute"><parent link="PARENT"/><child link="CHILD"/>
<origin xyz="0 0 0.1"/><axis xyz="0 1 0"/>
<limit lower="-${pi}" upper="$(arg angle)" effort="1" velocity="1"/></joint>
"""
HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
ARM = (
    f'{HEAD}<xacro:arg name="angle" default="1"/><link name="base">'
    + "".join(
        f'<visual><geometry><mesh filename="drawn.{suffix}"/></geometry></visual>'
        for suffix in ("dae", "obj", "ply", "stl")
    )
    + "</link>"
    + LINK.replace("NAME", "upper")
    + LINK.replace("NAME", "lower")
    + JOINT.replace("NAME", "shoulder").replace("PARENT", "base").replace("CHILD", "upper")
    + JOINT.replace("NAME", "elbow").replace("PARENT", "upper").replace("CHILD", "lower")
    + "</robot>"
)
POSES = """<robot name="arm"><group name="all"><joint name="elbow"/></group>
<group_state name="bent" group="all"><joint name="elbow" value="-0.7"/></group_state></robot>"""


def write(home: Path) -> Path:
    """Write the scenario and all its files into `home`; return its path."""
    shutil.copytree(DATA / "xacro" / "finger_description", home / "arm" / "finger_description")
    (home / "arm" / "arm.urdf.xacro").write_text(ARM)
    (home / "arm" / "arm.srdf").write_text(POSES)
    # Meshes that name other files, in every format that is kept.
    for suffix in FORMATS:
        (home / "arm" / f"drawn{suffix}").write_bytes(
            mesh_corpus(suffix)[0].replace(b"/dev/zero", b"named")
        )
    with (home / "arm" / "drawn.obj").open("ab") as file:
        file.write(b"\rmtllib named\nmtllib named\nusemtl a\n")
    (home / "arm" / "named").write_text("newmtl a\nmap_Kd named\n")
    shutil.copy(DATA / "mjcf" / "meshes.xml", home)
    shutil.copytree(DATA / "mjcf" / "assets", home / "assets")
    shutil.copy(shipped_scenarios()["polished_valve"].parent / "surfaces" / "valve_body.step", home)
    (home / "plate.obj").write_text(
        "v 0.2 -0.1 0\nv 0.4 -0.1 0\nv 0.4 0.1 0\nv 0.2 0.1 0\nf 1 2 3 4\n"
    )
    (home / "law.csv").write_text("depth,force\n0,0\n1e-3,10\n")
    (home / "routine.py").write_text(ROUTINE)
    (home / "all.toml").write_text(SCENARIO + CAD)
    return home / "all.toml"


def run(home: Path) -> Path:
    """Run it; return the folder of its results. What it read is worse than gone afterwards."""
    out = home / "results"
    with without_pictures():
        run_scenario(write(home), out, recording=False)
    (home / "arm" / "arm.urdf.xacro").write_text(f"{HEAD}<link name='a${{1 / 0}}'/></robot>")
    (home / "executed").unlink()
    return out
