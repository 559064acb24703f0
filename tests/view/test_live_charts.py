"""Curves of the charts: nothing lost that matters, nothing computed that nobody sees."""

from types import SimpleNamespace

import numpy as np
import pytest

from sphshell_pin.errors import NameNotFound
from sphshell_pin.scenario.running.rows import Rows, Series
from sphshell_pin.view.live.charts import MOST_KEPT, Charts, History, Thinner


def rows_of(t, normal, **more):
    normal = np.asarray(normal, dtype=float)
    normal = normal[:, None] if normal.ndim == 1 else normal
    more = {name: np.asarray(block, dtype=float) for name, block in more.items()}
    return Rows(np.asarray(t, dtype=float), normal, 0.5 * normal, 1e-4 * normal, more)


def charts_of(pairs=("left", "right"), series=None):
    scene = SimpleNamespace(pairs=[SimpleNamespace(name=name) for name in pairs])
    return Charts(SimpleNamespace(scene=scene, series=series))


def test_the_peak_of_each_piece_of_time_is_kept():
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(1e-4, 2e-3, 5000))
    values = rng.normal(0.0, 1.0, (5000, 2))
    thinner, points = Thinner(), []
    cuts = np.sort(rng.integers(0, 5000, 40))
    for piece in np.split(np.arange(5000), cuts):  # as frames bring them, some of them empty
        points += thinner.add(t[piece], values[piece], 0.01)
    points += thinner.end()
    pieces, expected = np.floor(t / 0.01), []
    for k in np.unique(pieces):
        inside = values[pieces == k]
        largest = inside[np.abs(inside).argmax(axis=0), [0, 1]]
        expected.append([t[pieces == k][-1], *largest])
    np.testing.assert_array_equal(points, expected)


def test_what_is_no_number_is_shown_as_none():
    thinner = Thinner()
    thinner.add(np.array([0.001]), np.array([[5.0, 1.0]]), 0.01)
    thinner.add(np.array([0.002, 0.003]), np.array([[np.nan, 1.0], [7.0, 2.0]]), 0.01)
    ((t, first, second),) = thinner.end()
    assert (t, second) == (0.003, 2.0)
    assert np.isnan(first)


def test_a_history_gives_back_its_newest_rows_however_they_came():
    rng = np.random.default_rng(1)
    history, t = History(), np.arange(MOST_KEPT + 5000) * 1e-3
    q = np.stack((t, -t), 1)
    for piece in np.split(np.arange(len(t)), np.sort(rng.integers(0, len(t), 3000))):
        history.add(rows_of(t[piece], t[piece], q=q[piece]))
    rows = history.since(-np.inf)
    np.testing.assert_array_equal(rows.t, t[-MOST_KEPT:])
    np.testing.assert_array_equal(rows.more["q"], q[-MOST_KEPT:])
    np.testing.assert_array_equal(history.since(t[-10]).t, t[-10:])
    assert history.since(1e9) is None
    assert History().since(0.0) is None


def test_only_the_curves_that_are_asked_for_are_computed():
    computed = []

    def read(key):
        return lambda block: computed.append(key) or block[:, 0]

    charts = charts_of(series=[Series(k, "Position", k, "deg", "q", read(k)) for k in "abc"])
    rows = rows_of([0.0, 0.01, 0.02], [1, 2, 3], q=[[4], [5], [6]])
    assert charts.add(rows, 0.01) == [[0.0], [0.01]]
    assert computed == []
    assert charts.ask("tab", ["b"])
    assert charts.again(0.0, 0.01) == [[0.0, 4.0], [0.01, 5.0]]
    assert set(computed) == {"b"}
    # Another browser adds its own, and takes them along when it goes.
    assert charts.ask("other", ["a", "b"])
    assert charts.keys == ("a", "b")
    assert not charts.ask("third", ["b"])
    assert charts.forget("other")
    assert charts.keys == ("b",)
    with pytest.raises(NameNotFound, match="no curve 'x'"):
        charts.ask("tab", ["x"])
    assert charts.keys == ("b",)


def test_forces_are_summed_and_listed_by_pair():
    charts = charts_of()
    ends = ("", ".left", ".right")
    forces = [kind + end for kind in ("normal", "friction") for end in ends]
    units = dict.fromkeys(forces, "N") | dict.fromkeys(("depth.left", "depth.right"), "mm")
    assert {one["key"]: one["unit"] for one in charts.descriptions()} == units
    charts.ask("tab", ["depth.right", "friction.left", "normal"])
    assert charts.keys == ("normal", "friction.left", "depth.right")
    charts.add(rows_of([0.0, 1.0], [[1, 2], [3, 4]]), 1.0)
    assert charts.again(0.0, 1.0) == [[0.0, 3.0, 0.5, pytest.approx(0.2)]]
    single = charts_of(["tip"])
    assert [one["key"] for one in single.descriptions()] == ["normal", "friction", "depth.tip"]


def test_a_block_that_was_not_recorded_at_first_is_no_number_there():
    joined = Rows.joined([rows_of([0.0], [1]), rows_of([1.0], [2], torque=[[3, 4]])])
    np.testing.assert_array_equal(joined.more["torque"], [[np.nan, np.nan], [3, 4]])
    missing = Series("x", "Torque", "x", "N m", "torque", lambda block: block[:, 0])
    assert np.isnan(missing.values(rows_of([0.0], [1]))).all()
