"""Patches and taxels of an elastic foundation: by its pressure, not by an ellipse."""

import coal
import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.patches import ShellTaxels, TaxelGrid
from sphshell_pin.patches.foundation import divide
from tests.patches.scenes import RADIUS, plate, slider, total_force

KAPPA = 2e9  # modulus over thickness [Pa/m]
LAW = sp.FoundationLaw(1e7, 5e-3)
DEPTH = 4e-4


def run(shell=None, duration=0.05, q0=(-0.005, 0.0, RADIUS - DEPTH), method=None):
    """Slide a ball that is too heavy for its depth to change much, without gravity."""
    model = slider(mass=1e4)
    model.gravity.linear[:] = 0.0
    scene = sp.Scene(model)
    pair = sp.Sphere(RADIUS, "ball"), shell or plate()
    scene.add_contact(*pair, law=LAW, name="tip", method=method)
    simulation, rows = sp.Simulation(scene, sp.Adaptive()), {"record_dt": 1e-3}
    return simulation.run(q0, [0.2, 0.0, 0.0], duration, record=("patch",), **rows)


@pytest.fixture(scope="module")
def slid():
    return run(duration=1e-2)


def test_a_patch_on_a_plane_is_the_overlap(slid):
    patches, depth = slid.patches, slid.contacts.depth
    a = np.sqrt(2 * RADIUS * depth - depth**2)
    np.testing.assert_allclose(patches["half_axes"], np.stack([a, a], axis=1), rtol=1e-6)
    force = total_force(slid)
    np.testing.assert_allclose(patches["mean_pressure"], force / (np.pi * a * a), rtol=1e-6)
    peak = KAPPA * depth * (2 * RADIUS - depth) / (2 * (RADIUS - depth))
    np.testing.assert_allclose(patches["peak_pressure"], peak, rtol=0.02)


def test_taxels_add_up(slid):
    grid = TaxelGrid("tip", (12, 12), axis=(0, 0, -1), up=(0, 1, 0), extent=(0.8, 0.8))
    images = grid.images(slid)
    force = total_force(slid)
    np.testing.assert_allclose(images.forces.sum(axis=(1, 2)) + images.outside, force, rtol=1e-12)
    assert np.abs(images.outside).max() < 1e-12 * force.max()
    elements = ShellTaxels("tip").images(slid)
    np.testing.assert_allclose(elements.forces.sum(axis=1), force, rtol=1e-12)
    # The overlap reaches over 16.3 degrees about the axis, and is the same on all sides.
    away, first = np.arccos(-grid.corners()[..., 2]), images.forces[0]
    nearest = np.lib.stride_tricks.sliding_window_view(away, (2, 2)).min(axis=(2, 3))
    assert first[nearest > np.arccos(1 - DEPTH / RADIUS)].sum() == 0.0
    np.testing.assert_allclose(first, first[::-1, ::-1], atol=0.02 * first.max())


def test_at_a_crease_each_wall_takes_its_own():
    valley = plate(0.03, 2, height=lambda x, y: 0.5 * abs(x))
    slope = np.arctan(0.5)
    q0 = (0.0, 0.0, (RADIUS - DEPTH) / np.cos(slope))
    result = run(valley, duration=2e-3, q0=q0, method="facets")
    assert (np.bincount(result.contacts.row) == 2).all()
    elements = ShellTaxels("tip").images(result)
    np.testing.assert_allclose(elements.forces.sum(axis=1), total_force(result), rtol=1e-12)
    left, right = elements.forces[0].reshape(2, 2).sum(axis=0)
    assert left == pytest.approx(right, rel=1e-6)


def test_pieces_cover_what_is_near_and_nothing_twice():
    places = np.array([[0.0, 0.0, 0.0], [0.02, 0.01, 0.0]])
    samples = divide(plate(0.05, 3), places, 5e-3, 5e-4, curved=False)
    assert samples.areas.max() <= 25e-8
    grid = np.round(samples.points / 1e-7).astype(np.int64)
    assert len(np.unique(grid, axis=0)) == len(grid)
    near = np.linalg.norm(samples.points - places[0], axis=1) < 5e-3
    assert samples.areas[near].sum() == pytest.approx(np.pi * 25e-6, rel=0.02)


def test_pieces_of_curved_elements_are_on_them():
    radius = 0.03
    ball = sp.Shell.from_geometry(coal.Sphere(radius), segments=16)
    top = np.array([[0.0, 0.0, radius]])
    curved, flat = (divide(ball, top, 5e-3, 5e-4, curved=one) for one in (True, False))
    away = [np.abs(np.linalg.norm(one.points, axis=1) - radius).max() for one in (curved, flat)]
    assert away[0] < 0.1 * away[1]
