"""Reports about surfaces: distances, depths, holes, units, files of other programs."""

import tempfile
from pathlib import Path

import numpy as np

import sphshell_pin as sp
from sphshell_pin import robots
from tests.meshes import cube
from tests.public_cases import case
from tests.public_cases.shapes import binary_stl, terrain

HEIGHT = 0.2


@case
def deeper_than_half() -> float:
    box = sp.Shell(*cube(), side="outside")
    return float(box.contacts([0, 0, 0.5 + 0.005 - 0.009], 0.005).depth.max())


@case
def above_a_terrain() -> float:
    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return HEIGHT * np.sin(3 * x) * np.cos(2 * y)

    shell = terrain(40, 1.0, height)
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-0.8, 0.8, (2, 2000))
    above = rng.uniform(0.02, 0.5, 2000)
    found = shell.closest_points(np.stack((x, y, height(x, y) + above), axis=1)).distances
    # The slope is at most 3 HEIGHT: so much shorter than the vertical one may the distance be.
    least = above / np.hypot(1.0, 3 * HEIGHT) - 1e-3
    return int(np.sum((found < least) | (found > above + 1e-3)))


def bored_plate(suffix: str) -> sp.Shell:
    """Return a plate of 20 mm with a bore of 10 mm, from a CAD file or its STL."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.StlAPI import StlAPI_Writer

    from tests.parts import occ
    from tests.shell.cad_shapes import write_step

    plate = occ.box((-20, -20, -10), (20, 20, 10))
    plate = occ.cut(plate, occ.cylinder(5.0, 30.0, (0, 0, -15)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"plate.{suffix}"
        if suffix == "step":
            return sp.Shell.from_file(write_step(path, ("plate", plate)))
        BRepMesh_IncrementalMesh(plate, 0.1, False, 0.5)
        StlAPI_Writer().Write(plate, str(path))
        return sp.Shell.from_file(path, unit="mm")


def deepest_in_bore(suffix: str, gap: float) -> float:
    shell = bored_plate(suffix)
    found = [shell.contacts([0, 0, z], 0.005 - gap) for z in np.linspace(-0.008, 0.008, 9)]
    return max(float(one.depth.max(initial=0.0)) for one in found)


@case
def through_a_round_hole() -> float:
    return deepest_in_bore("step", 1e-5)


@case
def through_a_round_hole_of_triangles() -> float:
    return deepest_in_bore("stl", 1e-5)


@case
def too_wide_for_a_round_hole() -> float:
    return deepest_in_bore("stl", -1e-5)


@case
def mirrored_mesh() -> float:
    link = (
        '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
        'ixz="0" iyz="0"/></inertial>{}</link>'
    )
    mesh = '<collision><geometry><mesh filename="part.stl" scale="1 -1 1"/></geometry></collision>'
    joint = (
        '<joint name="j" type="prismatic"><parent link="base"/><child link="part"/><axis '
        'xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    )
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "part.stl").write_bytes(binary_stl(b"part"))
        robot = Path(folder) / "mirrored.urdf"
        links = link.format("base", "") + link.format("part", mesh)
        robot.write_text(f'<robot name="mirrored">{links}{joint}</robot>', encoding="utf-8")
        geometry = robots.load_file(robot).collision_model.geometryObjects[0]
        shell = sp.Shell.from_geometry(geometry, side="outside")
    return float(shell.contacts([0.02, -0.04, -0.009], 0.01).depth.max())


@case
def units_of_a_step_file() -> float:
    from tests.shell.cad_shapes import box, write_step

    cube, sides = ("cube", box(25.4, 25.4, 25.4)), []
    with tempfile.TemporaryDirectory() as folder:
        for unit in ("INCH", "M", "FT", "UM", "MM"):
            path = write_step(Path(folder) / f"{unit}.step", cube, unit=unit)
            sides += list(np.ptp(sp.Shell.from_file(path).vertices, axis=0))
    return float(max(sides, key=lambda side: abs(side - 0.0254)))


@case
def binary_stl_called_solid() -> float:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.stl"
        path.write_bytes(binary_stl(b"solid exported by a CAD program"))
        return sp.Shell.from_file(path, unit="m").num_elements
