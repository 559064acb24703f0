"""Preston's law: grooves against their closed form, volumes against force, slip and time."""

import dataclasses

import coal
import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.patches import wear_maps
from sphshell_pin.patches.placed import PlacedPatches
from sphshell_pin.patches.sampling import divide
from sphshell_pin.patches.wear import deposit, strokes_of
from tests.patches.scenes import plate, preston, slide

COEFFICIENT = 1e-12


@pytest.fixture(scope="module")
def slid():
    return slide()


def groove(worn, where, width=2e-4):
    """Places y across (k,) and depths of the pieces about x = where."""
    chosen = np.abs(worn.points[:, 0] - where) < width
    return worn.points[chosen, 1], worn.depth[chosen]


def test_a_straight_pass(slid):
    (worn,) = wear_maps(slid, COEFFICIENT)
    a, p0 = slid.patches["half_axes"].mean(), slid.patches["peak_pressure"].mean()
    y, depth = groove(worn, -0.005)
    expected = COEFFICIENT * np.pi / 2 * p0 * np.maximum(0.0, a * a - y * y) / a
    assert len(y) > 50
    assert np.abs(depth - expected).max() < 0.01 * expected.max()


@pytest.mark.parametrize("record_dt", [1e-2, 5e-3])
def test_strokes_are_smooth_however_far_apart_rows_are(record_dt):
    # Up to 2 half axes from row to row.
    (worn,) = wear_maps(slide(record_dt=record_dt), COEFFICIENT, resolution=1e-4)
    along = np.abs(worn.points[:, 1]) < 1e-4
    middle = along & (worn.points[:, 0] > -0.008) & (worn.points[:, 0] < -0.002)
    depth = worn.depth[middle]
    assert np.ptp(depth) < 0.025 * depth.mean()  # y is not quite the same of all


@pytest.mark.parametrize("resolution", [5e-5, 2e-4, 1e-3, 5e-3])
def test_volumes_do_not_depend_on_the_resolution(slid, resolution):
    (worn,) = wear_maps(slid, COEFFICIENT, resolution=resolution)
    assert worn.volume == pytest.approx(preston(slid, COEFFICIENT), rel=1e-12)
    assert (worn.unresolved > 0.0) == (resolution > 2e-3)


def test_volume_is_the_work_of_friction():
    # The audit integrates it over all steps: friction x slip = mu x force x slip.
    friction = sp.CoulombFriction(0.3, 0.3, v_static=1e-4, v_dynamic=1e-3)
    result = slide(friction=friction, duration=0.04, record_dt=2e-4)
    (worn,) = wear_maps(result, COEFFICIENT, resolution=5e-4)
    work = result.energy.friction_loss[-1] / 0.3
    assert worn.volume == pytest.approx(COEFFICIENT * work, rel=1e-3)


def ellipses(x, angles, a=2e-3, b=1e-3, force=10.0):
    """One contact with a patch at each x (k,), turned by angles (k,), that slips at 0.2 m/s."""
    n, zero = len(x), 0.0 * x
    return PlacedPatches(
        row=np.arange(n),
        pair=np.zeros(n, dtype=np.int64),
        contact_id=np.zeros(n, dtype=np.int64),
        points=np.stack([x, zero, zero], axis=1),
        normals=np.stack([zero, zero, zero + 1.0], axis=1),
        axes=np.stack([np.cos(angles), np.sin(angles), zero], axis=1),
        half_axes=np.tile([a, b], (n, 1)),
        force=np.full(n, force),
        slip=np.full(n, 0.2),
        element=np.zeros(n, dtype=np.int64),
    )


@pytest.mark.parametrize("angle", [0.0, 0.6, np.pi / 2])
def test_an_elliptical_patch_in_any_direction(angle):
    """Depth = k p0 (pi / 2) l (1 - (d / w)^2), half length l and half width w along the path."""
    a, b, force = 2e-3, 1e-3, 10.0
    t = np.linspace(0.0, 0.1, 11)
    patches = ellipses(-0.01 + 0.2 * t, np.full(11, angle), a, b, force)
    patches.axes[::2] *= -1
    shell = plate(0.02)
    samples = divide(shell, patches.points, 1.2 * a, 1e-4, curved=False)
    depth, lost = deposit(samples, patches, strokes_of(t, patches), shell)
    assert lost == 0.0
    # Half width of the ellipse across the path, and half chord along it in its middle.
    w = np.hypot(a * np.sin(angle), b * np.cos(angle))
    length = a * b / w
    p0 = 1.5 * force / (np.pi * a * b)
    chosen = np.abs(samples.points[:, 0]) < 5e-4
    y = samples.points[chosen, 1]
    expected = p0 * np.pi / 2 * length * np.maximum(0.0, 1.0 - (y / w) ** 2)
    assert np.abs(depth[chosen] - expected).max() < 0.01 * expected.max()
    assert depth @ samples.areas == pytest.approx(force * 0.2 * 0.1, rel=1e-12)


def test_a_stroke_back_removes_what_the_stroke_there_does():
    """Along a path on which the ellipse turns, too."""
    shell, t = plate(0.02), np.linspace(0.0, 0.02, 3)
    x, angles = np.array([-0.002, 0.0, 0.002]), np.array([0.0, 0.5, 1.1])
    there, back = ellipses(x, angles), ellipses(x[::-1], angles[::-1])
    samples = divide(shell, there.points, 2.4e-3, 2e-4, curved=False)
    removed, again = (deposit(samples, k, strokes_of(t, k), shell)[0] for k in (there, back))
    assert removed.max() > 0
    assert np.abs(again - removed).max() < 1e-6 * removed.max()


def test_a_contact_within_the_run_does_the_work_of_the_trapezoid_rule():
    """Force times slip is nothing at the rows before its first and after its last."""
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.5, 2.0, 9))
    patches = ellipses(np.linspace(-0.01, 0.01, 6), np.zeros(6))
    row, force = np.array([1, 2, 3, 5, 7, 8]), rng.uniform(1.0, 9.0, 6)
    patches = dataclasses.replace(
        patches, row=row, force=force, contact_id=np.array([4, 4, 4, 5, 6, 6])
    )
    strokes = strokes_of(t, patches)
    power = np.zeros(9)
    power[row] = 0.2 * force
    work = (0.5 * (strokes.begin + strokes.end) * strokes.time).sum()
    assert work == pytest.approx(np.trapezoid(power, t), rel=1e-12)


def test_pieces_cover_what_is_near_and_nothing_twice():
    shell = plate(0.05, 3)
    places = np.array([[0.0, 0.0, 0.0], [0.02, 0.01, 0.0]])
    samples = divide(shell, places, 5e-3, 5e-4, curved=False)
    assert np.linalg.norm(np.diff(samples.corners, axis=1), axis=2).max() <= 5e-4
    assert (samples.normals[:, 2] > 0.999).all()
    grid = np.round(samples.points / 1e-7).astype(np.int64)
    assert len(np.unique(grid, axis=0)) == len(grid)
    near = np.linalg.norm(samples.points - places[0], axis=1) < 5e-3
    assert samples.areas[near].sum() == pytest.approx(np.pi * 25e-6, rel=0.02)


def test_curved_elements_are_worn_where_they_are():
    radius = 0.03
    ball = sp.Shell.from_geometry(coal.Sphere(radius), segments=16)
    top = np.array([[0.0, 0.0, radius]])
    samples = divide(ball, top, 5e-3, 5e-4, curved=True)
    flat = divide(ball, top, 5e-3, 5e-4, curved=False)
    away = np.abs(np.linalg.norm(samples.corners, axis=2) - radius).max()
    assert away < 0.1 * np.abs(np.linalg.norm(flat.corners, axis=2) - radius).max()


def test_mistakes(slid):
    with pytest.raises(InvalidParameter, match="coefficient"):
        wear_maps(slid, 0.0)
    with pytest.raises(InvalidParameter, match="larger one"):
        wear_maps(slid, 1e-12, resolution=1e-6)
