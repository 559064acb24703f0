"""Patches in pictures: which disc is shown, where and how large."""

import numpy as np
import pytest

from sphshell_pin.dynamics.result.result_parts import PATCH
from sphshell_pin.view.patches import LEVELS, PatchPool, PatchScale
from tests.view.drawn import Film
from tests.view.stand_ins import contact_log


def some_patches(*rows):
    patches = np.zeros(len(rows), PATCH)
    *axes, patches["peak_pressure"] = np.transpose(rows)
    patches["half_axes"], patches["axis_world"] = np.transpose(axes), (0, 1, 0)
    return patches


@pytest.fixture
def pool():
    film = Film()
    made = PatchPool(film.canvas, 2)

    def shown(rows, patches, scale):
        """The discs in the picture: (slot, level) and pose of each."""
        made.update(contact_log(rows), patches, scale)
        seen = {k: one for k, one in film.matrices.items() if np.linalg.norm(one[:3, 0]) > 1e-5}
        return {tuple(map(int, path.split("_")[1:])): one for path, one in seen.items()}

    return shown


def test_a_patch_is_where_the_contact_is(pool):
    patches = some_patches((2e-3, 1e-3, 4e6))
    poses = pool([{"point_world": np.array([0.1, 0.2, 0.3])}], patches, PatchScale(4e6, 5.0))
    matrix = poses.pop((0, LEVELS - 1))
    assert not poses
    np.testing.assert_allclose(matrix[:3, 3], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(matrix[:3, 0], [0, 0.01, 0], atol=1e-12)  # 5 x larger, along y
    np.testing.assert_allclose(matrix[:3, 1], [-0.005, 0, 0], atol=1e-12)


def test_colors_follow_the_pressure(pool):
    poses = pool([{}, {}], some_patches((1e-3, 1e-3, 1e5), (1e-3, 1e-3, 9e6)), PatchScale(4e6))
    assert set(poses) == {(0, 0), (1, LEVELS - 1)}


def test_saddles_and_unknown_patches_are_hidden(pool):
    patches = some_patches((1e-3, 1e-3, -1e5), (np.nan, np.nan, np.nan))
    assert pool([{}, {}], patches, PatchScale(4e6)) == {}


def test_the_scale_follows_the_patches():
    patches = some_patches(*[(1e-3, 1e-3, 1e6)] * 9, (1e-3, 1e-3, 1e9))
    scale = PatchScale.of(patches, 0.5)
    assert scale.pressure == pytest.approx(1.6e6)
    assert scale.factor == 10.0  # half axes of 1 mm in a picture of 0.5 m
    assert str(scale) == "pressure of patches: 0 to 1.6 MPa, drawn 10 x larger"
    assert PatchScale.of(patches, 0.01).factor == 1.0
