"""Sensitivities of runs against closed forms and conserved quantities."""

import math

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from tests import models
from tests.sensitivities import (
    ADAPTIVE,
    IMPACT,
    INTEGRATORS,
    LINEAR,
    PAIR,
    Case,
    R,
    drop,
    every_integrator,
)


@every_integrator
def test_ballistic_flight_in_closed_form(integrator: str) -> None:
    """No contact: q by v0 is t, exactly, and no parameter matters."""
    case = drop(LINEAR, INTEGRATORS[integrator], gap=1.0, duration=0.05)
    result = case.run(names=["v0", f"{PAIR}.law.stiffness", "q0"])
    got = result.sensitivities
    assert tuple(got.parameters) == ("v0.0", f"{PAIR}.law.stiffness", "q0.0")
    np.testing.assert_allclose(got.q[:, 0, 0], result.t, rtol=0, atol=1e-13)
    np.testing.assert_allclose(got.v[:, 0, 0], 1.0, rtol=0, atol=1e-13)
    assert not got.q[:, 0, 1].any()
    assert not got.v[:, 0, 1].any()
    np.testing.assert_allclose(got.q[:, 0, 2], 1.0, rtol=0, atol=1e-13)
    np.testing.assert_allclose(got.v[:, 0, 2], 0.0, rtol=0, atol=1e-13)
    assert got.force_world.shape == (0, 3, 3)


@pytest.mark.parametrize("integrator", ["adaptive", "implicit", "runge-kutta"])
def test_a_ball_on_a_linear_spring_in_closed_form(integrator: str) -> None:
    """q = c + a cos wt + b sin wt about the place of rest c = R - g m / k, in touch throughout."""
    m, k, g, depth, speed = 1.0, 4e4, 9.81, 3e-4, 0.01
    case = drop(LINEAR, INTEGRATORS[integrator], gap=-depth, speed=speed)
    result = case.run(names=[f"{PAIR}.law.stiffness", f"{PAIR}.sphere.radius", "q0", "v0"])
    got, t = result.sensitivities, result.t
    assert len(result.contacts.t) == len(t)
    w = math.sqrt(k / m)
    c, s = np.cos(w * t), np.sin(w * t)
    a, b = g * m / k - depth, -speed / w
    # By k: w' = w / 2k, c' = g m / k^2, a' = -c', b' = -b w' / w.
    rest, slower = g * m / k**2, 0.5 * w / k
    by_k = rest * (1 - c) + (b * c - a * s) * slower * t - b * slower / w * s
    closed = np.stack([by_k, 1 - c, c, s / w], axis=1)
    tolerance = 1e-6
    size = np.abs(closed).max(axis=0)
    assert (np.abs(got.q[:, 0] - closed) / size).max() <= tolerance
    closed_v = np.stack([np.zeros_like(t), w * s, -w * s, c], axis=1)
    assert (np.abs(got.v[:, 0] - closed_v) / w)[:, 1:].max() <= tolerance
    # The force is k (R - q), the depth R - q.
    x = R - result.q[:, 0]
    closed_depth = np.array([0.0, 1.0, 0.0, 0.0]) - closed
    closed_force = k * closed_depth + np.outer(x, [1.0, 0.0, 0.0, 0.0])
    assert (np.abs(got.depth - closed_depth) / size).max() <= tolerance
    off = np.abs(got.force_world[:, 2] - closed_force) / np.abs(closed_force).max(axis=0)
    assert off.max() <= tolerance
    assert not got.force_world[:, :2].any()


@pytest.mark.parametrize("integrator", ["adaptive", "implicit", "runge-kutta"])
def test_a_bounce_off_a_linear_spring_in_closed_form(integrator: str) -> None:
    """In touch for pi sqrt(m / k): afterwards q = R + v (T - gap / v - pi sqrt(m / k))."""
    m, k, gap, speed, end = 1.0, 4e4, 0.01, 0.5, 0.06
    case = drop(LINEAR, INTEGRATORS[integrator], gap=gap, speed=speed, gravity=0.0, duration=end)
    result = case.run(names=[f"{PAIR}.law.stiffness", f"{PAIR}.sphere.radius", "q0", "v0"])
    assert [event.kind for event in result.events] == ["touch", "lift_off"]
    touched = math.pi * math.sqrt(m / k)
    got = result.sensitivities
    # Fixed steps do not end at the touch: what the spring does within one is the error.
    tolerance = 1e-7 if integrator != "runge-kutta" else math.sqrt(k / m) * 2e-5
    after = end - touched
    assert result.q[-1, 0] == pytest.approx(R + speed * after - gap, abs=1e-7)
    expected_q = [speed * touched / (2 * k), 2.0, -1.0, -after]
    assert got.q[-1, 0] == pytest.approx(expected_q, rel=2 * tolerance, abs=0.0)
    # The speed of rebound is that of the approach, whatever the spring.
    scale = speed / (2 * k)
    assert abs(got.v[-1, 0, 0]) <= 10 * tolerance * scale
    assert got.v[-1, 0, 1:] == pytest.approx([0.0, 0.0, -1.0], abs=math.sqrt(k / m) * tolerance)


def test_a_pendulum_keeps_the_change_of_its_energy_and_of_area() -> None:
    """E(q, v) is kept, so grad E . s is; the matrix by (q0, p0) has the determinant 1."""
    model = models.empty()
    lump = pin.Inertia(1.3, np.array([0.0, 0.0, -0.4]), 0.02 * np.eye(3))
    models.add_body(model, "bob", pin.JointModelRY(), inertia=lump)
    scene = sp.Scene(model)
    case = Case(scene, [1.1], [0.7], 3.0, ADAPTIVE, record_dt=0.05)
    result = case.run(names=["q0", "v0"])
    got = result.sensitivities
    inertia = 1.3 * 0.4**2 + 0.02
    slope = np.stack([1.3 * 9.81 * 0.4 * np.sin(result.q[:, 0]), inertia * result.v[:, 0]], axis=1)
    both = np.stack([got.q[:, 0], got.v[:, 0]], axis=1)
    change = np.einsum("ni,nij->nj", slope, both)
    np.testing.assert_allclose(change, np.broadcast_to(slope[0], change.shape), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(both), 1.0, rtol=0, atol=1e-6)
    assert np.abs(both).max() > 2.0


def test_sliding_in_closed_form() -> None:
    """Far above the static range the deceleration is mu g: v by mu is -g t, q by mu -g t^2 / 2."""
    model = models.empty()
    models.add_body(model, "ball", pin.JointModelTranslation())
    friction = sp.CoulombFriction(0.2, 0.2, 1e-4, 1e-3)
    scene = models.on_plate(model, IMPACT, friction)
    depth = IMPACT.depth_at(9.81)
    case = Case(scene, [0.0, 0.0, R - depth], [0.4, 0.0, 0.0], 0.1)
    result = case.run(names=["v0", f"{PAIR}.law.stiffness", f"{PAIR}.friction.mu_dynamic"])
    got, t = result.sensitivities, result.t
    np.testing.assert_allclose(got.v[:, 0, -1], -9.81 * t, rtol=0, atol=1e-6)
    np.testing.assert_allclose(got.q[:, 0, -1], -9.81 * t**2 / 2, rtol=0, atol=1e-7)
    np.testing.assert_allclose(got.q[:, 0, 0], t, rtol=0, atol=1e-7)
    np.testing.assert_allclose(got.force_world[:, 0, -1], -9.81, rtol=1e-6)
    # A stiffer spring is pressed in less, and carries the same.
    sinks = depth / (1.5 * IMPACT.stiffness)
    assert got.depth[0, 1] == 0.0
    assert np.abs(got.depth[:, 1]).max() <= 3 * sinks
