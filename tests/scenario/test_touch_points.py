"""Where a new scenario touches its part, and what way it takes there."""

import coal
import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.scenario.drafting.dropping import way_down
from sphshell_pin.scenario.drafting.touch_points import (
    find_touch_point,
    paths_on_surface,
    sides,
    touch_from_outside,
    touch_points,
    touches_once,
)


def shell_of(geometry) -> sp.Shell:
    return sp.Shell.from_geometry(geometry)


def test_feet_come_down_on_what_is_under_them():
    """Four feet over a plate that only one can reach: that one has the gap."""
    feet = np.array([[x, y, 0.3] for x in (-0.4, 0.4) for y in (-0.2, 0.2)])
    radii = np.full(4, 0.02)
    for size in (0.1, 2.0):
        plate = shell_of(coal.Box(size, size, 0.02))
        way = way_down(plate, feet, radii, 0.002)
        gaps = np.abs(plate.closest_points(feet + way).distances) - radii
        assert gaps.min() == pytest.approx(0.002, rel=2e-3)
    # Over a plate that is large enough all of them have it.
    np.testing.assert_allclose(gaps, 0.002, rtol=2e-3)


def test_a_spot_avoids_edges_and_grooves():
    """On a roof the ridge is in the middle: a tip is put beside it, on one side."""
    roof = [[x, y, 0.1 - abs(x)] for x in (-0.1, 0.0, 0.1) for y in (-0.2, 0.2)]
    shell = sp.Shell(roof, [[0, 2, 3, 1], [2, 4, 5, 3]])
    up = np.array([0.0, 0.0, 1.0])
    middle = find_touch_point(shell, 0.01, 1e-3, toward=up)
    assert not touches_once(shell, middle, middle.point[None], 0.01, 1e-3)
    spots = touch_points(shell, 0.01, 1e-3, up)
    good = next(one for one in spots if touches_once(shell, one, one.point[None], 0.01, 1e-3))
    assert abs(good.point[0]) > 0.002
    np.testing.assert_allclose(np.abs(good.normal), [np.sqrt(0.5), 0, np.sqrt(0.5)], atol=1e-6)
    # A path ends before the ridge, too.
    ahead = -np.sign(good.point[0]) * np.array([1.0, 0.0, 0.0])
    for way in paths_on_surface(shell, good, ahead, 0.1, 0.005):
        assert (way[:, 0] * good.point[0] > 0.0).all()


@pytest.mark.parametrize(
    ("geometry", "toward", "side", "point", "normal"),
    [
        (coal.Box(0.2, 0.2, 0.04), None, "both", [0, 0, 0.02], [0, 0, 1]),
        (coal.Box(0.2, 0.04, 0.2), None, "both", [0, 0.02, 0], [0, 1, 0]),
        (coal.Box(0.1, 0.08, 0.1), None, "both", [0, 0, 0.05], [0, 0, 1]),
        (coal.Box(0.2, 0.2, 0.04), [1, 0, 0], "both", [0.1, 0, 0], [1, 0, 0]),
        (coal.Sphere(0.1), [0, 0, 1], "inside", [0, 0, -0.1], [0, 0, 1]),
        (coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0), None, "both", [0, 0, 0], [0, 0, 1]),
    ],
)
def test_a_surface_is_touched_in_the_middle_of_its_broad_side(
    geometry, toward, side, point, normal
):
    shell = sp.Shell.from_geometry(geometry, side=side)
    toward = sides(shell)[0] if toward is None else np.array(toward, float)
    spot = find_touch_point(shell, 0.01, 1e-3, toward=toward)
    np.testing.assert_allclose(spot.point, point, atol=1e-4)
    np.testing.assert_allclose(spot.normal, normal, atol=1e-3)
    np.testing.assert_allclose(spot.center, spot.point + 0.011 * spot.normal, atol=2e-6)


def test_an_open_part_is_touched_from_outside_wherever_it_stands():
    """A tunnel about an axis far from the origin; its triangles face inward or outward."""
    angles = np.linspace(0.0, np.pi, 9)
    for turn in (1, -1):
        rows = np.array([[0.1 * np.cos(a), 0.0, 1 + 0.1 * np.sin(a)] for a in angles[::turn]])
        ends = np.concatenate([rows - [0, 0.1, 0], rows + [0, 0.1, 0]])
        shell = sp.Shell(ends, [[i, i + 1, i + 10, i + 9] for i in range(8)])
        for way in (1.0, -1.0):
            side = np.array([0.1 * np.cos(0.2) * way, 0.0, 1 + 0.1 * np.sin(0.2)])
            spot = touch_from_outside(shell, side, 0.01, 1e-3)
            assert spot.normal[0] * way > 0.9
    # Below the origin the middle is on the other side.
    hung = sp.Shell(ends - [0, 0, 2.5], [[i, i + 1, i + 10, i + 9] for i in range(8)])
    assert touch_from_outside(hung, np.array([0, 0, -1.4]), 0.01, 1e-3).normal[2] > 0.9


def test_a_sphere_has_room_in_a_groove():
    """A V of 60 degrees: the sphere rests on both sides, its center at twice the distance."""
    slope = np.tan(np.deg2rad(60))
    vertices = [[-0.1, y, 0.1 * slope] for y in (-0.1, 0.1)]
    vertices += [[0.0, y, 0.0] for y in (-0.1, 0.1)] + [[0.1, y, 0.1 * slope] for y in (-0.1, 0.1)]
    shell = sp.Shell(vertices, [[0, 2, 3, 1], [2, 4, 5, 3]])
    spot = find_touch_point(shell, 0.01, 1e-3, toward=np.array([0.0, 0.0, 1.0]))
    distance = abs(shell.closest_points(spot.center[None]).distances[0])
    assert distance == pytest.approx(0.011, rel=1e-3)
    # From the bottom of the groove the center stands 1 / cos 60 degrees as high.
    assert spot.center[2] == pytest.approx(0.022, rel=1e-3)


def test_a_way_across_stays_on_the_surface_and_ends_at_the_rim():
    ball = shell_of(coal.Sphere(0.1))
    spot = find_touch_point(ball, 0.01, 1e-3, toward=np.array([0.0, 0.0, 1.0]))
    way = next(paths_on_surface(ball, spot, np.array([1.0, 0.0, 0.0]), 0.1, 0.005))
    assert len(way) == 21
    np.testing.assert_allclose(np.linalg.norm(way, axis=1), 0.1, atol=2e-4)
    assert way[-1, 0] > 0.05
    box = shell_of(coal.Box(0.2, 0.2, 0.04))
    spot = find_touch_point(box, 0.01, 1e-3, toward=sides(box)[0])
    way = next(paths_on_surface(box, spot, np.array([1.0, 0.0, 0.0]), 1.0, 0.005))
    assert np.abs(way[:, :2]).max() <= 0.1 + 1e-9
    np.testing.assert_allclose(way[:, 2], 0.02, atol=1e-9)
