"""Patches and taxels of an elastic foundation: by its pressure, not by an ellipse."""

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.patches import ShellTaxels, TaxelGrid
from tests.patches.scenes import RADIUS, plate, slider, total_force

KAPPA = 2e9  # modulus over thickness [Pa/m]
LAW = sp.FoundationLaw(1e7, 5e-3)
DEPTH = 4e-4


def run(shell=None, duration=0.05, q0=(-0.005, 0.0, RADIUS - DEPTH), method=None):
    """Slide a ball that is too heavy for its depth to change much, without gravity."""
    model = slider(mass=1e4)
    model.gravity.linear[:] = 0.0
    scene = sp.Scene(model)
    scene.add_contact(
        sp.Sphere(RADIUS, "ball"), shell or plate(), law=LAW, name="tip", method=method
    )
    return sp.Simulation(scene, sp.Adaptive()).run(
        q0, [0.2, 0.0, 0.0], duration, record_dt=1e-3, record=("patch",)
    )


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
    away = np.arccos(-grid.corners()[..., 2])
    nearest = np.minimum(
        np.minimum(away[1:, 1:], away[:-1, 1:]), np.minimum(away[1:, :-1], away[:-1, :-1])
    )
    assert images.forces[0][nearest > np.arccos(1 - DEPTH / RADIUS)].sum() == 0.0
    np.testing.assert_allclose(
        images.forces[0], images.forces[0][::-1, ::-1], atol=0.02 * images.forces[0].max()
    )


def test_at_a_crease_each_wall_takes_its_own():
    valley = plate(0.03, 2, height=lambda x, y: 0.5 * abs(x))
    slope = np.arctan(0.5)
    q0 = (0.0, 0.0, (RADIUS - DEPTH) / np.cos(slope))
    result = run(valley, duration=2e-3, q0=q0, method="facets")
    assert (np.bincount(result.contacts.row) == 2).all()
    elements = ShellTaxels("tip").images(result)
    force = total_force(result)
    np.testing.assert_allclose(elements.forces.sum(axis=1), force, rtol=1e-12)
    left, right = elements.forces[0].reshape(2, 2).sum(axis=0)
    assert left == pytest.approx(right, rel=1e-6)
