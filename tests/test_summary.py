"""What an object shows of itself: a line or two of text."""

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.base.summary import show_value
from sphshell_pin.study.fit import Fit, Fitted
from tests import models
from tests.view import stand_ins

RADIUS = 0.01


@pytest.fixture(scope="module")
def shown() -> dict[str, object]:
    """One of each of the objects that a session leaves in a notebook's cell."""
    sheet, law = stand_ins.plate(2.0, "<b>sheet</b>"), sp.ImpactLaw(1e5, 1.5, 10.0, 1e-4)
    scene = sp.Scene(models.ball())
    pair = scene.add_contact(sp.Sphere(RADIUS, "ball"), sheet, law=law, name="ball-sheet")
    simulation = sp.Simulation(scene, sp.RungeKutta4(1e-4))
    start, low = (models.free_q([0, 0, RADIUS + gap]) for gap in (1e-4, -1e-4))
    asked = ["ball-sheet.law.stiffness"]
    result = simulation.run(start, duration=0.02, record_dt=1e-3, sensitivities=asked)
    found = (Fitted("contact.0.law.k", "N/m", 1.0, 2.0, 1.5, 2.5, True),)
    rest = {"dof": 3, "level": 0.95, "runs": 7, "converged": True}
    fit = Fit("drop.toml", found, correlation=np.eye(1), series=(), remarks=("a < b",), **rest)
    return {
        "scene": scene,
        "pair": pair,
        "shell": sheet,
        "health": sheet.health,
        "contacts": sheet.contacts([0, 0, RADIUS - 1e-4], RADIUS),
        "closest": sheet.closest_points(np.zeros((5, 3))),
        "scene_contacts": scene.contacts(low),
        "explanation": scene.explain(low),
        "simulation": simulation,
        "state": scene.state(start),
        "result": result,
        "log": result.contacts,
        "energy": result.energy,
        "stats": result.stats,
        "sensitivities": result.sensitivities,
        "rollout": simulation.rollout([start] * 3, None, 0.01),
        "dynamics": scene.dynamics_derivatives(low),
        "step": simulation.step_derivatives(low),
        "forces": scene.contact_force_derivatives(low),
        "fit": fit,
    }


TEXTS = ("health", "explanation")  # whole texts, as print shows them


def test_no_object_is_shown_by_its_address_or_its_arrays(shown):
    for name, one in shown.items():
        text = repr(one)
        assert " at 0x" not in text, name
        assert "array(" not in text, name
        assert len(text.splitlines()) <= (60 if name in TEXTS else 3), name
        assert max(map(len, text.splitlines())) <= (200 if name in TEXTS else 88), name


def test_figures_are_those_of_the_object_with_units(shown):
    result = shown["result"]
    peak = result.stats.pairs["ball-sheet"].peak_force
    assert peak > 0
    assert f"peak force {peak:.4g} N" in repr(result)
    assert f"{len(result.t)} rows" in repr(result)
    assert repr(shown["contacts"]) == "<ContactSet: 1 contact, largest depth 0.0001 m, on face>"
    assert "contact.0.law.k 2 N/m" in repr(shown["fit"])
    assert "<b>sheet</b>" in repr(shown["shell"])


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.23456, "1.235"),
        (float("nan"), "none"),
        (True, "yes"),
        (np.zeros((3, 4, 5)), "3 x 4 x 5"),
        (np.array([1.0, 2.5]), "(1, 2.5)"),
        (np.array(2.0), "2"),
        ((), "none"),
        (("a", "b"), "'a', 'b'"),
    ],
)
def test_values(value, text):
    assert show_value(value) == text
