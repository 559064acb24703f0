"""Motions with a closed form: bounces, a stiff plate."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Result
from sphshell_pin.dynamics.run.advance import AnyController
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.study.report.models import model_of
from sphshell_pin.study.report.swing import GRAVITY, MASS, RADIUS

DTS = (1e-3, 4e-4, 2e-4, 1e-4, 4e-5, 2e-5, 1e-5)


@dataclass(frozen=True, kw_only=True)
class Case:
    """A run of a closed form, and steps `dts` [s] of explicit and of implicit methods.

    `figures` reads dimensionless vectors (n, k) off the rows of a result, `exact` has them at times
    (n,): the error is the largest length of a difference. Fixed steps divide `record_dt` [s].
    """

    title: str
    scene: sp.Scene
    controller: AnyController = None
    q0: Array
    duration: float
    record_dt: float
    figures: Callable[[Result], Array]
    exact: Callable[[Array], Array]
    dts: tuple[float, ...] = DTS
    implicit_dts: tuple[float, ...] = DTS
    finest: int = 10

    @property
    def integrators(self) -> list[Integrator]:
        """Every integrator, with steps or tolerances from coarse to fine."""
        fixed = {sp.SemiImplicitEuler: self.dts, sp.RungeKutta4: self.dts}
        fixed[sp.LinearlyImplicitEuler] = self.implicit_dts
        tolerances = [10.0**-digits for digits in range(2, self.finest + 1)]
        return [
            *(kind(dt) for kind, dts in fixed.items() for dt in dts),
            *(kind(rtol) for kind in (sp.Adaptive, sp.Implicit) for rtol in tolerances),
        ]

    def run(self, integrator: Integrator, duration: float | None = None) -> Result:
        """Run for `duration` [s], the case's own unless given."""
        duration = self.duration if duration is None else duration
        simulation = sp.Simulation(self.scene, integrator)
        return simulation.run(self.q0, None, duration, self.controller, record_dt=self.record_dt)

    def error(self, result: Result) -> float:
        """Return the largest error at any row of a result."""
        off = self.figures(result) - self.exact(result.t)
        return float(np.linalg.norm(off, axis=1).max())


def ball_on_plate(law: sp.ImpactLaw, joint: pin.JointModel) -> sp.Scene:
    """Return a ball on `joint` above the plate z = 0."""
    ball = ("ball", joint, pin.Inertia.FromSphere(MASS, RADIUS))
    scene = sp.Scene(model_of(ball, gravity=GRAVITY))
    square = sp.Shell(
        0.1 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), [[0, 1, 2, 3]]
    )
    scene.add_contact(sp.Sphere(RADIUS, "ball"), square, law=law)
    return scene


FALL = 0.02  # [m]


def bounce(t: Array, stiffness: float) -> tuple[Array, Array]:
    """Return how far (n,) [m] above the plate the ball's lowest point is, and its speed [m/s].

    It is let go at t = 0, FALL above the plate.
    """
    omega, speed = math.sqrt(stiffness / MASS), math.sqrt(2 * GRAVITY * FALL)
    flight = 2 * speed / GRAVITY
    touch = 2 * (math.pi - math.atan(speed * omega / GRAVITY)) / omega
    since = (t + flight / 2) % (flight + touch)
    angle, sag = omega * (since - flight), GRAVITY / omega**2
    flying = speed * since - 0.5 * GRAVITY * since**2, speed - GRAVITY * since
    pressed = (
        sag * (np.cos(angle) - 1) - speed / omega * np.sin(angle),
        -sag * omega * np.sin(angle) - speed * np.cos(angle),
    )
    height, upward = np.where(since <= flight, flying, pressed)
    return height, upward


def bounces() -> Case:
    """Let a ball fall on an undamped spring, five times: parabolas and sines, joined."""
    stiffness = 1e4
    return Case(
        title="Ball bounces five times",
        scene=ball_on_plate(sp.ImpactLaw(stiffness, 1.0), pin.JointModelPZ()),
        q0=np.array([RADIUS + FALL]),
        duration=0.74,
        record_dt=0.02,
        figures=lambda result: (result.q - RADIUS) / FALL,
        exact=lambda t: bounce(t, stiffness)[0][:, None] / FALL,
    )


STIFF, SPRING, REACH = 1e6, 5.0, 0.05  # plate and slow spring [N/m], amplitude along it [m]


def glide() -> Case:
    """Let a ball glide on a stiff, overdamped plate, to and fro on a soft spring.

    Along the plate a cosine of 10 rad/s; into it the sum of two decays, of 1e2 and 2e5 per second,
    towards the depth of rest. Explicit steps must resolve the fast one for as long as it lasts.
    """
    damping = 1e4
    sag = MASS * GRAVITY / STIFF
    law = sp.ImpactLaw(STIFF, 1.0, damping, 0.1 * sag)
    root = math.sqrt(damping**2 - 4 * MASS * STIFF)
    slow, fast = (-damping + root) / (2 * MASS), (-damping - root) / (2 * MASS)
    omega, deeper = math.sqrt(SPRING / MASS), 0.5 * sag  # that much deeper than at rest at first

    def exact(t: Array) -> Array:
        decay = (fast * np.exp(slow * t) - slow * np.exp(fast * t)) / (fast - slow)
        return np.stack([np.cos(omega * t), np.zeros_like(t), 1 + 0.5 * decay], axis=1)

    return Case(
        title="Ball glides on a stiff plate",
        scene=ball_on_plate(law, pin.JointModelTranslation()),
        controller=sp.JointPD([SPRING, 0, 0], 0.0, np.zeros(3), gravity_compensation=False),
        q0=np.array([REACH, 0.0, RADIUS - sag - deeper]),
        duration=0.5,
        record_dt=0.02,
        figures=lambda result: np.c_[
            result.q[:, :1] / REACH, result.q[:, 1:2], (RADIUS - result.q[:, 2:]) / sag
        ],
        exact=exact,
        dts=(4e-5, 2e-5, 1e-5, 5e-6, 2e-6),
        implicit_dts=(1e-2, 4e-3, 2e-3, 1e-3, 4e-4, 2e-4, 1e-4, 4e-5),
        finest=7,
    )
