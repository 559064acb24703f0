"""Reports about files of robots and assemblies: masses, joints that mimic, parts used twice."""

import tempfile
from pathlib import Path

import numpy as np

import sphshell_pin as sp
from sphshell_pin import robots
from tests.public_cases import case
from tests.public_cases.shapes import binary_stl

_MASS = (
    '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    "</inertial>"
)
_JOINT = (
    '<joint name="j{0}" type="{1}"><parent link="l{0}"/><child link="l{2}"/><axis xyz="0 0 1"/>'
    '<limit lower="-9" upper="9" effort="1" velocity="1"/>{3}</joint>'
)


def chain(links: list[str], joints: list[tuple[str, str]]) -> robots.LoadedRobot:
    """Load a URDF of links with what is in them, and joints of a type with what they mimic."""
    text = "".join(f'<link name="l{k}">{inside}</link>' for k, inside in enumerate(links))
    text += "".join(_JOINT.format(k, *one[:1], k + 1, one[1]) for k, one in enumerate(joints))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "chain.urdf"
        file.write_text(f'<robot name="chain">{text}</robot>', encoding="utf-8")
        return robots.load_file(file, mimic=True, density=2700.0)


@case
def continuous_joints_that_mimic() -> float:
    mimic = '<mimic joint="j0" multiplier="-0.5"/>'
    return chain([_MASS] * 3, [("continuous", ""), ("continuous", mimic)]).model.nv


@case
def gripper_that_mimics() -> float:
    rules = [f'<mimic joint="j0" multiplier="{ratio}"/>' for ratio in (1, -1, 1, -1, 1)]
    return chain([_MASS] * 7, [("revolute", rule) for rule in ("", *rules)]).model.nv


@case
def links_without_masses() -> float:
    shape = '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
    return float(chain([_MASS, shape], [("revolute", "")]).model.inertias[1].mass)


@case
def part_used_twice() -> float:
    from OCP.BRep import BRep_Builder
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS_Compound

    builder, both, part = BRep_Builder(), TopoDS_Compound(), BRepPrimAPI_MakeBox(1, 2, 3).Shape()
    builder.MakeCompound(both)
    for x in (0.0, 10.0):
        move = gp_Trsf()
        move.SetTranslation(gp_Vec(x, 0.0, 0.0))
        builder.Add(both, part.Moved(TopLoc_Location(move)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "twice.step"
        writer = STEPControl_Writer()
        writer.Transfer(both, STEPControl_AsIs)
        writer.Write(str(path))
        shell = sp.Shell.from_file(path)
    corners = np.asarray(shell.vertices)[shell.triangles]
    return float(np.linalg.det(corners).sum() / 6.0 / 6e-9)


@case
def bytes_after_an_stl() -> float:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.stl"
        path.write_bytes(binary_stl(b"part", b"\0" * 17))
        return sp.Shell.from_file(path, unit="m").num_elements
