"""Numbers of the page: nothing lost that matters, nothing that is no number."""

import json
from types import SimpleNamespace

import numpy as np

from sphshell_pin.contact import BristleFriction, CoulombFriction
from sphshell_pin.dynamics.scene.scene_contacts import ROW, SceneContacts
from sphshell_pin.view.live.panel import MOST_LISTED, Panel, dump, list_contacts


def test_a_late_browser_gets_all_rows_and_the_newest_state():
    panel = Panel()
    panel.post("hello", {"type": "hello", "title": "x"})
    for k in range(5):
        panel.publish({"t": k}, [[k, 1.0, 0.1]], ["normal", "friction"], clear=k == 0)
    number, texts = panel.news(0)
    hello, rows, state = map(json.loads, texts)
    assert (hello["type"], state["t"]) == ("hello", 4)
    assert rows["keys"] == ["normal", "friction"]
    assert [row[0] for row in rows["rows"]] == [0, 1, 2, 3, 4]
    assert panel.news(number) == (number, [])
    panel.publish({"t": 5}, [[5, 1.0]], ["depth"], clear=True)
    rows, state = map(json.loads, panel.news(number)[1])
    assert rows == {"type": "rows", "keys": ["depth"], "clear": True, "rows": [[5, 1.0]]}
    # A page that connects now does not get the rows that were cleared.
    assert json.loads(panel.news(0)[1][1])["rows"] == [[5, 1.0]]


def test_json_has_no_nan_and_no_infinity():
    value = {"a": np.nan, "b": [np.inf, np.float64(1 / 3)], "c": np.int32(3), "d": np.bool_(True)}
    told = json.loads(dump({**value, "e": np.array([1.5, -np.inf])}))
    assert told == {"a": None, "b": [None, 0.333333333], "c": 3, "d": True, "e": [1.5, None]}


def test_contacts_are_listed_in_millimeters_and_stick_creep_or_slip():
    creeps = CoulombFriction(0.3, 0.2, v_static=0.01, v_dynamic=0.1)
    sticks = BristleFriction(0.3, 0.2, stiffness=1e5, v_stribeck=0.1)
    pairs = tuple(SimpleNamespace(friction=law) for law in (None, creeps, sticks))
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
    # What is listed as 0.00 mm/s rests; a saddle takes off what two contacts push too much.
    slip[:] = [0.0, 4.9e-6, 5.1e-6, 0.0, 0.0]
    rows["normal_force"][4] = -1.0
    listed = list_contacts(SceneContacts.from_rows(rows.tobytes()), pairs)
    assert [one["motion"] for one in listed] == [None, "rest", "creep", "stick", "saddle"]
    assert [f"{one['slip']:.2f}" for one in listed[1:3]] == ["0.00", "0.01"]
    many = SceneContacts.from_rows(bytes(3 * MOST_LISTED * ROW.itemsize))
    assert len(list_contacts(many, pairs)) == MOST_LISTED
