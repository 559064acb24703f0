"""Reports about surfaces: distances, depths, holes, units, files of other programs."""

import numpy as np

import sphshell_pin as sp
from sphshell_pin import robots
from tests import urdf
from tests.meshes import cube
from tests.public_cases import case
from tests.public_cases.shapes import INERTIAL, binary_stl, elements_read, folder, terrain

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
    from tests.joints.solids import write_step, write_stl
    from tests.parts import occ

    plate = occ.box((-20, -20, -10), (20, 20, 10))
    plate = occ.cut(plate, occ.cylinder(5.0, 30.0, (0, 0, -15)))
    with folder() as home:
        if suffix == "step":
            return sp.Shell.from_file(write_step(plate, home / "plate.step"))
        return sp.Shell.from_file(write_stl(plate, home / "plate.stl", 0.1, 0.5), unit="mm")


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
    mesh = '<mesh filename="part.stl" scale="1 -1 1"/>'
    with folder() as home:
        (home / "part.stl").write_bytes(binary_stl(b"part"))
        robot = urdf.write(
            home / "mirrored.urdf",
            urdf.link("base", INERTIAL),
            urdf.link("part", INERTIAL, urdf.shape("collision", mesh)),
            urdf.joint("j", "prismatic", "base", "part"),
        )
        geometry = robots.load_file(robot).collision_model.geometryObjects[0]
        shell = sp.Shell.from_geometry(geometry, side="outside")
    return float(shell.contacts([0.02, -0.04, -0.009], 0.01).depth.max())


@case
def units_of_a_step_file() -> float:
    from tests.shell.cad_shapes import box, write_step

    cube, sides = ("cube", box(25.4, 25.4, 25.4)), []
    with folder() as home:
        for unit in ("INCH", "M", "FT", "UM", "MM"):
            path = write_step(home / f"{unit}.step", cube, unit=unit)
            sides += list(np.ptp(sp.Shell.from_file(path).vertices, axis=0))
    return float(max(sides, key=lambda side: abs(side - 0.0254)))


@case
def binary_stl_called_solid() -> float:
    return elements_read(b"solid exported by a CAD program")
