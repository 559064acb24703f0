"""A scenario with an arm of two hinges and a controller, for tests of what moves it."""

from pathlib import Path

LINK = """
  <link name="{name}">
    <inertial><origin xyz="0 0 0.15"/><mass value="1.0"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0 0 0.15"/><geometry><box size="0.06 0.06 0.3"/></geometry></visual>
  </link>"""
HINGE = """
  <joint name="{name}" type="revolute">
    <parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 {height}"/><axis xyz="0 1 0"/>
    <limit lower="-2.0" upper="1.5" effort="100" velocity="10"/>
  </joint>"""
SCENARIO = """
title = "an arm"

[robot]
urdf = "arm.urdf"
start = {{ shoulder = 0.4, elbow = 0.5 }}

{controller}

[run]
duration = 1.0
dt = 1e-3
integrator = "semi-implicit-euler"
"""
PD = '[controller]\ntype = "joint-pd"\nkp = 60.0\nkd = 8.0\n'


def write_arm(folder: Path, controller: str = PD) -> Path:
    """Write the scenario with its URDF and return its path."""
    parts = [
        '<robot name="arm">\n  <link name="base"/>',
        LINK.format(name="upper"),
        LINK.format(name="lower"),
        HINGE.format(name="shoulder", parent="base", child="upper", height=0.0),
        HINGE.format(name="elbow", parent="upper", child="lower", height=0.3),
        "\n</robot>\n",
    ]
    (folder / "arm.urdf").write_text("".join(parts), encoding="utf-8")
    path = folder / "arm.toml"
    path.write_text(SCENARIO.format(controller=controller), encoding="utf-8")
    return path
