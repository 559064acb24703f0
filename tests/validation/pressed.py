"""Balls pressed together at rest."""

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.study.report.models import model_of
from tests.validation.cases import Outcome, case, read, within
from tests.validation.pictures import Panel

RADIUS, YOUNG, POISSON = 0.05, 2e10, 0.3


@case("ssnv104")
def two_balls() -> Outcome:
    """Press two balls together, and compare pressure and radius of the contact."""
    data = read("ssnv104")
    upper = ("upper", pin.JointModelPZ(), pin.Inertia.FromSphere(1.0, RADIUS))
    scene = sp.Scene(model_of(upper, gravity=9.81))
    balls = sp.Sphere(RADIUS, "upper"), sp.Sphere(RADIUS, "universe")
    scene.add_contact(*balls, law=sp.HertzLaw(YOUNG, POISSON))

    def pressed(approach: float) -> tuple[float, float]:
        """Return peak pressure [Pa] and radius [m] of the contact, as a run records them."""
        start = np.array([2 * RADIUS - approach])
        instant = sp.Simulation(scene, sp.SemiImplicitEuler(1e-9))
        patch = instant.run(start, duration=1e-9, record=("patch",)).patches[0]
        return float(patch["peak_pressure"]), float(patch["half_axes"][0])

    there = [float(data[name][0]) for name in ("pressure", "radius")]
    apart = np.array(pressed(4e-3)) / there - 1
    names = "peak pressure, relative", "radius of the contact, relative"
    findings = within(1e-4, *zip(names, apart, strict=True))
    approaches = np.linspace(1e-5, 5e-3, 60)
    ours = np.array([pressed(one) for one in approaches]).T
    panels = [
        Panel("approach [mm]", label, [("Code_Aster", [4.0], [unit * value])],
              [("ours", 1e3 * approaches, unit * line)])
        for label, unit, value, line in zip(
            ("peak pressure [MPa]", "radius of the contact [mm]"), (1e-6, 1e3), there, ours,
            strict=True,
        )
    ]  # fmt: skip
    return Outcome(findings, panels)
