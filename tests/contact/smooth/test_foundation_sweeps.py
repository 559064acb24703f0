"""A ball on an elastic foundation is swept over joints, creases, borders: its force cannot jump."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from sphshell_pin import Shell
from tests.contact.smooth.surfaces import shell_of
from tests.contact.smooth.sweeps import LIMIT, UP, WIDTH, segment
from tests.contact.smooth.test_sweeps_edges import EDGED, along_edges, edged, over_vertex, star
from tests.contact.smooth.test_sweeps_folds import KINDS, SMOOTH, fold, fold_paths, rolled
from tests.contact.test_foundation import total
from tests.contact.walks import steepest

DEPTHS = (0.04, 0.004)


def force(shell, center):
    return total(shell, center)[0]


def assert_no_jump(shell, paths, depth: float) -> None:
    """In every step of the paths, as a share of the force, or of that on a plane."""
    steps = [step for path in paths for step in pairwise(path)]
    assert steps
    for step in steps:
        *_, first, last = steepest(partial(force, shell), *step, WIDTH)
        size = max(*(np.linalg.norm(f) for f in (first, last)), np.pi * depth**2)
        assert np.linalg.norm(last - first) <= LIMIT * size, step[0].tolist()


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("name", SMOOTH)
def test_smooth_joints(name: str, depth: float) -> None:
    for h in (0.6, 0.3):
        assert_no_jump(shell_of(name, h), rolled(name, depth, 3, 0.7 * h, 4), depth)


@pytest.mark.parametrize(("kind", "exact"), EDGED)
def test_edges(kind: str, exact: bool) -> None:
    for depth in DEPTHS:
        assert_no_jump(edged(kind, exact), along_edges(edged(kind, exact), depth, 5), depth)


@pytest.mark.parametrize("angle", [2, 20, 60, 150, 170])
@pytest.mark.parametrize("kind", KINDS)
def test_creases(kind: str, angle: float) -> None:
    shell = fold(kind, angle, 0.5)
    for depth in DEPTHS:
        for where in ("across", "end"):
            assert_no_jump(shell, fold_paths(kind, angle, depth, where), depth)


@pytest.mark.parametrize("slope", [2, 10, 40])
@pytest.mark.parametrize("kind", ["tip", "pit", "saddle"])
def test_vertices(kind: str, slope: float) -> None:
    for facets in (4, 12):
        shell = Shell(*star(kind, facets, slope), crease_angle=np.radians(0.3))
        assert_no_jump(shell, over_vertex(shell, 0.04), 0.04)


def test_edge_on_a_sheet_gives_way() -> None:
    """The one place where the force jumps: through the plane of an open sheet, outside its border.
    The potential does not."""
    shell, place = edged("sheet"), np.array([2.9, 0.1, 0.0])
    above, below = (force(shell, place + z * UP) for z in (1e-9, -1e-9))
    assert above == pytest.approx(below * [1, 1, -1], abs=1e-9)
    assert abs(above[2]) > 1e-5
    for z in (1e-9, -1e-9):
        assert 0 <= total(shell, place + z * UP)[1] <= 1e-9
    assert_no_jump(shell, [segment(place + [0, 0, 1e-6], place + [0.2, 0.1, 0.3], 5)], 0.1)
