"""Restitution of Hunt and Crossley's law in closed form, and EXUDYN's figures beside it.

F = k d^n (1 + b v), v = d': m v dv/dd = -F, so that with u = b v
u du / (1 + u) = -(b^2 k / m) d^n dd. From the touch, u = c, to the largest depth and back to no
depth, u = -x, the right side adds up to zero: c - ln(1 + c) = -x - ln(1 - x). Restitution is x / c:
it depends on c = b v alone.
"""

import math

import numpy as np

import sphshell_pin as sp
from sphshell_pin.contact.normal_law import bisect
from tests import models
from tests.validation.balls import plane
from tests.validation.cases import Outcome, case, read, within
from tests.validation.pictures import Panel

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
    if c == 0:
        return 1.0
    lost = c - math.log1p(c)
    return bisect(lambda x: -x - math.log1p(-x) - lost, 0.0, min(c, 1.0 - 1e-15)) / c


def bounce(mass: float, law: sp.HuntCrossleyLaw, speed: float) -> float:
    """Return the measured restitution of a sphere that meets a plane at `speed` [m/s]."""
    scene = models.on_shell(models.slider(0.0, mass), plane(1.0), law, radius=RADIUS)
    undamped = sp.ImpactLaw(law.stiffness, law.exponent)
    touching = undamped.contact_time(undamped.depth_of(0.5 * mass * speed**2), speed)
    simulation, duration = sp.Simulation(scene, sp.Adaptive(1e-10)), GAP / speed + 4 * touching
    result = simulation.run([RADIUS + GAP], [-speed], duration)
    assert [event.kind for event in result.events] == ["touch", "lift_off"]
    return float(result.v[-1, 0]) / speed


@case("hunt_crossley")
def hunt_crossley() -> Outcome:
    """Compare four bodies with the closed form, and one of them with EXUDYN's figures."""
    data = read("exudyn_restitution")
    c, theirs = 1.5 * (1 - data["asked"]), data["after [m/s]"] / data["before [m/s]"]
    exact = np.array([hunt_crossley_restitution(1.0, one) for one in c])
    seen = np.array(
        [
            [bounce(mass, sp.HuntCrossleyLaw(k, n, one / speed), speed) for one in c]
            for _, mass, k, n, speed in BODIES
        ]
    )
    off, apart = np.abs(seen / exact - 1).max(), np.abs(theirs / seen[0] - 1).max()
    findings = [
        *within(1e-6, ("four bodies, error relative to the closed form", off)),
        *within(5e-4, ("EXUDYN's sphere, relative to EXUDYN's figures", apart)),
    ]
    published = [("EXUDYN, first of three impacts", c[::3], theirs[::3])]
    published += [("asked of EXUDYN", c[::3], data["asked"][::3])]
    ours = [(body[0], c[::3], one[::3]) for body, one in zip(BODIES, seen, strict=True)]
    fine = np.linspace(0.0, 1.5, 151)
    line = ("closed form", fine, [hunt_crossley_restitution(1.0, one) for one in fine])
    panel = Panel("c = b v", "restitution", published, ours, [line])
    return Outcome(findings, [panel])
