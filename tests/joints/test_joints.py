"""Spheres over every joint of parts: none lost, none counted twice, depths and forces exact."""

import numpy as np
import pytest

import sphshell_pin as sp
from tests.joints import solids
from tests.joints.boxes import BOXES, PLATES, mitred, plate, rounded_box
from tests.joints.running import walk_file, walk_part
from tests.joints.solid_walk import spheres_of
from tests.joints.trimmed import TrimmedSolid
from tests.joints.verdict import MM
from tests.oracle.cad import ExactShape


def parts(sizes) -> list[solids.Part]:
    return [make(*one) for make, some in sizes.items() for one in some]


PARTS = parts(
    {
        solids.disc: [
            *((40.0, 0.2), (40.0, 0.5), (170.0, 3.7), (31.0, 0.89, 3.3e-4), (40.0, 2.0, -1e-2)),
            (100.0, 0.085, -3.7e-5),
        ],
        solids.pocket: [(96.0, 1.2, 0.06), (64.0, 0.49, 0.46)],
        solids.shaft: [(16.0, 4.5, 5.8e-3)],
        solids.ring: [(69.0, 6.5)],
        solids.dome: [(17.0,)],
        solids.cones: [(30.0, 0.3), (25.0, 0.02), (36.0, 0.4, 1.9)],
        solids.d_shaft: [(20.0, 0.1), (17.0, 0.066)],
        solids.slot: [(40.0, 5.0)],
        solids.bar: [(40.0, 1.0, 3.0), (63.0, 0.12, 0.3), (27.0, 0.5, 2.2, 8.6e-4)],
    }
)
MESHED = parts(
    {
        solids.cones: [(30.0, 0.3), (24.0, 0.400742, 0.64)],
        solids.shaft: [(5.2, 2.4, 1e-4), (6.4, 2.1, -1.3e-4)],
        solids.disc: [(80.0, 0.14, 2.2e-5)],
        solids.pocket: [(63.0, 3.3, 0.2), (100.0, 3.7, 1.3), (42.0, 0.18, 2.9)],
    }
)
WALKS = {
    **{part.name: (part.solid, 2000, False) for part in PARTS},
    **{f"STL {part.name}": (part.solid, 2000, True) for part in MESHED},
    **{name: (lambda sides=sides: plate(*sides), 2000, False) for name, sides in PLATES.items()},
    "drafted slot": (lambda: solids.drafted_slot(9.0, 6.0, 12.0, 30.0), 3000, False),
    "STL drafted slot": (lambda: solids.drafted_slot(9.0, 6.0, 12.0, 30.0), 3000, True),
    "tube on an equator": (lambda: solids.tube_on_equator(1.2, 0.8, 4.0), 3000, False),
}


@pytest.mark.parametrize("name", WALKS)
def test_no_sphere_is_lost_or_counted_twice(name, tmp_path):
    """STL files are in single precision; fillets of plates begin to cross, the tube bends on."""
    make, count, stl = WALKS[name]
    path = solids.write_step(make(), tmp_path / "part.step")
    assert walk_file(path, name, count, np.random.default_rng(1), stl).faults == {}


@pytest.mark.parametrize("off", [-2e-7, 2e-7], ids=["cut", "apart"])
def test_planes_of_a_file_may_miss_the_fillets_beside_them(off, tmp_path):
    path = solids.write_step(rounded_box(np.random.default_rng(0)), tmp_path / "box.step")
    solids.shift_planes(path, off)
    verdict = walk_file(path, "box", 4000, np.random.default_rng(1))
    assert verdict.faults == {}


@pytest.mark.parametrize(
    ("part", "height"),
    [(solids.pocket(56.0, 5.1, 0.068), 28.368), (solids.disc(35.0, 0.14, -3.4e-4), 19.86)],
    ids=lambda it: getattr(it, "name", None),
)
def test_none_is_between_faces_that_are_tangent_but_for_rounding(part, height, tmp_path):
    """They cross at 1e-5 rad: a center is beside one of them, or else over their joint."""
    path, rng = tmp_path / "part.stl", np.random.default_rng(0)
    shell = sp.Shell.from_file(solids.write_stl(part.solid(), path, 3e-4 * part.size), unit="mm")
    radius = max(piece.begin[0] for piece in part.pieces)
    away, turn = rng.uniform(1.0, 12.0, 20_000), rng.uniform(0, 2 * np.pi, 20_000)
    level = height + rng.choice([-1, 1], 20_000) * 10 ** rng.uniform(-6, -3, 20_000)
    off = radius + away
    centers = np.stack([off * np.cos(turn), off * np.sin(turn), level], axis=1)
    depths, _ = shell.contacts_batch(centers * MM, (away + 0.01) * MM)
    assert depths.min() > 0


@pytest.mark.parametrize("part", [solids.shaft(6.3, 0.38, 1.9e-3), solids.shaft(9.2, 0.51)])
def test_a_chamfer_is_a_cone_whatever_its_triangles(part, tmp_path):
    """A single strip whose two rims have unequal steps: the axis is that of the shaft beside it."""
    path = solids.write_stl(part.solid(), tmp_path / "part.stl", 3e-4 * part.size)
    kinds = sorted(face.kind for face in sp.Shell.from_file(path, unit="mm").faces)
    assert kinds == ["cone", "cylinder", "cylinder", "plane", "plane", "plane", "torus", "torus"]


@pytest.mark.parametrize("family", [one for one in BOXES if one != "random plate"])
def test_no_contact_is_lost_or_made_up_at_corners(family, tmp_path):
    verdict = walk_part(family, tmp_path, np.random.default_rng(0), most=1000)
    assert verdict.faults == {}


@pytest.mark.parametrize("radii", [(0.38, 3.7), (1.5, 3.4), (2.4, 5.3)])
def test_none_is_lost_where_a_mitre_ends_in_a_plane(radii, tmp_path):
    """In single precision, where both fillets are tangent to it."""
    solid = mitred(*radii)
    shell = sp.Shell.from_file(solids.write_stl(solid, tmp_path / "part.stl", 0.022), unit="mm")
    rng = np.random.default_rng(0)
    for near in (1e-3, 1e-2):
        away = np.c_[rng.uniform(-near, near, (500, 2)), rng.choice([0.03, 0.3, 3.0], 500)]
        depths, _ = shell.contacts_batch(([*radii, 20.0] + away) * MM, (away[:, 2] + 0.01) * MM)
        assert depths.min() > 0


@pytest.mark.parametrize(
    "part", [PARTS[4], PARTS[8], PARTS[12], PARTS[14]], ids=lambda one: one.name
)
def test_the_judge_agrees_with_distances_of_opencascade(part):
    """Beside seams OpenCASCADE misses a few closest points."""
    solid = TrimmedSolid(part.solid())
    centers, radii = spheres_of(solid, 300, np.random.default_rng(0))
    far = ExactShape(part.solid(), meters=1.0).distances(centers)
    found = [one.depths.max() for one in solid.minima(centers, radii)]
    off = np.array(found) - (radii - far)
    assert off.min() > -1e-9
    assert np.mean(off < 1e-9) > 0.98
