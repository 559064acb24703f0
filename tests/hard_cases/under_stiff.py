"""Under-stiff laws.

A ball hits a law that cannot stop it within its radius. Scene.explain says so before the run; in
the run the sphere keeps the side it came from, so that the law pushes it back until its center is a
radius beyond the sheet, where contact ends.
"""

import math
from typing import Any

import coal
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from tests import models
from tests.hard_cases.verdict import Verdict, Verdicts, at_most, case, compare

RADIUS, MASS, SPEED = 0.01, 0.2, 3.0


def scene_of(depth: float, solid: bool) -> sp.Scene:
    """Return a scene whose linear law would stop the ball at `depth` [m], without end."""
    law, side, place = sp.ImpactLaw(MASS * (SPEED / depth) ** 2, 1.0), 20 * RADIUS, None
    shell = models.plate(side)
    if solid:
        shell = sp.Shell.from_geometry(coal.Box(side, side, side), side="outside")
        place = pin.SE3(np.eye(3), side * np.array([0.01, 0.02, -0.5]))
    more = {"radius": RADIUS, "shell": shell, "placement": place}
    return models.on_plate(models.slider(0.0, MASS), law, **more)


def expected_speed(depth: float) -> float:
    """Return the speed away from the sheet [m/s] at the end: negative if it went through.

    Contact ends at depth 2 r, and with it the spring's energy there.
    """
    if depth < 2 * RADIUS:
        return SPEED
    return -SPEED * math.sqrt(1 - (2 * RADIUS / depth) ** 2)


def judge(integrator: Any, depth: float, solid: bool, above: bool, bound: float) -> Verdicts:
    """Return the events of the run, and the speed after it."""
    scene = scene_of(depth, solid)
    tried = f"{type(integrator).__name__}, depth {depth / RADIUS:g} r, "
    tried += "solid" if solid else f"sheet from {'above' if above else 'below'}"
    # From 1.5 r above or below, until it would be clear again.
    way, duration = 1.0 if above else -1.0, (1.5 * RADIUS + math.pi * depth) / SPEED
    result = sp.Simulation(scene, integrator).run([1.5 * RADIUS * way], [-SPEED * way], duration)
    due = {"touch", "deep"} if solid else {"touch", "deep", "through"}
    missing = sorted(due - {event.kind for event in result.events})
    law = f"events {', '.join(sorted(due))}"
    found = ", ".join(f"no {kind}" for kind in missing) or "all"
    speed = float(result.v[-1, 0]) * way
    right = expected_speed(depth)
    moved = "comes back as fast" if right > 0 else "goes through, v^2 - k (2 r)^2 / m left"
    yield Verdict.on("under-stiff law", tried, law, "all", found, len(missing), 0)
    yield compare("under-stiff law", tried, moved, right, speed, bound)


@case("laws that cannot stop the sphere")
def under_stiff() -> Verdicts:
    depths = (1.5 * RADIUS, 3 * RADIUS)
    for depth in depths:
        said = scene_of(depth, solid=False).explain([1.5 * RADIUS], [-SPEED]).warnings
        silent = not any("cannot stop the sphere" in warning for warning in said)
        tried = f"depth {depth / RADIUS:g} r"
        yield at_most("under-stiff law", tried, "explain warns of it", float(silent), 0)
    for integrator, bound in (
        (sp.Adaptive(), 1e-4),
        (sp.Implicit(), 1e-2),
        (sp.RungeKutta4(1e-4), 1e-2),
        (sp.SemiImplicitEuler(1e-4), 0.1),
    ):
        for depth in depths:
            for solid, above in ((False, True), (False, False), (True, True)):
                yield from judge(integrator, depth, solid, above, bound)
