"""Taxels: sums are exact, shares are those of Hertz's pressure, images move with the body."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter, NameNotFound, ResultError
from sphshell_pin.patches import ShellTaxels, TaxelGrid
from sphshell_pin.patches.placed import load_in_polygons, pressure
from sphshell_pin.plot.taxels import plot_taxels
from tests.command import succeed
from tests.patches.scenes import LAW, RADIUS, plate, pressed, slide, slider, total_force
from tests.scenario.files import DROP, write

DOWN = (0.0, 0.0, -1.0)


def summed(polygon, n=1500):
    """The load in a convex polygon, by the midpoint rule."""
    at = (np.arange(n) + 0.5) / n * 2 - 1
    u = np.stack(np.meshgrid(at, at), axis=-1)
    inside = np.ones((n, n), dtype=bool)
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        inside &= (b - a)[0] * (u[..., 1] - a[1]) - (b - a)[1] * (u[..., 0] - a[0]) >= 0
    return (pressure(u) * inside).sum() * (2 / n) ** 2 / (2 * np.pi / 3)


@pytest.mark.parametrize("seed", range(4))
def test_loads_in_triangles(seed):
    corners = np.random.default_rng(seed).normal(size=(3, 2))
    side, other = corners[1] - corners[0], corners[2] - corners[0]
    if side[0] * other[1] - side[1] * other[0] < 0:
        corners = corners[::-1]
    assert load_in_polygons(corners) == pytest.approx(summed(corners), abs=1e-4)
    assert load_in_polygons(corners[::-1]) == pytest.approx(-load_in_polygons(corners), abs=1e-15)


@pytest.fixture(scope="module")
def slid():
    return slide()


@pytest.mark.parametrize(
    "grid",
    [
        TaxelGrid("tip", (8, 8), axis=DOWN, extent=(0.5, 0.5)),
        TaxelGrid("tip", (16, 32), extent=(np.pi, 2 * np.pi)),  # all of the sphere, a pole below
        TaxelGrid("tip", (1, 1), axis=(1, 0, 0), extent=(np.pi, 2 * np.pi)),
        TaxelGrid("tip", (5, 9), axis=(0.1, 0.07, -1), up=(1, 1, 0), extent=(0.5, 0.7)),
    ],
)
def test_forces_add_up(slid, grid):
    images, force = grid.images(slid), total_force(slid)
    assert images.forces.shape == (51, *grid.shape)
    found = images.forces.sum(axis=(1, 2)) + images.outside
    np.testing.assert_allclose(found, force, rtol=1e-12, atol=0)
    # All of the patch is on these grids: the integrals themselves must add up.
    assert np.abs(images.outside).max() < 1e-12 * force.max()
    assert images.forces.min() > -1e-12 * force.max()


def test_shares_are_those_of_the_pressure(slid):
    grid = TaxelGrid("tip", (5, 9), axis=(0.1, 0.07, -1), up=(1, 1, 0), extent=(0.3, 0.3))
    row, n = 10, 1200
    images = grid.images(slid)
    a = slid.patches["half_axes"][row, 0]
    at = (np.arange(n) + 0.5) / n * 2 - 1
    x, y = np.meshgrid(at, at)
    load = np.sqrt(np.maximum(0.0, 1 - x * x - y * y))
    load *= total_force(slid)[row] / load.sum()
    arc = np.hypot(x, y) * a / RADIUS
    sides = np.sinc(arc / np.pi) * a / RADIUS
    place = np.stack([x * sides, y * sides, -np.cos(arc)], axis=-1)
    frame = np.array([(0.1, 0.07, -1.0), (1.0, 1.0, 0.0)])
    axis = frame[0] / np.linalg.norm(frame[0])
    up = frame[1] - axis * (axis @ frame[1])
    up /= np.linalg.norm(up)
    latitude = np.arcsin(place @ up)
    longitude = np.arctan2(place @ np.cross(up, axis), place @ axis)
    edges, places = [np.linspace(-0.15, 0.15, n) for n in (6, 10)], (latitude, longitude)
    expected = np.histogram2d(*map(np.ravel, places), edges, weights=load.ravel())[0]
    assert images.outside[row] > 1.0  # part of the patch lies beside the grid
    np.testing.assert_allclose(images.forces[row], expected, atol=2e-3 * expected.max())


def test_images_are_those_of_the_turned_body():
    turned = pin.SE3(pin.utils.rotate("x", 2.0) @ pin.utils.rotate("z", 0.7), np.zeros(3))
    scene = sp.Scene(slider(placement=turned))
    scene.add_contact(sp.Sphere(RADIUS, "ball"), plate(), law=LAW, name="tip")
    at = turned.actInv(np.array([0.0, 0.0, RADIUS - pressed()]))
    result = sp.Simulation(scene).run(at, duration=1e-4, record=("patch",))
    axis = turned.rotation.T @ np.array(DOWN)
    images = TaxelGrid("tip", (3, 3), axis=tuple(axis), extent=(0.1, 0.1)).images(result)
    force = images.forces[0]
    assert force[1, 1] == force.max() > 0.1
    np.testing.assert_allclose(force, force[::-1, ::-1], rtol=1e-9)


def test_both_of_two_spheres_feel_it():
    model = slider()
    model.addFrame(pin.Frame("ground", 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    scene = sp.Scene(model)
    scene.add_contact(sp.Sphere(RADIUS, "ball"), sp.Sphere(0.02, "ground"), law=LAW, name="tip")
    low = plate(height=lambda x, y: -0.03)
    scene.add_contact(sp.Sphere(0.02, "ground"), low, law=LAW, name="below")
    q0 = [0.0, 0.0, 0.03 - pressed()]
    result = sp.Simulation(scene).run(q0, duration=1e-4, record=("patch",))
    own = np.asarray(result.contacts.pair) == 0
    force = result.contacts.normal_force[own][0]
    above = TaxelGrid("tip", (4, 4), axis=DOWN, extent=(0.8, 0.8)).images(result)
    below = TaxelGrid("below", (4, 4), axis=(0, 0, 1), extent=(0.8, 0.8)).images(result)
    assert above.forces[0].sum() == pytest.approx(force, rel=1e-12)
    assert below.forces[0].sum() == pytest.approx(force, rel=1e-12)


def test_elements_share_a_patch():
    result = slide(plate(0.02, 40))
    images = ShellTaxels("tip").images(result)
    force = total_force(result)
    assert images.forces.shape == (51, 1600)
    np.testing.assert_allclose(images.forces.sum(axis=1) + images.outside, force, rtol=1e-12)
    assert np.abs(images.outside).max() < 1e-12 * force.max()
    # Elements of 1 mm, half axes a little less: the first contact is a corner of four.
    np.testing.assert_allclose(np.sort(images.forces[0])[-4:], force[0] / 4, rtol=1e-9)


def test_what_lies_beyond_a_border_is_outside():
    shell = plate(0.01)  # the ball starts on its border
    result = slide(shell, duration=1e-4)
    images = ShellTaxels("tip").images(result)
    assert images.outside[0] == pytest.approx(0.5 * total_force(result)[0], rel=1e-6)


def test_mistakes(slid):
    with pytest.raises(InvalidParameter, match="shape"):
        TaxelGrid("tip", (0, 4))
    with pytest.raises(InvalidParameter, match="extent"):
        TaxelGrid("tip", (4, 4), extent=(4.0, 1.0))
    with pytest.raises(InvalidParameter, match="parallel"):
        TaxelGrid("tip", (4, 4), axis=(0, 0, 1), up=(0, 0, 2))
    with pytest.raises(NameNotFound, match="tip"):
        TaxelGrid("finger", (4, 4)).images(slid)
    with pytest.raises(ResultError, match="no CAD faces"):
        ShellTaxels("tip", "faces").images(slid)


def test_images_of_taxels_have_latitude_upwards(slid):
    grid = TaxelGrid("tip", (4, 6), axis=DOWN, up=(0, 1, 0), extent=(0.4, 0.6))
    figure = plot_taxels(grid.images(slid), [0, 10])
    shown = figure.axes[0].images[0]
    assert shown.origin == "lower"
    assert shown.get_array().shape == (4, 6)
    with pytest.raises(InvalidParameter, match="TaxelGrid"):
        plot_taxels(ShellTaxels("tip").images(slid), [0])


def test_a_scenario_writes_patches_and_taxels(tmp_path):
    text = DROP.replace(
        "[run]", 'friction = { type = "coulomb", mu_static = 0.3 }\n[run]\nrecord = ["patch"]'
    ).replace("[robot]", "[robot]\nspeed = { root_joint = [0.2, 0, 0, 0, 0, 0] }")
    out = tmp_path / "out"
    succeed("run", write(tmp_path, text), "--out", out)
    result = sp.Result.load(out / "run.npz")
    assert len(result.patches) == len(result.contacts) > 0
    assert "pressure of patches" in (out / "recording.html").read_text(encoding="utf-8")
    # A loaded result finds the scene of its scenario.
    images = sp.TaxelGrid("ball-plate", (4, 6), axis=DOWN).images(result)
    assert images.forces.shape == (len(result.t), 4, 6)
    felt = images.forces.sum(axis=(1, 2)) + images.outside
    np.testing.assert_allclose(felt, total_force(result), rtol=1e-12, atol=1e-300)


def test_a_run_without_patches_has_no_taxels(tmp_path):
    out = tmp_path / "out"
    succeed("run", write(tmp_path), "--out", out, "--no-recording")
    with pytest.raises(ResultError, match="has no patches"):
        sp.TaxelGrid("ball-plate", (4, 6)).images(sp.Result.load(out / "run.npz"))
