"""A circular cam lifts a flat follower: Altair MotionSolve's verification problem 7."""

import math

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.models import model_of
from tests.validation.balls import plane
from tests.validation.cases import Outcome, case, read, within
from tests.validation.pictures import Panel

ECCENTRICITY = 0.05  # [m]: half the published displacement
SPEED = 2 * math.pi * 50 / 60  # [rad/s]: 50 rpm, the published velocity over the eccentricity
RADIUS, MASS, GRAVITY = 0.06, 1.0, 9.81  # of the cam [m] and the follower [kg]; the motion has none
STEEL = 2.1e11, 0.3
HEAVY = 1e6  # inertia of the cam [kg m^2]: the follower does not slow it
BOUND = 1e-4


def turn_cam() -> tuple[Array, dict[str, Array]]:
    """Turn the cam, a ball off its axle, by one turn under the plate, from its lowest place.

    Return the angle (n,) [rad], and the motion (n,) of the follower [m], [m/s], [m/s^2].
    """
    model = model_of(
        ("cam", pin.JointModelRUBY(), pin.Inertia(1.0, np.zeros(3), HEAVY * np.eye(3))),
        ("follower", pin.JointModelPZ(), pin.Inertia(MASS, np.zeros(3), np.eye(3))),
        gravity=GRAVITY,
    )
    law = sp.ImpactLaw.hertz(RADIUS, *STEEL, *STEEL)
    scene = sp.Scene(model)
    ball = sp.Sphere(RADIUS, "cam", offset=(0.0, 0.0, -ECCENTRICITY))
    scene.add_contact(ball, plane(2 * (ECCENTRICITY + RADIUS)), "follower", law=law)
    # The follower starts in balance, with the acceleration of the cam's lowest place.
    depth = law.depth_at(MASS * (GRAVITY + ECCENTRICITY * SPEED**2))
    q0 = np.array([1.0, 0.0, RADIUS - ECCENTRICITY - depth])
    duration = 2 * math.pi / SPEED
    simulation = sp.Simulation(scene, sp.Adaptive(1e-10))
    result = simulation.run(q0, [SPEED, 0.0], duration, record_dt=duration / 720)
    return SPEED * result.t, {
        "acceleration": result.contacts.normal_force / MASS - GRAVITY,
        "velocity": result.v[:, 1],
        "displacement": result.q[:, 2] - result.q[0, 2],
    }


@case("cam_and_follower")
def cam_and_follower() -> Outcome:
    """Compare the extremes with the published ones, and the whole motion with the closed form."""
    data = read("cam_and_follower").published
    published = {name: value / 1e3 for name, value in data.items()}
    phase, seen = turn_cam()
    exact = {
        "acceleration": ECCENTRICITY * SPEED**2 * np.cos(phase),
        "velocity": ECCENTRICITY * SPEED * np.sin(phase),
        "displacement": ECCENTRICITY * (1 - np.cos(phase)),
    }
    largest, curves = [], []
    curve = "over the turn, largest distance from the closed form, over its largest"
    for name, form in exact.items():
        error = np.abs(seen[name]).max() / published[name] - 1
        apart = np.abs(seen[name] - form).max() / published[name]
        largest.append((f"largest {name}, relative to the published one", error))
        curves.append((f"{name} {curve}", apart))
    findings = within(BOUND, *largest, *curves)
    panels = [
        Panel(
            "angle of the cam [deg]",
            f"{name} [{unit}]",
            [("published extremes", at, 1e3 * published[name] * np.array(signs))],
            [("ours", np.degrees(phase), 1e3 * seen[name])],
            [("closed form", np.degrees(phase), 1e3 * exact[name])],
        )
        for name, unit, at, signs in (
            ("displacement", "mm", [180.0], [1.0]),
            ("velocity", "mm/s", [90.0, 270.0], [1.0, -1.0]),
            ("acceleration", "mm/s²", [0.0, 180.0], [1.0, -1.0]),
        )
    ]
    return Outcome(findings, panels)
