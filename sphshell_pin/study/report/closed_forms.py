"""Cases of work and precision with a closed form: a ball on springs, bounces, a stiff plate."""

import math
from collections.abc import Callable

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.study.report.models import model_of
from sphshell_pin.study.report.motions import Case, decades, rectangle, steps
from sphshell_pin.study.report.swing import GRAVITY, MASS, RADIUS

Kind = Callable[[float], Integrator]


def settings() -> tuple[Integrator, ...]:
    """Return every integrator, with steps [s] or tolerances from coarse to fine."""
    fixed: tuple[Kind, ...] = (sp.SemiImplicitEuler, sp.RungeKutta4, sp.LinearlyImplicitEuler)
    adaptive: tuple[Kind, ...] = (sp.Adaptive, sp.Implicit)
    dts = (1e-3, 4e-4, 2e-4, 1e-4, 4e-5, 2e-5, 1e-5)
    return (
        *(made for kind in fixed for made in steps(kind, *dts)),
        *(made for kind in adaptive for made in decades(kind, *range(2, 11))),
    )


def ball_on_plate(law: sp.ImpactLaw, joint: pin.JointModel) -> sp.Scene:
    """Return a ball on `joint` above the plate z = 0."""
    ball = ("ball", joint, pin.Inertia.FromSphere(MASS, RADIUS))
    scene = sp.Scene(model_of(ball, gravity=GRAVITY))
    scene.add_contact(sp.Sphere(RADIUS, "ball"), rectangle(0.1, 0.1), law=law)
    return scene


def bob() -> Case:
    """Let a ball bob on an undamped spring that it never leaves: a cosine."""
    stiffness = 1e4
    omega, sag = math.sqrt(stiffness / MASS), MASS * GRAVITY / stiffness
    amplitude = 0.8 * sag
    return Case(
        name="bob",
        title="Ball bobs on a spring",
        judged="error of height / amplitude, against a cosine",
        scene=ball_on_plate(sp.ImpactLaw(stiffness, 1.0), pin.JointModelPZ()),
        q0=np.array([RADIUS - sag + amplitude]),
        duration=0.1,
        record_dt=0.004,
        figures=lambda result: [(result.q - RADIUS + sag) / amplitude],
        exact=lambda t: [np.cos(omega * t)[:, None]],
        integrators=settings(),
        quick_dt=4e-5,
    )


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
        name="bounces",
        title="Ball bounces five times",
        judged="error of height / fall, against parabolas and sines",
        scene=ball_on_plate(sp.ImpactLaw(stiffness, 1.0), pin.JointModelPZ()),
        q0=np.array([RADIUS + FALL]),
        duration=0.74,
        record_dt=0.02,
        figures=lambda result: [(result.q - RADIUS) / FALL],
        exact=lambda t: [bounce(t, stiffness)[0][:, None] / FALL],
        integrators=settings(),
        quick_dt=4e-5,
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

    def exact(t: Array) -> list[Array]:
        decay = (fast * np.exp(slow * t) - slow * np.exp(fast * t)) / (fast - slow)
        return [np.c_[np.cos(omega * t), np.zeros_like(t), 1 + 0.5 * decay]]

    return Case(
        name="glide",
        title="Ball glides on a stiff plate",
        judged="error of way / reach, of depth / depth at rest",
        scene=ball_on_plate(law, pin.JointModelTranslation()),
        controller=sp.JointPD([SPRING, 0, 0], 0.0, np.zeros(3), gravity_compensation=False),
        q0=np.array([REACH, 0.0, RADIUS - sag - deeper]),
        duration=0.5,
        record_dt=0.02,
        figures=lambda result: [
            np.c_[result.q[:, :1] / REACH, result.q[:, 1:2], (RADIUS - result.q[:, 2:]) / sag]
        ],
        exact=exact,
        integrators=(
            *steps(sp.SemiImplicitEuler, 4e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6),
            *steps(sp.RungeKutta4, 2e-5, 1e-5, 5e-6, 2e-6),
            *steps(sp.LinearlyImplicitEuler, 1e-2, 4e-3, 2e-3, 1e-3, 4e-4, 2e-4, 1e-4, 4e-5),
            *decades(sp.Adaptive, 2, 3, 4, 5, 6, 7),
            *decades(sp.Implicit, 2, 3, 4, 5, 6, 7, 8, 9),
        ),
        quick_dt=5e-6,
    )
