"""The cases of the validation: each error figure within its bound, or with its physics named."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from sphshell_pin.errors import NameNotFound
from tests.rolling import turned
from tests.studies import mostly_studies
from tests.validation import carried, cases, rattleback, tosses
from tests.validation.cases import collect
from tests.validation.pictures import draw

pytest.importorskip("matplotlib")
DOCS = Path(__file__).parents[2] / "docs"
CASES = mostly_studies(collect(), lambda one: not one.slow)


@pytest.mark.parametrize("one", CASES, ids=lambda one: one.key)
def test_case(one):
    found = one.run()
    assert found.findings
    assert draw(found.panels).startswith(b"\x89PNG")
    assert all(math.isfinite(finding.value) for finding in found.findings)
    assert [(f.what, f.text, f.aim_text) for f in found.unexplained] == []


def test_pushed_box_and_its_balls():
    """The short form of a slow case, in a direction of its own."""
    t, speeds, across = carried.push_box(20.0, 0.5)
    assert carried.accelerations(t, speeds) == pytest.approx(carried.EXACT, rel=1e-4)
    assert across[-1] == pytest.approx(0.0, abs=1e-5 * speeds[-1].max())


def test_rattleback_as_rigid_rolling():
    """The first half second, in which the rattling begins."""
    (t, ours, lost), (_, rigid, zeros) = (
        one(-5.0, 0.5) for one in (rattleback.spin_on_plane, rattleback.roll)
    )
    assert ours[: len(rigid)] == pytest.approx(rigid, abs=0.02)
    assert np.ptp(rigid) > 0.5
    assert (t[-1], len(zeros)) == (pytest.approx(0.5), 0)
    assert abs(lost) < 1e-4


def test_tosses_of_a_cube():
    """The data, gravity in flight, the first velocity, and the errors of some tosses."""
    poses, velocities = tosses.tosses()
    assert len(poses) == len(velocities) == 550
    t = tosses.INTERVAL * np.arange(5)
    falls = [np.polyfit(t, one[:5, 2], 2) for one in poses]
    assert np.median([2 * fall[0] for fall in falls]) == pytest.approx(-9.81, abs=0.5)
    world = turned(np.array([one[0, 3:] for one in poses]), velocities[:, :3])
    first = np.median([fall[1] for fall in falls] - world[:, 2])
    assert first == pytest.approx(0.0, abs=0.01)
    errors, computed = tosses.misses(tosses.cube(*tosses.NUMBERS), range(100, 108), dt=2e-4)
    assert [len(one) for one in computed] == [len(one) for one in poses[100:108]]
    assert (errors.mean(axis=0) < [0.2, 30.0]).all()


@pytest.mark.parametrize("one", collect(), ids=lambda one: one.key)
def test_case_states_its_source(one):
    assert "http" in one.source
    assert all(text.strip() for text in one.texts.values())
    assert all(cases.read(name).origin for name in one.files)


def test_page_of_the_docs_has_every_case():
    data = json.loads((DOCS / "measured" / "validation.json").read_text(encoding="utf-8"))
    sections = {one.get("title"): one for one in data["sections"]}
    for one in collect():
        assert one.title in sections, "run python -m tests.validation"
        assert one.source in sections[one.title]["notes"][0], "run python -m tests.validation"


def test_data_file():
    data = cases.read("chung_ooi_1")
    assert "doi" in data.origin
    assert len(data.where("series", "depth")["x"]) == 15
    with pytest.raises(NameNotFound, match="series, x, force"):
        data["y"]
