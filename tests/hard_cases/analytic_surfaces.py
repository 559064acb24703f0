"""Sliding in curved walls. Meshes of triangles with sides of 0.15 r and exact normals.

The ball (r = 10 mm, m = 50 g) touches at one point. The spring is stiff, the depth is about 1e-5 r:
where it changes on the way, that of the start is taken.
"""

import math

import numpy as np

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Result
from sphshell_pin.study.report.swing import ball_model, mean_period
from tests.hard_cases import surfaces
from tests.hard_cases.balls import (
    GRAVITY,
    MASS,
    PRECISE,
    STIFF,
    scene_of,
    spring,
)
from tests.hard_cases.verdict import Verdicts, at_most, case, compare


def period_along_x(result: Result, velocity: Array, periods: int) -> float:
    return mean_period(result.t, result.q[:, 0], velocity[:, 0], periods)


GENERATOR = 0.050


@case("tautochrone")
def tautochrone() -> Verdicts:
    """The center of a frictionless ball on a cycloid swings in the same time from any height.

    The surface is the cycloid's parallel curve at r, drawn out to a trough.
    """
    periods = []
    shell = surfaces.cycloid_trough(GENERATOR, reach=2.9, width=0.02)
    scene = scene_of(shell, spring(), model=ball_model())
    expected = 4 * math.pi * math.sqrt(GENERATOR / GRAVITY)
    for degrees in (20, 90, 150):
        start = np.array([math.radians(degrees)])
        points, normals = surfaces.cycloid(GENERATOR, start)
        depth = MASS * GRAVITY * normals[0, 2] / STIFF
        result = sp.Simulation(scene, PRECISE).run(
            points[0] - depth * normals[0], None, 2.35 * expected, record_dt=1e-3
        )
        periods.append(period_along_x(result, result.v, 2))
        tried = f"a = 50 mm, from phi = {degrees} deg"
        law = "4 pi sqrt(a / g)"
        yield compare("period", tried, law, expected, periods[-1], 1e-5)
    tried = "from phi = 20, 90 and 150 deg"
    spread = max(periods) / min(periods) - 1
    yield at_most("largest / smallest period - 1", tried, "0", spread, 1e-5)
