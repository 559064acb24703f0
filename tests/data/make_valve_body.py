"""Make scenarios/surfaces/valve_body.step and .urdf: a part for a hand to grasp.

    python -m tests.data.make_valve_body

A valve body as one prints it of nylon: a barrel with a bore on a bolted flange, a collar on top,
two side ports, edges rounded. The axis is z, the flange stands on z = 0.
"""

import math
from pathlib import Path

from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepGProp import BRepGProp
from OCP.GeomAbs import GeomAbs_Circle
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

from tests.parts import occ

SURFACES = Path(__file__).parents[2] / "scenarios" / "surfaces"
DENSITY = 1010.0  # kg/m^3, nylon 12

# Millimeters.
FLANGE, FLANGE_HEIGHT = 42.0, 8.0
BARREL, BORE, HEIGHT = 29.0, 23.5, 144.0
COLLAR, COLLAR_HEIGHT = 34.0, 8.0
BOLT, BOLT_CIRCLE = 3.2, 35.5
PORT, PORT_BORE, PORT_LENGTH, PORT_HEIGHT = 11.0, 7.0, 44.0, 72.0
FILLET = 1.5


def is_circle(edge):
    """Whether an edge is a circle."""
    return BRepAdaptor_Curve(edge).GetType() == GeomAbs_Circle


def valve_body():
    """Return the solid."""
    outer = occ.cylinder(FLANGE, FLANGE_HEIGHT)
    for one in (
        occ.cylinder(BARREL, HEIGHT - COLLAR_HEIGHT, (0, 0, 0.5 * FLANGE_HEIGHT)),
        occ.cylinder(COLLAR, COLLAR_HEIGHT, (0, 0, HEIGHT - COLLAR_HEIGHT)),
        occ.cylinder(PORT, 2 * PORT_LENGTH, (0, -PORT_LENGTH, PORT_HEIGHT), (0, 1, 0)),
    ):
        outer = BRepAlgoAPI_Fuse(outer, one).Shape()
    circles = filter(is_circle, occ.edges_where(outer, lambda p: True))
    solid = occ.filleted(outer, circles, FILLET)
    holes = [
        occ.cylinder(BORE, HEIGHT, (0, 0, FLANGE_HEIGHT)),
        occ.cylinder(PORT_BORE, 4 * PORT_LENGTH, (0, -2 * PORT_LENGTH, PORT_HEIGHT), (0, 1, 0)),
    ]
    for k in range(4):
        angle = math.pi / 4 + k * math.pi / 2
        x, y = BOLT_CIRCLE * math.cos(angle), BOLT_CIRCLE * math.sin(angle)
        holes.append(occ.cylinder(BOLT, 3 * FLANGE_HEIGHT, (x, y, -FLANGE_HEIGHT)))
    for one in holes:
        solid = BRepAlgoAPI_Cut(solid, one).Shape()
    return solid


def write_step(shape, path):
    """Write `shape` with lengths in millimeters."""
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer.Transfer(shape, STEPControl_AsIs)
    if writer.Write(str(path)) != IFSelect_RetDone:
        raise SystemExit(f"cannot write {path}")


def write_urdf(shape, path):
    """Write the free body that carries the surface."""
    about = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, about)
    mass = about.Mass() * 1e-9 * DENSITY
    center = about.CentreOfMass()
    # Of the volume about its center, in mm^5.
    moments = about.MatrixOfInertia()
    ixx, iyy, izz = (moments.Value(k, k) * 1e-15 * DENSITY for k in (1, 2, 3))
    path.write_text(
        f"""<?xml version="1.0"?>
<!-- A valve body of nylon, {DENSITY:g} kg/m^3, axis along z, foot at z = 0. Its shell is
     valve_body.step; both are written by tests/data/make_valve_body.py. -->
<robot name="valve_body">
  <link name="valve_body">
    <inertial>
      <origin xyz="0 0 {center.Z() * 1e-3:.6f}"/>
      <mass value="{mass:.6f}"/>
      <inertia ixx="{ixx:.4e}" iyy="{iyy:.4e}" izz="{izz:.4e}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
</robot>
"""
    )


if __name__ == "__main__":
    body = valve_body()
    write_step(body, SURFACES / "valve_body.step")
    write_urdf(body, SURFACES / "valve_body.urdf")
