"""Each solid of a CAD file has its own outside; in a mesh, closed components may be cavities."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sphshell_pin import Shell
from sphshell_pin.shell import clean
from sphshell_pin.shell.cleaned import CleanedSurface
from tests import meshes

from .surfaces import CUBE, CUBE_QUADS, expect, joined, signed_volume

occ = pytest.importorskip("tests.parts.occ", exc_type=ImportError)
shapes = pytest.importorskip("tests.shell.cad_shapes", exc_type=ImportError)

RADIUS = 5.0  # of rods [mm]


def nut(height: float, reach: float = 9.0, bore: float = RADIUS) -> Any:
    corners = reach * np.exp(1j * np.arange(6) * np.pi / 3)
    hexagon = occ.extruded(np.c_[corners.real, corners.imag], 6.0)
    return occ.moved(occ.cut(hexagon, occ.cylinder(bore, 8.0, (0, 0, -1))), (0, 0, height))


def washer(height: float, outer: float = 9.0) -> Any:
    solid = occ.cylinder(outer, 2.0, (0, 0, height))
    return occ.cut(solid, occ.cylinder(RADIUS, 4.0, (0, 0, height - 1.0)))


def rod(length: float = 40.0) -> Any:
    return occ.cylinder(RADIUS, length)


def hollow(outer: float, inner: float) -> Any:
    return occ.cut(occ.ball(outer), occ.ball(inner))


def mirrored(solid: Any) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf

    mirror = gp_Trsf()
    mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)))
    return BRepBuilderAPI_Transform(solid, mirror, True).Shape()


ASSEMBLIES = {
    "nuts on a rod": lambda: [rod(), nut(10.0), nut(34.0)],
    "washers face on face": lambda: [washer(0.0), washer(2.0), washer(4.0, 7.0)],
    "bush between rod and housing": lambda: [
        rod(),
        occ.cut(occ.cylinder(5.2, 40.0), rod()),
        occ.cut(occ.box((-20, -20, 0), (20, 20, 40)), occ.cylinder(5.2, 40.0)),
    ],
    "ball in a hollow ball": lambda: [hollow(20.0, 12.0), occ.ball(5.0)],
    "shell in a shell in contact": lambda: [hollow(20.0, 12.0), hollow(12.0, 6.0)],
    "void at the wall": lambda: [occ.cut(occ.ball(20.0), occ.ball(6.0, (13.9, 0, 0)))],
    "mirrored": lambda: [rod(), mirrored(nut(10.0))],
    "reversed": lambda: [rod(), nut(10.0).Reversed(), hollow(3.0, 2.0).Reversed()],
}
CAVITIES = {
    "ball in a hollow ball": 1,
    "shell in a shell in contact": 2,
    "void at the wall": 1,
    "reversed": 1,
}


def surface_of(solids: list[Any], folder: Path) -> CleanedSurface:
    """Read, tessellate and clean in this process."""
    from sphshell_pin.shell.cad.model import compound
    from sphshell_pin.shell.cad.options import CadOptions
    from sphshell_pin.shell.cad.surface import load_cad
    from sphshell_pin.shell.cleaning import clean_surface

    path = shapes.write_brep(folder / "assembly.brep", compound(solids))
    return clean_surface(load_cad(path, "mm", CadOptions()).polygons())


@pytest.mark.parametrize("name", ASSEMBLIES)
def test_every_solid_of_a_cad_file_has_its_own_outside(name: str, tmp_path: Path) -> None:
    solids = ASSEMBLIES[name]()
    surface = surface_of(solids, tmp_path)
    volume = 1e-9 * sum(abs(occ.area_and_volume(solid)[1]) for solid in solids)
    assert signed_volume(surface) == pytest.approx(volume, rel=0.01)
    cavities = CAVITIES.get(name, 0)
    closed = len(solids) + cavities
    # Nor are the normals turned away from their elements.
    figures = {"components": closed, "closed_components": closed, "opposing_normals": 0}
    volume = signed_volume(surface)
    expect(surface.health, ok=True, cavities=cavities, volume=volume, **figures)


@pytest.mark.parametrize("name", ["nuts on a rod", "ball in a hollow ball", "void at the wall"])
def test_nor_does_a_mesh_of_them_lose_it(name: str, tmp_path: Path) -> None:
    solids = ASSEMBLIES[name]()[:2]
    surface = surface_of(solids, tmp_path)
    health = clean(surface.vertices, surface.triangles).health
    volume = 1e-9 * sum(occ.area_and_volume(solid)[1] for solid in solids)
    assert health.volume == pytest.approx(volume, rel=0.01)
    expect(health, ok=True, cavities=CAVITIES.get(name, 0))


def test_a_sphere_on_the_joint_of_two_solids_touches_one_surface(tmp_path: Path) -> None:
    blocks = [occ.box((-20, -10, -10), (0, 10, 0)), occ.box((0, -10, -10), (20, 10, 0))]
    shell = Shell.from_surface(surface_of(blocks, tmp_path), np.radians(30.0), "outside")
    assert shell.health.ok
    assert shell.health.volume == pytest.approx(8e-6)
    for method in ("smooth", "facets"):
        for x in (-2e-3, -1e-5, 0.0, 1e-5, 1e-3):
            found = shell.contacts([x, 1e-3, 4.9e-3], 5e-3, method).terms
            force = (found.weight * found.depth) @ found.normal
            assert force == pytest.approx([0.0, 0.0, 1e-4], abs=1e-12)


def test_solids_that_touch_in_a_vertex_are_not_pinched(tmp_path: Path) -> None:
    blocks = [occ.box((0, 0, 0), (5, 5, 5)), occ.box((5, 5, 5), (9, 9, 9))]
    expect(surface_of(blocks, tmp_path).health, ok=True, elements=24)


def tube(outer: float, inner: float, low: float, high: float, turn: float) -> Any:
    """A prism of 24 sides about z with a hole; none if `inner` is 0."""
    angle = turn + 2 * np.pi * np.arange(24) / 24
    ring = np.c_[np.cos(angle), np.sin(angle)]
    ends = [(outer, low), (outer, high), (inner, high), (inner, low)]
    rails = [np.c_[radius * ring, np.full(24, z)] for radius, z in ends]
    if inner == 0.0:
        points, band = meshes.ribbon(rails[:2], closed=True)
        return points, [*band.tolist(), range(23, -1, -1), range(24, 48)]
    return meshes.ribbon([*rails, rails[0]], closed=True)


def test_a_ring_on_a_rod_is_no_cavity_however_their_facets_lie() -> None:
    """Facets of the bore reach into the rod, and those of the rod into the ring."""
    rod = tube(1.0, 0.0, 0.0, 10.0, 0.0)
    for turn, high, outer in itertools.product((0.0, 0.05, 0.1), (7.0, 10.0), (1.2, 3.0)):
        surface = clean(*joined(rod, tube(outer, 1.0, 5.0, high, turn)))
        assert surface.health.cavities == 0
        if turn:  # else they have vertices in common
            area = 12 * np.sin(np.pi / 12)
            volume = area * (10.0 + (outer**2 - 1.0) * (high - 5.0))
            expect(surface.health, closed_components=2, volume=volume)
            assert signed_volume(surface) == pytest.approx(volume)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_what_is_partly_inside_is_a_solid_and_said(share: float) -> None:
    block = (0.5 * CUBE + np.array([0.26, 0.27, 1.0 - 0.5 * share]), CUBE_QUADS)
    surface = clean(*joined((CUBE, CUBE_QUADS), block))
    expect(surface.health, "partly inside another", cavities=0, overlapping_components=1)
    assert signed_volume(surface) == pytest.approx(1.125)


@pytest.mark.parametrize("wall", [1e-1, 1e-3, 1e-5])
def test_a_thin_walled_tank_has_a_cavity(wall: float) -> None:
    inner = (1.0 - wall) * (CUBE - 0.5) + 0.5
    health = clean(*joined((CUBE, CUBE_QUADS), (inner, CUBE_QUADS))).health
    expect(health, ok=True, cavities=1, volume=1.0 - (1.0 - wall) ** 3)
