"""Files of results keep the sensitivities of the rows, and damaged ones are refused."""

from dataclasses import fields

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import ResultError
from tests.patches.scenes import LAW, RADIUS, plate, slider
from tests.results import damaged

ASKED = ("tip.law.stiffness", "tip.sphere.offset", "v0")


@pytest.fixture(scope="module")
def bounced():
    """A run with 7 columns and rows in and out of contact."""
    scene = sp.Scene(slider())
    friction = sp.CoulombFriction(0.3, 0.2, 0.01, 0.1)
    scene.add_contact(sp.Sphere(RADIUS, "ball"), plate(), law=LAW, friction=friction, name="tip")
    return sp.Simulation(scene, sp.Adaptive()).run(
        [0.0, 0.0, RADIUS + 1e-4], [0.1, 0.0, -0.2], 5e-3, record_dt=1e-4, sensitivities=ASKED
    )


@pytest.fixture
def file(bounced, tmp_path):
    return bounced.save(tmp_path / "run.npz")


def test_files_keep_them_to_the_bit(bounced, file):
    again, before = sp.Result.load(file).sensitivities, bounced.sensitivities
    assert len(before.parameters) == 7
    assert again.parameters == before.parameters
    assert len(bounced.contacts) > 10
    for one in (field.name for field in fields(before)[1:]):
        kept, had = getattr(again, one), getattr(before, one)
        assert kept.shape == had.shape
        assert kept.tobytes() == np.ascontiguousarray(had).tobytes()
        assert not kept.flags.writeable
    assert np.abs(again.force_world).max() > 0


def put(old: str, new: str):
    return lambda header: str(header).replace(old, new)


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("sensitivities.q", lambda a: a[:-1], r"'sensitivities\.q' has the shape \(50, 3, 7\)"),
        ("sensitivities.depth", lambda a: a[:, :-1], r"'sensitivities\.depth' has the shape"),
        ("sensitivities.force_world", lambda a: a[..., 0], "not \\(m, 3, p\\)"),
        ("sensitivities.normal_force", lambda a: None, "no array 'sensitivities.normal_force'"),
        ("sensitivities.q", lambda a: a.astype("f4"), r"'sensitivities\.q' holds float32"),
        ("sensitivities.q", lambda a: a.astype(object), "Python objects"),
        ("header", put("tip.law.stiffness", "v0.0"), "does not name each of 7 columns once"),
        ("header", put('"tip.law.stiffness"', "3"), r"header\.sensitivities\.0: "),
    ],
)
def test_a_damaged_file_is_refused(file, name, change, said):
    with pytest.raises(ResultError, match=said):
        sp.Result.load(damaged(file, name, change))


def test_they_count_as_memory(bounced, file):
    rows = bounced.sensitivities
    needed = sum(a.nbytes for a in (rows.q, rows.v, rows.force_world, rows.normal_force))
    with pytest.raises(ResultError, match="max_size"):
        sp.Result.load(file, max_size=needed)
