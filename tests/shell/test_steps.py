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
    """Return the shell (in single precision) of a closed profile (n, 2) turned by angles (m,)."""
    vertices, triangles = meshes.revolved(profile, np.asarray(angles))
    return sp.Shell(vertices.astype(np.float32).astype(float), triangles)


def angles_with_flats(steps, flats):
    """Angles of a circle in equal steps between flats, (middle, half-angle) each [rad]."""
    out = []
    for (middle, half), (following, other) in zip(flats, [*flats[1:], flats[0]], strict=True):
        arc = (following - other - middle - half) % (2 * np.pi)
        count = int(np.ceil(arc / steps))
        out.append(middle + half + arc / count * np.arange(count + 1))
    return np.concatenate(out) % (2 * np.pi), arc / count


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
    normal = np.array([np.cos(middle) * np.cos(lean), np.sin(middle) * np.cos(lean), np.sin(lean)])
    away = 5e-4 * rng.choice([-1, 1])
    on = np.array([np.cos(middle), np.sin(middle), 0]) * RADIUS * np.cos(half)
    off = error(shell, on + [0, 0, LENGTH / 2] + away * normal, abs(away))
    if 2 * half > 1.02 * step:
        assert off < 1e-9
        assert sum(face.kind == "plane" for face in shell.faces) == len(flats)
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
    angles = half + (2 * np.pi - 2 * half) * np.cumsum([0.0, *widths]) / widths.sum()
    x, y = RADIUS * np.cos(angles), RADIUS * np.sin(angles)
    lean = rng.uniform(-0.8, 0.8, (2, 2))
    ends = [x * a + y * b + z for (a, b), z in zip(lean, (0.0, 4 * LENGTH), strict=True)]
    points = np.concatenate([np.stack([x, y, z], axis=1) for z in ends])
    m = len(x)
    i = np.arange(m)
    walls = np.stack([i, (i + 1) % m, m + (i + 1) % m, m + i], axis=1)
    triangles = np.concatenate(
        [walls[:, [0, 1, 2]], walls[:, [0, 2, 3]]]
        + [np.stack([0 * i + k, k + i, k + (i + 1) % m], axis=1)[1:-1] for k in (0, m)]
    )
    shell = sp.Shell(points.astype(np.float32).astype(float), triangles)
    steps = (2 * np.pi - 2 * half) * widths / widths.sum()
    if 2 * half > 1.3 * steps.max():
        middle = (RADIUS * np.cos(half) + 5e-4, 0.0, 2 * LENGTH)
        assert error(shell, middle, 5e-4) < 1e-8
    kinds = [face.kind for face in shell.faces]
    assert kinds.count("plane") == 2 + int(2 * half > 1.3 * steps.max())
    assert kinds.count("cylinder") == 1
    assert "may be a flat" not in shell.curvature_report().faces or 2 * half < 1.3 * steps.max()


def test_a_flat_that_may_be_a_step_between_oblique_ends_is_named():
    """An oblique cut is sampled in unequal steps: a flat that is a little wider stays round."""
    widths = np.array([1.0, 0.7, 0.6, 0.75, 0.65] * 9)
    for share, named in ((1.0, False), (1.2, True)):
        steps = np.r_[widths, share]
        angles = 2 * np.pi * np.cumsum(steps) / steps.sum()
        x, y = RADIUS * np.cos(angles), RADIUS * np.sin(angles)
        m = len(angles)
        points = np.concatenate([np.c_[x, y, 0.5 * x], np.c_[x, y, 0.7 * y + 4 * LENGTH]])
        walls = [[i, (i + 1) % m, m + (i + 1) % m, m + i] for i in range(m)]
        shell = sp.Shell(points.astype(np.float32).astype(float), walls)
        (face,) = shell.faces
        assert face.kind == "cylinder"
        assert ("may be a flat: 1, one at" in shell.curvature_report().faces) == named


def test_a_band_beyond_whose_end_the_face_goes_on_is_no_plane():
    """Beside a slot the bands of a shaft are as wide as its triangles happen to be."""
    turn = 2 * np.pi / 24 * np.arange(1, 24)
    edge = np.radians([-13.0, 13.0])
    rows = [(z, turn) for z in (0.0, LENGTH)] + [(z, edge) for z in (0.3 * LENGTH, 0.7 * LENGTH)]
    points = [(RADIUS * np.cos(a), RADIUS * np.sin(a), z) for z, all_of in rows for a in all_of]
    n = len(turn)
    triangles = [(i, i + 1, n + i + 1) for i in range(n - 1)]
    triangles += [(i, n + i + 1, n + i) for i in range(n - 1)]
    # On both sides of the slot, and beyond its ends.
    low, high = 2 * n, 2 * n + 2
    triangles += [(n - 1, low, 2 * n - 1), (low, high, 2 * n - 1)]
    triangles += [(0, n, low + 1), (low + 1, n, high + 1)]
    triangles += [(n - 1, 0, low), (low, 0, low + 1), (high, high + 1, 2 * n - 1)]
    triangles += [(2 * n - 1, high + 1, n)]
    shell = sp.Shell(np.float32(points).astype(float), triangles)
    (face,) = shell.faces
    assert face.kind == "cylinder"


@pytest.mark.parametrize("seed", range(10))
def test_a_belt_on_a_ball_is_a_cylinder(seed):
    rng = np.random.default_rng(seed)
    half, step = np.radians([rng.uniform(4, 20), rng.uniform(3, 9)])
    around = 2 * np.pi / np.ceil(2 * np.pi / step) * np.arange(np.ceil(2 * np.pi / step))
    count = int(np.ceil((1.4 - half) / step))
    arc = np.linspace(half, 1.4, count + 1)
    latitude = np.concatenate([-arc[::-1], arc])
    profile = RADIUS * np.stack([np.cos(latitude), np.sin(latitude)], axis=1)
    shell = turned(around, profile)
    wide = 2 * half > 1.05 * max(step, around[1])
    radius = RADIUS * np.cos(half)
    points = [((radius + 5e-4) * np.cos(a), (radius + 5e-4) * np.sin(a), 0) for a in (0.1, 1, 2)]
    off = error(shell, points, 5e-4)
    assert off < (1e-8 if wide else RADIUS * (1 - np.cos(step / 2)))
    assert sorted(face.kind for face in shell.faces) == ["cylinder"] * int(wide) + ["sphere"]


@pytest.mark.parametrize("seed", range(10))
def test_a_plane_side_of_a_ring_is_plane(seed):
    rng = np.random.default_rng(seed)
    half, step = np.radians([rng.uniform(5, 20), rng.uniform(4, 8)])
    around = 2 * np.pi / 90 * np.arange(90)
    count = int(np.ceil((2 * np.pi - 2 * half) / step))
    across = np.pi / 2 + half + (2 * np.pi - 2 * half) / count * np.arange(count + 1)
    tube = 0.003
    shell = turned(around, np.stack([0.01 + tube * np.cos(across), tube * np.sin(across)], axis=1))
    row = np.stack([across[-1:], across[:1] + 2 * np.pi], axis=1)
    ring = np.stack([0.01 + tube * np.cos(row[0]), tube * np.sin(row[0])], axis=1)
    cover = turned(around, ring)
    shell = sp.Shell(
        np.concatenate([shell.vertices, cover.vertices]),
        np.concatenate([shell.elements[:, :3], cover.elements[:, :3] + len(shell.vertices)]),
    )
    height = tube * np.cos(half)
    points = [(0.01 * np.cos(a), 0.01 * np.sin(a), height + 3e-4) for a in (0.1, 1.0, 2.0)]
    assert error(shell, points, 3e-4) < 1e-8
    assert sorted(face.kind for face in shell.faces) == ["plane", "torus"]


@pytest.mark.parametrize("columns", [24, 40, 64])
@pytest.mark.parametrize("pitch", [0.0, 0.0035, 0.006])
@pytest.mark.parametrize("taper", [0.0, 0.0003])
def test_a_strip_of_one_row_does_not_lean(columns, pitch, taper):
    """Two rails on a cylinder or a cone cannot tell a tilt across them from curvature."""
    turn = 2 * np.pi * np.arange(int(1.5 * columns) if pitch == 0 else 3 * columns) / columns
    turn = turn[turn < 6.0] if pitch == 0 else turn
    low = pitch * turn / (2 * np.pi)
    rails = []
    for z in (low, low + 0.0033):
        radius = 2 * RADIUS + taper / 0.0035 * z
        rails.append(np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1))
    m = len(turn)
    quads = [[i, i + 1, m + i + 1, m + i] for i in range(m - 1)]
    triangles = [[t[0], *t[k : k + 2]] for t in quads for k in (1, 2)]
    shell = sp.Shell(np.concatenate(rails).astype(np.float32).astype(float), triangles, faces=False)
    at = np.random.default_rng(0).uniform(turn[2], turn[-3], 50)
    z = pitch * at / (2 * np.pi) + 0.0016
    slope = np.arctan(taper / 0.0035)
    radius = 2 * RADIUS + taper / 0.0035 * z + 6e-4 * np.cos(slope)
    centers = [radius * np.cos(at), radius * np.sin(at), z - 6e-4 * np.sin(slope)]
    off = error(shell, np.transpose(centers), 6e-4)
    assert off < 0.3 * 2 * RADIUS * (1 - np.cos(np.pi / columns))


@pytest.mark.parametrize("kind", ["irregular", "unequal rows", "ends"])
@pytest.mark.parametrize("seed", range(5))
def test_steps_that_are_not_equal_stay_in_one_face(kind, seed):
    rng = np.random.default_rng(seed)
    if kind == "ends":
        # A quarter of a circle between planes that are tangent to it; the last steps are wider.
        angles = np.cumsum([0.0, 2.0, 1.0, 1.0, 1.0, 1.0, 2.0])
        angles *= np.pi / 2 / angles[-1]
        x, y = RADIUS * np.cos(angles), RADIUS * np.sin(angles)
        outline = np.concatenate(
            [[[RADIUS, -20 * RADIUS]], np.stack([x, y], axis=1), [[-20 * RADIUS, RADIUS]]]
        )
        points = np.concatenate([np.c_[outline, z * np.ones(len(outline))] for z in (0, LENGTH)])
        m = len(outline)
        quads = [[i, i + 1, m + i + 1, m + i] for i in range(m - 1)]
        shell = sp.Shell(points @ random_rotation(seed).T, quads)
        (face,) = (face for face in shell.faces if face.kind == "cylinder")
        assert len(face.elements) == 6
        return
    if kind == "irregular":
        widths = rng.uniform(0.6, 1.4, 40)
        angles = 2 * np.pi * np.cumsum(widths) / widths.sum()
        shell = turned(angles, [(RADIUS, 0.0), (RADIUS, LENGTH)])
    else:
        latitude = np.cumsum(np.linspace(1.0, 1.6, 24)) * 2.4 / 31 - 1.2
        profile = RADIUS * np.stack([np.cos(latitude), np.sin(latitude)], axis=1)
        shell = turned(2 * np.pi / 40 * np.arange(40), profile)
    (face,) = shell.faces
    assert len(face.elements) == len(shell.elements)
