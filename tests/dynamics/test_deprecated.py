"""Former names warn, and give what the present ones give."""

from __future__ import annotations

import importlib
import warnings
from pathlib import Path

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.scenario import RunReport, build
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.scenario.running.replay import Replay
from tests.models import LAW, ball, free_q, on_plate, plate


def test_a_law_that_nobody_states() -> None:
    scene = sp.Scene(ball())
    sphere = sp.Sphere(0.05, "ball")
    with pytest.warns(FutureWarning, match=r"law=ImpactLaw\.from_adams") as caught:
        pair = scene.add_contact(sphere, plate())
    assert caught[0].filename == __file__
    assert pair.law == sp.ImpactLaw.from_adams()
    with pytest.warns(FutureWarning, match="law"):
        scene.add_contact_source(lambda i, j: ([], [], []), "ball", "universe")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene.add_contact(sphere, plate(), law=LAW)


@pytest.mark.parametrize(
    ("former", "now"),
    [("frame", "frame_j"), ("sphere_placement", "placement_i"), ("shell_placement", "placement_j")],
)
def test_names_of_a_pair(former: str, now: str) -> None:
    pair = on_plate(ball(), LAW).pairs[0]
    with pytest.warns(DeprecationWarning, match=now) as caught:
        assert getattr(pair, former) == getattr(pair, now)
    assert caught[0].filename == __file__


def test_names_of_reports_and_live_runs() -> None:
    live = LiveRun(build("sphere_on_shell"))
    with pytest.warns(DeprecationWarning, match=r"LiveRun\.knobs.* it is called parameters"):
        assert live.knobs == live.parameters != ()
    with pytest.warns(DeprecationWarning, match=r"Replay\.knobs"):
        assert object.__new__(Replay).knobs == ()
    nothing = (None, None, Path(), (), (), (), None, None)
    with pytest.warns(DeprecationWarning, match=r"RunReport\.doubts"):
        assert RunReport(*nothing, ("too far",)).doubts == ("too far",)


@pytest.mark.parametrize(
    ("module", "former", "now"),
    [
        ("sphshell_pin", "JointIngredients", "JointComponents"),
        ("sphshell_pin.dynamics", "JointIngredients", "JointComponents"),
        ("sphshell_pin.parameters", "Ingredient", "Component"),
        ("sphshell_pin.scenario", "Knob", "LiveParameter"),
        ("sphshell_pin.scenario", "knobs_of", "live_parameters"),
    ],
)
def test_names_of_a_module(module: str, former: str, now: str) -> None:
    of = importlib.import_module(module)
    with pytest.warns(DeprecationWarning, match=f"it is called {now}") as caught:
        assert getattr(of, former) is getattr(of, now)
    assert caught[0].filename == __file__
    with pytest.raises(AttributeError, match="has no attribute 'Knobs'"):
        of.Knobs  # noqa: B018


def test_stats_were_a_dict() -> None:
    result = sp.Simulation(on_plate(ball(), LAW)).run(free_q([0, 0, 0.049]), None, 0.01)
    assert result.stats.integrator == "Adaptive"
    (name,) = result.stats.pairs
    with pytest.warns(DeprecationWarning, match=r"\.steps"):
        assert result.stats["steps"] == result.stats.steps > 0
    with pytest.warns(DeprecationWarning, match=r"\.peak_force"):
        peak = result.stats.pairs[name]["peak_force"]
    assert peak == result.stats.pairs[name].peak_force > 0
    with pytest.warns(DeprecationWarning, match="RunStats"):
        assert dict(result.stats) == vars(result.stats)
    with pytest.raises(KeyError):
        result.stats["nonsense"]
    assert result.stats.get("nonsense") is None


def test_contacts_had_numbers() -> None:
    contacts = on_plate(ball(), LAW).contacts(free_q([0, 0, 0.049]))
    with pytest.warns(DeprecationWarning, match="contact_id"):
        assert np.array_equal(contacts.number, contacts.contact_id)
