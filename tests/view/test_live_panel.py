"""Numbers of the page: nothing lost that matters, nothing that is no number."""

import json
from types import SimpleNamespace

import numpy as np

from sphshell_pin.contact import BristleFriction, CoulombFriction
from sphshell_pin.dynamics.scene_contacts import ROW, SceneContacts
from sphshell_pin.scenario.player import Rows
from sphshell_pin.view.live.panel import MOST_LISTED, Panel, Strip, dump, list_contacts


def rows_of(t, normal):
    normal = np.asarray(normal, dtype=float).reshape(len(t), -1)
    return Rows(np.asarray(t, dtype=float), normal, 0.5 * normal, 0.0 * normal)


def test_a_strip_keeps_the_peak_of_each_piece_of_time():
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(1e-4, 2e-3, 5000))
    force = rng.exponential(1.0, 5000)
    strip, kept = Strip(), []
    cuts = np.sort(rng.integers(0, 5000, 40))
    for piece in np.split(np.arange(5000), cuts):  # as frames bring them, some of them empty
        kept += strip.add(rows_of(t[piece], force[piece]), 0.01)
    pieces = np.floor(t / 0.01)
    expected = [force[pieces == k].max() for k in np.unique(pieces)][:-1]  # the last one is open
    np.testing.assert_array_equal([row[1][0] for row in kept], expected)
    assert all(np.diff([row[0] for row in kept]) > 0.0)
    assert all(row[2][0] == 0.5 * row[1][0] for row in kept)


def test_a_strip_sums_over_pairs_and_bears_what_is_no_number():
    strip = Strip()
    t = [0.0, 0.001, 0.002, 0.02]
    strip.add(rows_of(t, [[1, 1], [3, 0], [2, 2], [0, 0]]), 0.01)
    (row,) = strip.add(rows_of([0.03], [[np.nan, 1.0]]), 0.01)
    assert row[0] == 0.02
    (row,) = strip.add(rows_of([0.04], [[1.0, 1.0]]), 0.01)
    assert json.loads(dump(row))[1] == [None, 1.0]


def test_a_late_browser_gets_all_rows_and_the_newest_state():
    panel = Panel()
    panel.greet({"title": "x"})
    for k in range(5):
        panel.publish({"t": k}, [[k, [1.0], [0.1]]])
    number, texts = panel.news(0)
    hello, rows, state = map(json.loads, texts)
    assert (hello["type"], state["t"]) == ("hello", 4)
    assert [row[0] for row in rows["rows"]] == [0, 1, 2, 3, 4]
    assert panel.news(number) == (number, [])
    panel.publish({"t": 5}, [[5, [1.0], [0.1]]], clear=True)
    rows, state = map(json.loads, panel.news(number)[1])
    assert rows == {"type": "rows", "clear": True, "rows": [[5, [1.0], [0.1]]]}
    # A page that connects now does not get the rows that were cleared.
    assert json.loads(panel.news(0)[1][1])["rows"] == [[5, [1.0], [0.1]]]


def test_json_has_no_nan_and_no_infinity():
    value = {"a": np.nan, "b": [np.inf, np.float64(1 / 3)], "c": np.int32(3), "d": np.bool_(True)}
    text = dump({**value, "e": np.array([1.5, -np.inf])})
    assert json.loads(text) == {"a": None, "b": [None, 0.333333333], "c": 3, "d": True} | {
        "e": [1.5, None]
    }


def test_contacts_are_listed_in_millimetres_and_stick_creep_or_slip():
    laws = [
        None,
        CoulombFriction(0.3, 0.2, v_static=0.01, v_dynamic=0.1),
        BristleFriction(0.3, 0.2, stiffness=1e5, v_stribeck=0.1),
    ]
    pairs = tuple(SimpleNamespace(friction=law) for law in laws)
    rows = np.zeros(5, ROW)
    rows["pair"] = [0, 1, 1, 2, 2]
    rows["depth"], rows["normal_force"] = 2e-4, 5.0
    rows["friction_force_world"] = [0.0, 0.3, 0.4]
    slip = rows["slip_velocity_world"][:, 0]
    slip[:] = [1.0, 0.009, 0.011, 0.0009, 0.0011]
    listed = list_contacts(SceneContacts.from_rows(rows.tobytes()), pairs)
    assert [one["motion"] for one in listed] == [None, "creep", "slip", "stick", "slip"]
    np.testing.assert_allclose([one["depth"] for one in listed], 0.2)
    np.testing.assert_allclose([one["friction"] for one in listed], 0.5)
    np.testing.assert_allclose([one["slip"] for one in listed], 1e3 * slip)
    many = SceneContacts.from_rows(bytes(3 * MOST_LISTED * ROW.itemsize))
    assert len(list_contacts(many, pairs)) == MOST_LISTED
