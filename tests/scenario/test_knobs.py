"""Knobs say what may be turned; a rebuilt scenario differs in what was turned and in no more."""

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter, ScenarioError
from sphshell_pin.scenario import build, live_parameters, rebuild, shipped_scenarios
from sphshell_pin.scenario.live.live_run import LiveRun
from tests.scenario.files import DROP, write
from tests.studies import mostly_studies

STIFFNESS = "contact.ball-plate.law.stiffness"


def knob(key: str, more: str = "") -> str:
    """Return the table of a knob."""
    return f'\n[[knob]]\nkey = "{key}"\n{more}\n'


def the_knob(folder, key, more=""):
    """Build the example with one knob and return that."""
    (found,) = live_parameters(build(write(folder, DROP + knob(key, more))))
    return found


def test_what_is_left_out_follows_from_the_key(tmp_path):
    found = the_knob(tmp_path, STIFFNESS)
    assert (found.low, found.value, found.high) == pytest.approx((1e5, 1e6, 1e7), rel=1e-12)
    assert found.log
    assert not found.restart
    assert (found.label, found.unit) == ("stiffness", "N/m^1.5")


@pytest.mark.parametrize(
    ("key", "more", "unit", "value", "restart"),
    [
        ("contact.ball-plate.sphere.radius", "", "m", 0.012, False),
        ("contact.sphere.radius", "", "m", 0.012, False),
        ("contact.0.law.damping", "", "N s/m", 20.0, False),
        ("contact.ball-plate.law.exponent", "", "", 1.5, False),
        ("contact.ball-plate.law.full_damping_depth", "", "m", 1e-4, False),
        ("gravity.2", "min = -20\nmax = 0", "m/s^2", -9.81, False),
        ("robot.ball.start.root_joint.2", "", "", 0.0125, True),
        ("shell.plate.placement.xyz.2", "min = -1\nmax = 0", "m", -0.01, True),
        ("shell.plate.placement.rpy_deg.0", "min = -9\nmax = 9", "deg", 0.0, True),
        ("run.dt", "", "s", 1e-4, True),
    ],
)
def test_any_number_may_be_a_knob(key, more, unit, value, restart, tmp_path):
    found = the_knob(tmp_path, key, more)
    assert (found.unit, found.value, found.restart) == (unit, value, restart)
    assert found.low <= value <= found.high
    assert found.label


@pytest.mark.parametrize(
    "name", mostly_studies(shipped_scenarios(), {"fingertip_on_blade", "gear_contact"}.__contains__)
)
def test_shipped_knobs_hold_over_their_range(name):
    built = build(name)
    knobs = live_parameters(built)
    assert knobs
    for one in knobs:
        assert one.choices or one.low <= one.value <= one.high
        for value in one.choices or (one.low, one.high):
            turned = rebuild(built, {one.key: str(value)})
            (again,) = (k.value for k in live_parameters(turned) if k.key == one.key)
            assert again == value or again == pytest.approx(value, rel=1e-12)


def test_a_rebuild_keeps_what_did_not_change(tmp_path):
    built = build(write(tmp_path))
    turned = rebuild(built, {STIFFNESS: "2e6", "contact.ball-plate.sphere.radius": "0.01"})
    assert turned.shells["plate"] is built.shells["plate"]
    assert turned.scene.pairs[0].side_j.shell is built.scene.pairs[0].side_j.shell
    assert turned.assembly is built.assembly
    assert turned.visual_model is built.visual_model
    assert turned.scene.pairs[0].law.stiffness == 2e6
    assert turned.scene.pairs[0].side_i.sphere.radius == 0.01
    # What was there before is as it was.
    assert built.scene.pairs[0].law.stiffness == 1e6
    assert built.scenario.contact[0].law.stiffness == 1e6


def test_a_rebuild_makes_anew_what_changed(tmp_path):
    built = build(write(tmp_path))
    larger = rebuild(built, {"shell.plate.magnify": "2"})
    assert larger.shells["plate"].size == pytest.approx(2 * built.shells["plate"].size, rel=1e-12)
    moved = rebuild(built, {"shell.plate.placement.xyz.2": "-0.02"})
    assert moved.shells["plate"] is built.shells["plate"]
    assert moved.scene.pairs[0].side_j.placement.translation[2] == -0.02
    started = rebuild(built, {"robot.start": "{ root_joint = [0, 0, 0.5, 0, 0, 0, 1] }"})
    assert started.q0[2] == 0.5


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("drop", {STIFFNESS: "3e5", "contact.0.law.damping": "5"}),
        ("drop", {"contact.sphere.radius": "0.013"}),
        ("fingertip_on_blade", {"controller.normal_force": "4", "controller.stiffness": "500"}),
        ("fingertip_on_blade", {"controller.speed": "0.07", "contact.law.stiffness": "4e7"}),
        ("gear_contact", {"source.gears.law.stiffness": "1e9"}),
    ],
)
def test_a_rebuild_moves_as_a_fresh_build_does(tmp_path, name, changes):
    path = write(tmp_path) if name == "drop" else name
    before = build(path)
    fresh, turned = build(path, changes), rebuild(before, changes)
    assert turned.scenario == fresh.scenario != before.scenario
    runs = [one.simulation.run(one.q0, one.v0, 0.01, one.controller) for one in (fresh, turned)]
    np.testing.assert_array_equal(runs[0].q, runs[1].q)


def test_a_knob_without_a_range_may_be_set_to_zero(tmp_path):
    key = "contact.ball-plate.law.damping"
    path = write(tmp_path, DROP + knob(key))
    (found,) = live_parameters(build(path, {key: "0"}))
    assert (found.value, found.log) == (0.0, False)
    assert found.low <= 0.0 < found.high
    live = LiveRun(build(path))
    (before,) = live.parameters
    live.change(before.key, 0.0)
    (after,) = live.parameters
    assert (after.low, after.high, after.value) == (before.low, before.high, 0.0)


def test_labels_units_and_limits_are_those_of_the_description(tmp_path):
    adams = 'law = { type = "adams", units = "in-lbf-s" }'
    hertz = 'law = { type = "hertz", young = 1e9, poisson = 0.3, restitution = 0.5, speed = 1 }'
    law = next(line for line in DROP.splitlines() if line.startswith("law"))
    for text, key, label, unit, high in (
        (adams, "k", "stiffness", "lbf/in^2.2", 1e6),
        (adams, "c", "damping", "lbf s/in", 100.0),
        (adams, "d", "full damping depth", "in", 1.0),
        (hertz, "young", "Young's modulus", "Pa", 1e10),
        (hertz, "restitution", "restitution", "", 1.0),
    ):
        path = write(tmp_path, DROP.replace(law, text) + knob(f"contact.ball-plate.law.{key}"))
        (found,) = live_parameters(build(path))
        assert (found.label, found.unit, found.high) == (label, unit, high)


METHOD = "contact.ball-plate.method"
WITH_METHOD = DROP.replace('shell = "plate"\n', 'shell = "plate"\nmethod = "smooth"\n')


def test_a_word_acts_on_the_run_under_way(tmp_path):
    live = LiveRun(build(write(tmp_path, WITH_METHOD + knob(METHOD) + knob(STIFFNESS))))
    live.advance(0.02)
    time, q = live.time, live.q.copy()
    live.change(METHOD, "facets")
    assert live.scene.pairs[0].side_j.method == "facets"
    assert [one.value for one in live.parameters] == ["facets", 1e6]
    assert live.time == time
    np.testing.assert_array_equal(live.q, q)
    for key, word, says in (
        (METHOD, "curved", "must be one of facets, smooth, elements"),
        (STIFFNESS, "stiff", "must be a number"),
        ("gravity.2", "down", "must be a number"),
    ):
        with pytest.raises(InvalidParameter, match=says):
            live.change(key, word)
    with pytest.raises(ScenarioError):
        live.change(METHOD, 1.0)
    assert live.scene.pairs[0].side_j.method == "facets"
