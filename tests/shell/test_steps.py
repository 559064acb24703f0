"""Planes and belts that are inscribed in round faces: a face is sampled in equal steps.

Shafts and bores with flats, cones with flats through their tip, balls with a belt and rings with a
plane side have all their vertices on one cylinder, cone, sphere or torus.
"""

import numpy as np
import pytest

import sphshell_pin as sp
from tests import meshes
from tests.meshes import random_rotation

RADIUS, LENGTH = 0.005, 0.02


def turned(angles, profile):
    """Return the shell of a closed profile (n, 2) turned by angles (m,)."""
    return single(*meshes.revolved(profile, np.asarray(angles)))


def arc(angles, radius=RADIUS):
    """Points (n, 2) of a circle."""
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def kinds(shell):
    return sorted(face.kind for face in shell.faces)


def angles_with_flats(steps, flats):
    """Angles of a circle in equal steps between flats, (middle, half-angle) each [rad]."""
    out = []
    for (middle, half), (following, other) in zip(flats, [*flats[1:], flats[0]], strict=True):
        turn = (following - other - middle - half) % (2 * np.pi)
        count = int(np.ceil(turn / steps))
        out.append(middle + half + turn / count * np.arange(count + 1))
    return np.concatenate(out) % (2 * np.pi), turn / count


def error(shell, points, true):
    found = shell.closest_points(np.atleast_2d(points))
    return np.abs(np.abs(found.distances) - true).max()


@pytest.mark.parametrize("seed", range(40))
def test_a_flat_on_a_shaft_or_in_a_bore_is_plane(seed):
    rng = np.random.default_rng(seed)
    half = np.radians(rng.uniform(2, 30))
    chord = np.exp(rng.uniform(*np.log([0.005, 0.1]))) * 1e-3
    limit = 2 * np.arccos(1 - chord / RADIUS)
    middle, taper = rng.uniform(0, 2 * np.pi), rng.choice([0.0, 0.2])
    flats = [(middle, half), (middle + np.pi, half)][: rng.integers(1, 3)]
    angles, step = angles_with_flats(limit, flats)
    shell = turned(angles, [(RADIUS * (1 + taper), 0.0), (RADIUS * (1 - taper), LENGTH)])
    # Beside the middle of the flat, outside or inside.
    lean = np.arctan(2 * taper * RADIUS * np.cos(half) / LENGTH)
    normal = np.array([*arc(middle, np.cos(lean)), np.sin(lean)])
    away = 5e-4 * rng.choice([-1, 1])
    on = np.array([*arc(middle, RADIUS * np.cos(half)), LENGTH / 2])
    off = error(shell, on + away * normal, abs(away))
    if 2 * half > 1.02 * step:
        assert off < 1e-9
        assert kinds(shell).count("plane") == len(flats)
    else:
        # No farther off than the facets of a regular step.
        assert off < 1.1 * RADIUS * (1 - np.cos(step / 2))
    # Two flats that turn by more than the crease angle divide the round face.
    rest = [face for face in shell.faces if face.kind != "plane"]
    assert {face.kind for face in rest} == {"cone" if taper else "cylinder"}
    assert len(rest) <= len(flats)
    assert sum(len(face.elements) for face in rest) >= 2 * (len(angles) - len(flats))


@pytest.mark.parametrize("seed", range(10))
def test_a_flat_between_oblique_ends_is_plane(seed):
    """Ends in planes that lean: there the steps are unequal, and none is as wide as the flat."""
    rng = np.random.default_rng(seed)
    half, step = np.radians([rng.uniform(4, 25), rng.uniform(3, 7)])
    count = int(np.ceil((2 * np.pi - 2 * half) / step))
    widths = rng.uniform(0.8, 1.0, count)
    steps = (2 * np.pi - 2 * half) * widths / widths.sum()
    circle = arc(half + np.cumsum([0.0, *steps]))
    lean = rng.uniform(-0.8, 0.8, (2, 2))
    rails = [np.c_[circle, circle @ one + z] for one, z in zip(lean, (0, 4 * LENGTH), strict=True)]
    points, walls = meshes.ribbon(rails, closed=True)
    ends = np.arange(len(points)).reshape(2, -1)
    shell = single(points, [*walls.tolist(), *ends.tolist()])
    wide = 2 * half > 1.3 * steps.max()
    if wide:
        middle = (RADIUS * np.cos(half) + 5e-4, 0.0, 2 * LENGTH)
        assert error(shell, middle, 5e-4) < 1e-8
    assert kinds(shell) == ["cylinder", *["plane"] * (2 + wide)]
    assert not wide or "may be a flat" not in shell.curvature_report().faces


def test_a_flat_that_may_be_a_step_between_oblique_ends_is_named():
    """An oblique cut is sampled in unequal steps: a flat that is a little wider stays round."""
    widths = np.array([1.0, 0.7, 0.6, 0.75, 0.65] * 9)
    for share, named in ((1.0, False), (1.2, True)):
        steps = np.r_[widths, share]
        circle = arc(2 * np.pi * np.cumsum(steps) / steps.sum())
        x, y = circle.T
        rails = [np.c_[circle, 0.5 * x], np.c_[circle, 0.7 * y + 4 * LENGTH]]
        shell = single(*meshes.ribbon(rails, closed=True))
        assert kinds(shell) == ["cylinder"]
        assert ("may be a flat: 1, one at" in shell.curvature_report().faces) == named


def test_a_band_beyond_whose_end_the_face_goes_on_is_no_plane():
    """Beside a slot the bands of a shaft are as wide as its triangles happen to be."""
    turn = 2 * np.pi / 24 * np.arange(1, 24)
    edge = np.radians([-13.0, 13.0])
    rows = [(z, turn) for z in (0.0, LENGTH)] + [(z, edge) for z in (0.3 * LENGTH, 0.7 * LENGTH)]
    points = np.concatenate([np.c_[arc(angles), 0 * angles + z] for z, angles in rows])
    n = len(turn)
    i = np.arange(n - 1)
    triangles = [*np.c_[i, i + 1, n + i + 1].tolist(), *np.c_[i, n + i + 1, n + i].tolist()]
    # On both sides of the slot, and beyond its ends.
    low, high = 2 * n, 2 * n + 2
    triangles += [(n - 1, low, 2 * n - 1), (low, high, 2 * n - 1)]
    triangles += [(0, n, low + 1), (low + 1, n, high + 1)]
    triangles += [(n - 1, 0, low), (low, 0, low + 1), (high, high + 1, 2 * n - 1)]
    triangles += [(2 * n - 1, high + 1, n)]
    assert kinds(single(points, triangles)) == ["cylinder"]


@pytest.mark.parametrize("seed", range(10))
def test_a_belt_on_a_ball_is_a_cylinder(seed):
    rng = np.random.default_rng(seed)
    half, step = np.radians([rng.uniform(4, 20), rng.uniform(3, 9)])
    around = 2 * np.pi / np.ceil(2 * np.pi / step) * np.arange(np.ceil(2 * np.pi / step))
    latitude = np.linspace(half, 1.4, int(np.ceil((1.4 - half) / step)) + 1)
    shell = turned(around, arc(np.concatenate([-latitude[::-1], latitude])))
    wide = 2 * half > 1.05 * max(step, around[1])
    points = [(*arc(a, RADIUS * np.cos(half) + 5e-4), 0) for a in (0.1, 1, 2)]
    off = error(shell, points, 5e-4)
    assert off < (1e-8 if wide else RADIUS * (1 - np.cos(step / 2)))
    assert kinds(shell) == ["cylinder"] * int(wide) + ["sphere"]


@pytest.mark.parametrize("seed", range(10))
def test_a_plane_side_of_a_ring_is_plane(seed):
    rng = np.random.default_rng(seed)
    half, step = np.radians([rng.uniform(5, 20), rng.uniform(4, 8)])
    around = 2 * np.pi / 90 * np.arange(90)
    count = int(np.ceil((2 * np.pi - 2 * half) / step))
    across = np.pi / 2 + half + (2 * np.pi - 2 * half) / count * np.arange(count + 1)
    profile = arc(across, 0.003) + [0.01, 0.0]
    shell = turned(around, [*profile, profile[0]])
    points = [(*arc(a, 0.01), 0.003 * np.cos(half) + 3e-4) for a in (0.1, 1.0, 2.0)]
    assert error(shell, points, 3e-4) < 1e-8
    assert kinds(shell) == ["plane", "torus"]


@pytest.mark.parametrize("columns", [24, 40, 64])
@pytest.mark.parametrize("pitch", [0.0, 0.0035, 0.006])
@pytest.mark.parametrize("taper", [0.0, 0.0003])
def test_a_strip_of_one_row_does_not_lean(columns, pitch, taper):
    """Two rails on a cylinder or a cone cannot tell a tilt across them from curvature."""
    turn = 2 * np.pi * np.arange(int(1.5 * columns) if pitch == 0 else 3 * columns) / columns
    turn = turn[turn < 6.0] if pitch == 0 else turn
    lean = np.arctan(taper / 0.0035)

    def beside(turn, up, away=0.0):
        """Points (n, 3) at heights above the lower rail, away from the surface."""
        z = pitch * turn / (2 * np.pi) + up
        radius = 2 * RADIUS + np.tan(lean) * z + away * np.cos(lean)
        return np.c_[radius * np.cos(turn), radius * np.sin(turn), z - away * np.sin(lean)]

    points, quads = meshes.ribbon([beside(turn, 0.0), beside(turn, 0.0033)])
    shell = single(points, quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), faces=False)
    at = np.random.default_rng(0).uniform(turn[2], turn[-3], 50)
    off = error(shell, beside(at, 0.0016, 6e-4), 6e-4)
    assert off < 0.3 * 2 * RADIUS * (1 - np.cos(np.pi / columns))


@pytest.mark.parametrize("seed", range(5))
def test_steps_that_are_not_equal_stay_in_one_face(seed):
    # A quarter of a circle between planes that are tangent to it; the last steps are wider.
    quarter = arc(np.pi / 16 * np.array([0, 2, 3, 4, 5, 6, 8]))
    outline = np.concatenate([[[RADIUS, -20 * RADIUS]], quarter, [[-20 * RADIUS, RADIUS]]])
    points, quads = meshes.ribbon([np.c_[outline, 0 * outline[:, 0] + z] for z in (0, LENGTH)])
    bend = sp.Shell(points @ random_rotation(seed).T, quads)
    assert [len(face.elements) for face in bend.faces if face.kind == "cylinder"] == [6]
    widths = np.random.default_rng(seed).uniform(0.6, 1.4, 40)
    angles = 2 * np.pi * np.cumsum(widths) / widths.sum()
    latitude = np.cumsum(np.linspace(1.0, 1.6, 24)) * 2.4 / 31 - 1.2
    for shell in (
        turned(angles, [(RADIUS, 0.0), (RADIUS, LENGTH)]),
        turned(2 * np.pi / 40 * np.arange(40), arc(latitude)),
    ):
        (face,) = shell.faces
        assert len(face.elements) == len(shell.elements)


def single(vertices, elements, **options):
    """Return a shell whose vertices are in single precision."""
    return sp.Shell(np.float32(vertices).astype(float), elements, **options)
