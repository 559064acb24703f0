"""Touch and lift-off: where they are, and what it costs to find them."""

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
    assert result.events == tuple(sorted(result.events, key=lambda event: event.t))
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


def thrown(integrator: object, law: object, duration: float, **more: object) -> sp.Result:
    """Throw a ball of 1 kg at a plate with 0.6 m/s, without gravity."""
    scene = models.on_plate(models.ball(gravity=0.0), law)
    q = models.free_q([0.0, 0.0, RADIUS + 1e-3])
    velocity = [0.0, 0.0, -0.6, 0.0, 0.0, 0.0]
    return sp.Simulation(scene, integrator).run(q, velocity, duration, **more)


@both
@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-6])
def test_peaks_lie_between_steps(kind, rtol: float) -> None:
    """All energy is in the spring: m v^2 / 2 = k depth^2.5 / 2.5."""
    figures = thrown(kind(rtol), LAWS["hertz"], 0.02).stats.pairs["ball-plate"]
    depth = (2.5 * 0.6**2 / (2 * 1e6)) ** 0.4
    assert figures.max_depth == pytest.approx(depth, rel=10 * rtol)
    assert figures.peak_force == pytest.approx(1e6 * depth**1.5, rel=10 * rtol)
    # Half of the contact time, 2.9432 depth / v (Johnson, Contact Mechanics, 11.4).
    turn = 1e-3 / 0.6 + 0.5 * 2.9432 * depth / 0.6
    assert figures.max_depth_time == pytest.approx(turn, rel=max(10 * rtol, 1e-3))


@both
def test_the_peak_of_a_damped_force_comes_before_that_of_the_depth(kind) -> None:
    law = sp.HuntCrossleyLaw(1e6, 1.5, dissipation=2.0)
    fine = thrown(kind(1e-10), law, 0.02).stats.pairs["ball-plate"]
    assert fine.peak_force_time < fine.max_depth_time - 1e-4
    coarse = thrown(kind(1e-4), law, 0.02).stats.pairs["ball-plate"]
    assert coarse.peak_force == pytest.approx(fine.peak_force, rel=1e-3)
    assert coarse.max_depth == pytest.approx(fine.max_depth, rel=1e-3)
    assert coarse.peak_force_time == pytest.approx(fine.peak_force_time, rel=1e-2)


def test_the_peak_of_a_stop_lies_between_steps() -> None:
    """A mass on a joint runs into the end of its range: F = v sqrt(k m)."""
    stop = {"ball_joint": sp.JointLimits(-0.01, 0.01, sp.ImpactLaw(1e4, 1.0))}
    scene = sp.Scene(models.slider(gravity=0.0), joints=sp.JointComponents(limits=stop))
    result = sp.Simulation(scene, sp.Adaptive(1e-4)).run([0.0], [-0.6], 0.06)
    figures = result.stats.joints["ball_joint"]
    assert figures.peak_stop_force == pytest.approx(0.6 * np.sqrt(1e4), rel=1e-3)
    assert figures.max_stop_depth == pytest.approx(0.6 / np.sqrt(1e4), rel=1e-3)


def test_fixed_steps_take_peaks_at_their_ends() -> None:
    result = thrown(sp.RungeKutta4(1e-4), LAWS["hertz"], 0.02)
    figures = result.stats.pairs["ball-plate"]
    assert figures.peak_force == result.contacts.normal_force.max()
    assert figures.peak_force_time in result.t
