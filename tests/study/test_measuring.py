"""What the report measures with: closed forms, contestants in processes of their own, spreads."""

import os

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sphshell_pin as sp
from benchmarks import growth
from sphshell_pin.study.report import closed_forms, timing
from sphshell_pin.study.report.contents import Spread
from sphshell_pin.study.report.swing import GRAVITY, MASS


def integrated(slope, start, t, **more):
    """Return rows of a solution by SciPy."""
    given = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-15, **more}
    return solve_ivp(slope, (0, t[-1]), start, t_eval=t, **given).y.T


def test_closed_form_of_the_bounces():
    t = np.linspace(0, 0.2, 101)

    def slope(_, y):
        return [y[1], -GRAVITY + 1e4 / MASS * max(0.0, -y[0])]

    rows = integrated(slope, [closed_forms.FALL, 0.0], t, rtol=1e-12, max_step=1e-4)
    assert closed_forms.bounce(t, 1e4)[0] == pytest.approx(rows[:, 0], abs=1e-8)


def test_closed_form_of_the_gliding_ball():
    case = closed_forms.glide()
    t = np.linspace(0, 0.1, 21)
    sag, damping = MASS * GRAVITY / closed_forms.STIFF, 1e4

    def slope(_, y):
        depth = -y[0]
        push = closed_forms.STIFF * depth - damping * y[1]
        return [y[1], -GRAVITY + push / MASS]

    rows = integrated(slope, [-1.5 * sag, 0.0], t, method="Radau")
    figures = case.exact(t)
    assert figures[:, 2] == pytest.approx(-rows[:, 0] / sag, abs=1e-6)
    along = np.cos(np.sqrt(closed_forms.SPRING / MASS) * t)
    assert figures[:, 0] == pytest.approx(along)


def test_contestants_answer_from_their_own_processes():
    names, notes = [growth.OURS, growth.COAL], []
    rows = growth.measure_one(names, 22, 2, notes)
    assert [row.name for row in rows] == names
    assert notes == []
    assert all(row.triangles == 968 and row.query.median > 0 for row in rows)
    assert all(not row.memory > 5e7 for row in rows)


def test_who_cannot_answer_is_left_out_with_a_reason(monkeypatch):
    monkeypatch.setitem(growth.NEEDS, growth.TRIMESH, "no_such_module")
    names, notes = growth.installed()
    assert growth.TRIMESH not in names
    assert "no_such_module is missing" in " ".join(notes)
    names, notes = ["nobody", growth.OURS_FLAT], []
    rows = growth.measure_one(names, 22, 1, notes)
    assert [row.name for row in rows] == names == [growth.OURS_FLAT]
    assert notes[0].startswith("nobody is left out from 968 triangles on: KeyError: 'nobody'.")


def test_sheets_that_do_not_fit_the_memory_are_left_out(monkeypatch):
    monkeypatch.setattr(growth, "available", lambda: 1e6)
    rows, notes = growth.measure((1000,), 1)
    assert rows == []
    assert "2000000 triangles are left out" in notes[-1]


def test_a_stiff_motion_costs_implicit_methods_no_steps():
    case = closed_forms.glide()
    explicit, implicit = case.run(sp.RungeKutta4(1e-5), 0.05), case.run(sp.Implicit(1e-5), 0.05)
    assert max(case.error(explicit), case.error(implicit)) < 1e-3
    assert explicit.stats.evaluations > 10 * implicit.stats.evaluations


def test_one_core_for_a_while():
    before = os.sched_getaffinity(0)
    with timing.on_one_core():
        assert len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before


def test_contestants_take_turns_and_say_how_far_they_are():
    heard, turns = [], []
    taken = {name: lambda name=name: float(turns.append(name) or len(turns)) for name in "ab"}
    times = timing.take_turns(taken, 3, heard.append)
    assert "".join(turns) == "abababab"  # the first turn warms up
    assert {name: list(of) for name, of in times.items()} == {"a": [3, 5, 7], "b": [4, 6, 8]}
    assert heard == [0.25, 0.5, 0.75, 1.0]


def test_spread():
    assert Spread.of(np.array([3.0, 1.0, 2.0])) == Spread(2.0, 1.5, 2.5)
    heard = []
    timing.part(heard.append, 0.25, 0.5)(0.5)
    assert heard == [0.375]
