from types import SimpleNamespace

import numpy as np
import pytest

from sphshell_pin.view.arrows import ArrowPool, ArrowScale, Forces, pushing
from tests.view.drawn import Film


def forces(*normal, friction=None):
    count = len(normal)
    pushes = np.outer(normal, [0.6, 0.0, 0.8])
    rubs = np.zeros((count, 3)) if friction is None else np.array(friction)
    return Forces(np.arange(3.0 * count).reshape(count, 3), pushes, rubs)


def last_transforms(pool_of, given, scale, **options):
    """Transforms (path -> 4x4) after one update of a pool."""
    film = Film()
    ArrowPool(film.canvas, pool_of, 0.001, **options).update(given, scale)
    return film.matrices


def test_an_impact_does_not_shrink_the_rest_to_nothing():
    values = np.concatenate((np.full(100, 2.0), [5000.0]))
    scale = ArrowScale.from_forces(values, 0.1)
    assert 2.0 * scale.meters_per_newton > 0.1 / 8.0
    assert scale.cuts(values)
    assert not scale.cuts(np.full(3, 2.0))


def test_an_arrow_goes_from_the_contact_along_the_force():
    scale = ArrowScale(0.1, 5.0)
    given = forces(4.0, friction=[[0.0, 1.0, 0.0]])
    where = last_transforms(1, given, scale)
    start = given.point[0]
    for name, force in (("normal", np.array([2.4, 0.0, 3.2])), ("friction", np.array([0, 1.0, 0]))):
        shaft, head = where[f"{name}_0/shaft"], where[f"{name}_0/head"]
        # three.js's unit cylinder lies along y from -1/2 to 1/2.
        end = start + force * scale.meters_per_newton
        np.testing.assert_allclose((shaft @ [0, -0.5, 0, 1])[:3], start, atol=1e-12)
        np.testing.assert_allclose((head @ [0, 0.5, 0, 1])[:3], end, atol=1e-12)
        np.testing.assert_allclose(shaft @ [0, 0.5, 0, 1], head @ [0, -0.5, 0, 1], atol=1e-12)
    np.testing.assert_allclose(where["point_0"][:3, 3], start)


def test_the_total_force_is_one_arrow():
    where = last_transforms(1, forces(4.0, friction=[[0.0, 1.0, 0.0]]), ArrowScale(), total=True)
    tip = (where["total_0/head"] @ [0, 0.5, 0, 1])[:3]
    np.testing.assert_allclose(tip - [0, 1, 2], np.array([2.4, 1.0, 3.2]) * 0.01, atol=1e-12)
    assert not any(name.startswith("normal") for name in where)


def test_no_node_ever_gets_a_singular_transform():
    for given in (None, forces(), forces(0.0), forces(1e-12), forces(3.0)):
        for matrix in last_transforms(2, given, ArrowScale()).values():
            assert np.linalg.norm(matrix[:3, :3], axis=0).min() > 0.0
            assert np.isfinite(matrix).all()


def test_a_full_pool_shows_the_largest_forces():
    where = last_transforms(2, forces(1.0, 9.0, 2.0, 5.0), ArrowScale())
    shown = sorted(tuple(where[f"point_{k}"][:3, 3]) for k in range(2))
    assert shown == [(3.0, 4.0, 5.0), (9.0, 10.0, 11.0)]


def test_a_contact_keeps_its_arrow_when_another_lets_go():
    film = Film()
    pool = ArrowPool(film.canvas, 3, 0.001)
    both = forces(1.0, 2.0)
    second = Forces(both.point[1:] + 0.01, both.normal[1:], both.friction[1:])
    sizes = []
    for given in (both, second, both):
        pool.update(given, ArrowScale())
        sizes.append([film.matrices[f"point_{slot}"][0, 0] for slot in range(3)])
    # Only the first contact's point ever shrinks; the second's stays in its slot throughout.
    np.testing.assert_array_equal(np.array(sizes) > 1e-4, [[1, 1, 0], [0, 1, 0], [1, 1, 0]])


@pytest.mark.parametrize("size", [1000.0, 1e200, np.inf, np.nan])
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_forces_beyond_all_bounds_are_drawn_as_far_as_can_be(size):
    where = last_transforms(1, forces(size), ArrowScale(0.1, 1.0, longest=0.25))
    tip = (where["normal_0/head"] @ [0, 0.5, 0, 1])[:3]
    assert np.isfinite(tip).all()
    expected = 0.25 if np.isfinite(size) else 0.0
    assert np.linalg.norm(tip - [0, 1, 2]) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("least", [0.1, 0.999])
def test_saddles_are_no_arrows_that_pull_and_the_sum_of_forces_stays(least):
    # A chain of three contacts with a saddle between each two, and a contact of another pair.
    normal = np.array([3.0, 3.0, 3.0, -3.0 * least, -3.0 * least, 5.0])
    places = np.array([[0, 0, 0], [2, 0, 0], [4, 0, 0], [1, 0, 0], [3, 0, 0.0], [1, 0, 0]])
    normals = np.array([[np.sin(a), 0, np.cos(a)] for a in (0.2, 0, -0.2, 0.1, -0.1, 0)])
    contacts = {"point_world": places, "normal_world": normals, "normal_force": normal}
    contacts |= {"friction_force_world": np.zeros((6, 3)), "pair": np.array([0, 0, 0, 0, 0, 1])}
    drawn = pushing(SimpleNamespace(**contacts))
    np.testing.assert_array_equal(drawn.point, places[[0, 1, 2, 5]])
    assert (np.sum(drawn.normal * normals[[0, 1, 2, 5]], axis=1) > 0.0).all()
    np.testing.assert_allclose(drawn.normal.sum(axis=0), normal @ normals, atol=1e-12)
    np.testing.assert_array_equal(drawn.normal[-1], [0.0, 0.0, 5.0])
    # Of each saddle its two neighbors bear half.
    ends = normal[[0, 2], None] * normals[[0, 2]] + 0.5 * normal[[3, 4], None] * normals[[3, 4]]
    np.testing.assert_allclose(drawn.normal[[0, 2]], ends, atol=1e-12)
