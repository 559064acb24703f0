"""The ends of a contact: one sphere, those of a list or of the geometry; on spheres; planes."""

import json

import numpy as np
import pytest

from sphshell_pin import robots
from sphshell_pin.scenario import build, run_scenario
from tests.command import call
from tests.scenario.files import EGG, HAND, TWO_BALLS, write

pytestmark = pytest.mark.usefixtures("no_pictures")


def test_a_ball_falls_on_a_ball(tmp_path):
    report = run_scenario(write(tmp_path, TWO_BALLS), tmp_path / "out", recording=False)
    pairs = report.result.stats.pairs
    assert list(pairs) == ["balls", "floor/upper/ball", "floor/lower/ball"]
    assert pairs["balls"].touches >= 1
    # The lower ball lies on the floor: it takes the weight of the upper one and its own.
    assert pairs["floor/lower/ball"].peak_force > pairs["balls"].peak_force > 1.0
    assert np.abs(report.result.energy.residual).max() < 1e-6 * report.result.energy.exchanged
    assert [len(pair.spheres) for pair in report.built.scene.pairs][:2] == [2, 1]


def test_collision_spheres_of_a_hand(tmp_path):
    scene = build(write(tmp_path, HAND)).scene
    wanted = robots.collision_spheres(robots.load("allegro_right_hand"))
    assert len(wanted) >= 4
    assert [pair.side_i.sphere for pair in scene.pairs] == wanted
    assert {pair.group for pair in scene.pairs} == {"tips"}


def test_an_egg_falls_on_a_plane(tmp_path):
    report = run_scenario(write(tmp_path, EGG), tmp_path / "out", recording=False)
    pair = report.built.scene.pair("table")
    assert (pair.frame_i, pair.frame_j, pair.spheres) == ("universe", "ball", ())
    assert pair.side_i.plane.offset == (0.0, 0.0, 0.001)
    touch = next(event for event in report.result.events if event.kind == "touch")
    assert touch.t == pytest.approx(np.sqrt(2 * 0.001 / 9.81), rel=1e-3)
    rows = report.result.contacts
    assert rows.normal_world == pytest.approx(np.tile([0, 0, -1.0], (len(rows.depth), 1)))


def test_the_table_of_many_contacts_lists_the_largest(tmp_path):
    # 20 spheres of one ball that falls on one of them.
    one = "{{ frame = 'lower/ball', radius = 0.012, offset = [0, 0, {}] }}"
    spheres = ", ".join(one.format(0.001 * k) for k in range(20))
    start, end = TWO_BALLS.index("spheres = ["), TWO_BALLS.index('shell = "plate"')
    file = write(tmp_path, f"{TWO_BALLS[:start]}spheres = [{spheres}]\n{TWO_BALLS[end:]}")
    told = call("run", file, "--out", tmp_path / "out", "--no-recording").output
    assert "floor/lower/ball-0 " in told
    assert "floor/lower/ball-19" not in told
    assert "5 more contacts with smaller peak forces, of which" in told
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert len(summary["stats"]["pairs"]) == 21
