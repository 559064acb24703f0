"""Restitution of Hunt and Crossley's law in closed form, and EXUDYN's figures beside it.

F = k d^n (1 + b v), v = d': m v dv/dd = -F, so that with u = b v
u du / (1 + u) = -(b^2 k / m) d^n dd. From the touch, u = c, to the largest depth and back to no
depth, u = -x, the right side adds up to zero: c - ln(1 + c) = -x - ln(1 - x). Restitution is x / c:
it depends on c = b v alone.
"""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.benchmarks.models import model_of
from sphshell_pin.cases.contents import Finding
from sphshell_pin.study.validation.balls import plane
from sphshell_pin.study.validation.cases import Array, Outcome, case, read
from sphshell_pin.study.validation.pictures import Panel, draw

RADIUS, GAP = 0.1, 1e-4  # [m]
BODIES = (
    ("EXUDYN's sphere", 1.6, 1e6, 1.0, 10.0),
    ("Hertz's exponent", 0.05, 1e8, 1.5, 1.0),
    ("heavy, soft, exponent 2.2", 20.0, 1e5, 2.2, 0.3),
    ("light, stiff, exponent 3", 1e-3, 1e12, 3.0, 5.0),
)
"""Name, mass [kg], stiffness [N/m^n], exponent n, impact speed [m/s]."""


def hunt_crossley_restitution(speed: float, dissipation: float) -> float:
    """Return the restitution at an impact `speed` [m/s] with the `dissipation` b [s/m]."""
    c = dissipation * speed
    lost = c - math.log1p(c)
    low, high = 0.0, min(c, 1.0 - 1e-15)
    for _ in range(200):
        x = 0.5 * (low + high)
        if -x - math.log1p(-x) < lost:
            low = x
        else:
            high = x
    return 0.5 * (low + high) / c if c > 0 else 1.0


def bounce(mass: float, law: sp.HuntCrossleyLaw, speed: float) -> float:
    """Return the measured restitution of a sphere that meets a plane at `speed` [m/s]."""
    sphere = ("ball", pin.JointModelPZ(), pin.Inertia.FromSphere(mass, RADIUS))
    scene = sp.Scene(model_of(sphere))
    scene.add_contact(sp.Sphere(RADIUS, "ball"), plane(1.0), law=law)
    undamped = sp.ImpactLaw(law.stiffness, law.exponent)
    touching = undamped.contact_time(undamped.depth_of(0.5 * mass * speed**2), speed)
    result = sp.Simulation(scene, sp.Adaptive(1e-10)).run(
        [RADIUS + GAP], [-speed], GAP / speed + 4 * touching
    )
    assert [event.kind for event in result.events] == ["touch", "lift_off"]
    return float(result.v[-1, 0]) / speed


@case("hunt_crossley")
def hunt_crossley() -> Outcome:
    """Compare four bodies with the closed form, and one of them with EXUDYN's figures."""
    data = read("exudyn_restitution")
    strengths = 1.5 * (1 - data["asked"])
    exact = np.array([hunt_crossley_restitution(1.0, c) for c in strengths])
    seen = {
        name: np.array(
            [bounce(mass, sp.HuntCrossleyLaw(k, n, c / speed), speed) for c in strengths]
        )
        for name, mass, k, n, speed in BODIES
    }
    after = np.stack([data[f"{which} [m/s]"] for which in ("first", "second", "third")], axis=1)
    # Each impact is one at b v = c: EXUDYN takes the speed of that impact.
    theirs: Array = after / np.column_stack([np.full(len(after), 10.0), after[:, :2]])
    findings = [
        Finding(
            "form",
            "restitution, four bodies, largest distance from the closed form, relative",
            max(float(np.abs(one / exact - 1).max()) for one in seen.values()),
            aim=1e-6,
        ),
        Finding(
            "exudyn",
            "restitution of EXUDYN's sphere, largest distance from EXUDYN's figures, relative",
            float(np.abs(theirs / seen[BODIES[0][0]][:, None] - 1).max()),
            aim=5e-4,
        ),
    ]
    fine = np.linspace(0.0, 1.5, 151)
    line = [hunt_crossley_restitution(1.0, c) for c in fine]
    panels = [
        Panel(
            "c = b v",
            "restitution",
            [("EXUDYN", strengths, theirs[:, 0]), ("asked of EXUDYN", strengths, data["asked"])],
            [(name, strengths, one) for name, one in seen.items()],
            [("closed form", fine, line)],
        ),
        Panel(
            "c = b v",
            "distance from the closed form, relative [1e-5]",
            [
                (f"EXUDYN, {which} impact", strengths, 1e5 * (theirs[:, k] / exact - 1))
                for k, which in enumerate(("first", "second", "third"))
            ],
            [(name, strengths, 1e5 * (one / exact - 1)) for name, one in seen.items()],
        ),
    ]
    caption = "Restitution of four bodies, with EXUDYN's figures, and how far both are off."
    return Outcome(findings, [draw("hunt_crossley", panels, caption)])
