"""Touch and lift-off: where they are, and what it costs to find them."""

from __future__ import annotations

import numpy as np
import pytest

import sphshell_pin as sp
from tests import models

RADIUS, DROP = 0.05, 0.05
# Evaluations of an accepted step and of one that is tried again.
STEP = {sp.Adaptive: 7, sp.Implicit: 8}
LAWS = {
    "linear": models.linear_law(4000.0),
    "damped": models.linear_law(4000.0, 1.0),
    "hertz": sp.ImpactLaw(1e6, 1.5),
    "hunt-crossley": sp.HuntCrossleyLaw(1e6, 1.5, 0.2),
}
tolerances = pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
both = pytest.mark.parametrize("kind", [sp.Adaptive, sp.Implicit])


def bounce(integrator: sp.Adaptive | sp.Implicit, law: object, **more: object) -> sp.Result:
    """Drop a ball on a plate for two seconds: eight bounces or more."""
    scene = models.on_plate(models.ball(), law)
    q = models.free_q([0.1, -0.05, RADIUS + DROP])
    return sp.Simulation(scene, integrator).run(q, None, 2.0, **more)


def touches(result: sp.Result) -> list[float]:
    return [event.t for event in result.events if event.kind == "touch"]


@both
@tolerances
@pytest.mark.parametrize("law", LAWS)
def test_a_bounce_costs_few_evaluations(kind, rtol: float, law: str) -> None:
    """All evaluations but those of accepted steps: tried again for their error, or for events.

    A bounce has two events; with a damped law three, as its clamp is one.
    """
    result = bounce(kind(rtol), LAWS[law])
    count = len(touches(result))
    assert count >= 8
    stats = result.stats
    beyond = stats.evaluations - STEP[kind] * stats.steps
    assert beyond / count <= (60 if law in ("linear", "hertz") else 90)
    # No dynamics in these: contacts alone, on the dense output.
    assert stats.event_queries / count <= 120


@both
@tolerances
def test_touch_times_against_the_closed_form(kind, rtol: float) -> None:
    """A ball on an elastic plate comes back for ever, after equal times."""
    stiffness, gravity = 4000.0, 9.81
    result = bounce(kind(rtol), LAWS["linear"])
    speed, omega = np.sqrt(2 * gravity * DROP), np.sqrt(stiffness)
    # In touch: depth = sag (1 - cos) + speed / omega sin, until it is zero again.
    half = np.pi - np.arctan(speed * omega / gravity)
    period = 2 * half / omega + 2 * speed / gravity
    times = np.array(touches(result))
    exact = speed / gravity + period * np.arange(len(times))
    assert times[0] == pytest.approx(exact[0], abs=1e-3 * rtol)
    assert times == pytest.approx(exact, abs=20 * rtol)


@both
@pytest.mark.parametrize("law", LAWS)
def test_a_step_ends_at_each_event(kind, law: str) -> None:
    """A contact begins with hardly any depth, and the row before its end has hardly any."""
    result = bounce(kind(1e-6), LAWS[law])
    depth = np.zeros(len(result.t))
    depth[result.contacts.row] = result.contacts.depth
    for event in result.events:
        row = int(np.searchsorted(result.t, event.t))
        assert result.t[row] == event.t
        near = row if event.kind == "touch" else row - 1
        assert 0 <= depth[row] < 1e-10 if near == row else depth[row] == 0


def test_the_first_of_several_events_ends_the_step() -> None:
    """Two spheres of one body over a plate touch one after the other."""
    model = models.slider()
    scene = sp.Scene(model)
    for name, low in (("low", 0.0), ("high", 3e-6)):
        scene.add_contact(
            sp.Sphere(RADIUS, "ball", (0.2 * (name == "low"), 0.0, low)),
            models.plate(),
            law=LAWS["linear"],
            name=name,
        )
    result = sp.Simulation(scene, sp.Adaptive(1e-5)).run([RADIUS + DROP], None, 0.15)
    first = [(event.pair, event.t) for event in result.events if event.kind == "touch"][:2]
    assert [pair for pair, _ in first] == ["low", "high"]
    speed = np.sqrt(2 * 9.81 * DROP)
    assert first[1][1] - first[0][1] == pytest.approx(3e-6 / speed, rel=1e-3)
