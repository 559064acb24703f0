"""The force on curved surfaces: order of convergence, size of the error, one contact per place."""

from functools import cache
from itertools import product

import numpy as np
import pytest

from sphshell_pin import Shell
from sphshell_pin.shell.contact_set import Feature
from tests.contact.helpers import force_sum
from tests.contact.smooth.surfaces import SIDES, SURFACES, can, shell_of, side_of
from tests.studies import mostly_studies
from tests.validation.rattleback import ellipsoid

COUNT = 300
DEPTHS = (0.04, 0.004, 0.0004)


@cache
def measured(name: str, h: float, depth: float, exact: bool):
    """Relative error (COUNT,) of the force vector, angle [deg] (COUNT,), contacts (COUNT,)."""
    shell = shell_of(name, h, exact)
    error, angle, count = np.ones(COUNT), np.zeros(COUNT), np.zeros(COUNT, dtype=int)
    for i, (center, normal) in enumerate(zip(*SURFACES[name].probes(COUNT, depth), strict=True)):
        contacts = shell.contacts(center, 1.0, method="smooth")
        count[i] = len(contacts)
        if len(contacts) == 0:
            continue
        force = force_sum(contacts) / depth**1.5
        error[i] = np.linalg.norm(force - normal)
        angle[i] = np.degrees(np.arctan2(np.linalg.norm(np.cross(force, normal)), force @ normal))
    return error, angle, count


def order(name: str, depth: float, exact: bool) -> float:
    """Slope of the rms error against the mean side, where the error is small against one."""
    rms = np.array([np.sqrt((measured(name, h, depth, exact)[0] ** 2).mean()) for h in SIDES])
    sides = np.array([side_of(name, h) for h in SIDES])
    used = rms < 0.3
    assert used.sum() >= 2, rms
    return float(np.polyfit(np.log(sides[used]), np.log(rms[used]), 1)[0])


@pytest.mark.parametrize(
    ("name", "depth"), mostly_studies(product(SURFACES, DEPTHS), lambda one: one[1] == DEPTHS[0])
)
def test_order_with_exact_normals(name: str, depth: float) -> None:
    assert order(name, depth, exact=True) >= 3.5


@pytest.mark.parametrize("name", SURFACES)
def test_error_with_exact_normals(name: str) -> None:
    error, angle, _ = measured(name, 0.3, 0.04, True)
    assert error.mean() <= 1e-4
    assert error.max() <= 6e-4
    assert np.sqrt((angle**2).mean()) <= 0.005
    assert angle.max() <= 0.02


@pytest.mark.parametrize("depth", DEPTHS[:2])
@pytest.mark.parametrize("name", SURFACES)
def test_order_with_estimated_normals(name: str, depth: float) -> None:
    assert order(name, depth, exact=False) >= 3.0


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("name", SURFACES)
def test_one_contact(name: str, exact: bool) -> None:
    """Never none nor two, unless the surface of the elements is off by nearly the depth."""
    for h in SIDES:
        # In meters: the force goes with depth^1.5, and the probes are but a sample.
        error = 2 * measured(name, h, DEPTHS[0], exact)[0].max() * DEPTHS[0] / 1.5
        for depth in DEPTHS:
            count = measured(name, h, depth, exact)[2]
            assert error > depth / 2 or (count == 1).all(), (h, depth)


def rim_errors(columns: int, rows: int):
    """Errors of the force (n,) over the rim of a can of radius 2, and the mean side."""
    vertices, elements, normals = can(columns, rows)
    shell = Shell(vertices, elements, normals=normals, faces=False)
    rng = np.random.default_rng(columns)
    errors = []
    for _ in range(COUNT):
        turn, tilt = rng.uniform(0, 2 * np.pi), rng.uniform(0.02, np.pi / 2 - 0.02)
        out = np.array([np.cos(turn), np.sin(turn), 0.0])
        normal = np.sin(tilt) * out + [0.0, 0.0, np.cos(tilt)]
        contacts = shell.contacts(2 * out + 0.96 * normal, 1.0, method="smooth")
        assert len(contacts) == 1
        assert contacts.feature[0] in (Feature.EDGE, Feature.VERTEX)
        errors.append(np.linalg.norm(force_sum(contacts) / 0.04**1.5 - normal))
    return np.array(errors)


def test_curved_true_edge() -> None:
    """The rim of a can: a crease between a curved side and a flat lid."""
    coarse, fine = rim_errors(20, 2), rim_errors(40, 4)
    # Twice as curved as the surfaces above.
    assert np.sqrt((fine**2).mean()) <= 3e-4
    assert np.sqrt((fine**2).mean()) <= np.sqrt((coarse**2).mean()) / 2**3.5


def test_a_large_sphere_touches_an_ellipsoid_where_a_plane_would() -> None:
    """Its rows of elements are nearly cylinders: none may replace the normals that were given."""
    axes, radius, depth = np.array([0.2, 0.03, 0.02]), 1000.0, 1e-6
    most = []
    for cells in (35, 70):
        vertices, elements, normals = ellipsoid(cells, (0.2, 0.03, 0.02))
        shell = Shell(vertices, elements, normals=normals)
        away = []
        for tilt in np.linspace(-0.02, 0.02, 201):
            down = np.array([np.sin(tilt), 0.3 * np.sin(3 * tilt), -1.0])
            down /= np.linalg.norm(down)
            lowest = axes**2 * down / np.linalg.norm(axes * down)
            contacts = shell.contacts(lowest + (radius - depth) * down, radius)
            assert len(contacts) == 1
            away.append(np.linalg.norm(contacts.point[0] - lowest))
        most.append(max(away))
    assert most[0] < 2e-6
    assert most[0] / most[1] > 2**2.5
