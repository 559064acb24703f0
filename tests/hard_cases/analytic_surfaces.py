"""Rolling and sliding in curved walls. Meshes of triangles with sides of 0.15 r and exact normals.

The ball (r = 10 mm, m = 50 g, I = 2/5 m r^2) touches at one point for both bodies, so it rolls on
the lever `r - depth`, with `b = I / (m (r - depth)^2)`, and its center is at `R - r + depth` from
the axis of a hollow wall. The springs are stiff, the depth is about 1e-5 r: where it changes on the
way, that of the start is taken.
"""

import math

import numpy as np

import sphshell_pin as sp
from sphshell_pin.study.report.swing import ball_model, downward_crossings, mean_period
from tests.hard_cases import balls, surfaces
from tests.hard_cases.verdict import Verdicts, at_most, case, compare

DOME = 0.040


@case("leaves a dome")
def dome() -> Verdicts:
    """Energy (1 + b) v^2 / 2 = g L (1 - cos) + (1 + b) v0^2 / 2 and m g cos = m v^2 / L."""
    # Strong damping would let the ball off before its depth is zero.
    law, depth = balls.spring(1e8, ratio=0.02), balls.MASS * balls.GRAVITY / 1e8
    for speed, rolls in ((0.05, True), (0.4, True), (0.05, False)):
        friction = balls.bristle(1e4, 1e8) if rolls else None
        scene = balls.scene_of(surfaces.sphere(DOME), law, friction)
        arm, b = DOME + balls.RADIUS, balls.beta() if rolls else 0.0
        expected = (2 + (1 + b) * speed**2 / (balls.GRAVITY * arm)) / (3 + b)
        q0, v0 = balls.state([0.0, 0.0, arm - depth], [speed, 0.0, 0.0])
        v0[4] = speed / (balls.RADIUS - depth) if rolls else 0.0
        result = sp.Simulation(scene, balls.PRECISE).run(q0, v0, 1.0, record_dt=1e-4)
        left = balls.event_times(result, "lift_off")[0]
        center = [np.interp(left, result.t, column) for column in result.q[:, :3].T]
        seen = float(center[2] / np.linalg.norm(center))
        tried = f"R = 4 r, v0 = {speed:g} m/s, {'rolling' if rolls else 'frictionless'}"
        formula = "cos = (10 + 7 v0^2 / (g (R + r))) / 17"
        formula = formula if rolls else "cos = (2 + v0^2 / (g (R + r))) / 3"
        yield compare("cosine at lift-off", tried, formula, expected, seen, 1e-4)


GENERATOR = 0.050


@case("tautochrone")
def tautochrone() -> Verdicts:
    """The center of a frictionless ball on a cycloid swings in the same time from any height.

    The surface is the cycloid's parallel curve at r, drawn out to a trough.
    """
    periods = []
    shell = surfaces.cycloid_trough(GENERATOR, reach=2.9, width=0.02)
    scene = balls.scene_of(shell, balls.spring(), model=ball_model())
    expected = 4 * math.pi * math.sqrt(GENERATOR / balls.GRAVITY)
    for degrees in (20, 90, 150):
        start = np.array([math.radians(degrees)])
        points, normals = surfaces.cycloid(GENERATOR, start)
        depth = balls.MASS * balls.GRAVITY * normals[0, 2] / balls.STIFF
        result = sp.Simulation(scene, balls.PRECISE).run(
            points[0] - depth * normals[0], None, 2.35 * expected, record_dt=1e-3
        )
        periods.append(mean_period(result.t, result.q[:, 0], result.v[:, 0], 2))
        tried = f"a = 50 mm, from phi = {degrees} deg"
        law = "4 pi sqrt(a / g)"
        yield compare("period", tried, law, expected, periods[-1], 1e-5)
    tried = "from phi = 20, 90 and 150 deg"
    spread = max(periods) / min(periods) - 1
    yield at_most("largest / smallest period - 1", tried, "0", spread, 1e-5)


@case("circles in a cone", slow=True)
def cone() -> Verdicts:
    """Without friction a small push makes the circle breathe at sqrt(3) sin(half angle)."""
    for degrees in (30, 50):
        half = math.radians(degrees)
        sine, cosine = math.sin(half), math.cos(half)
        out = 0.035
        # Along the normal, up and inward: N sin = m g.
        depth = balls.MASS * balls.GRAVITY / (sine * balls.STIFF)
        reach = balls.RADIUS - depth
        height = (out + reach * cosine) / math.tan(half) + reach * sine
        orbit = math.sqrt(balls.GRAVITY / (math.tan(half) * out))
        push = 2e-3 * orbit * out
        center = np.array([out, 0.0, height])
        velocity = np.array([push * sine, orbit * out, push * cosine])
        touch = (out + balls.RADIUS * cosine) / math.tan(half)
        shell = surfaces.cone(half, touch - 0.012, touch + 0.012)
        scene = balls.scene_of(shell, balls.spring(), model=ball_model())
        expected = math.sqrt(3) * sine
        duration = 4.7 * 2 * math.pi / (orbit * expected)
        result = sp.Simulation(scene, balls.PRECISE).run(center, velocity, duration, record_dt=1e-3)
        # Over whole waves, in which the speed of the orbit goes up and down.
        wave = result.q[:, 2] - 0.5 * (result.q[:, 2].max() + result.q[:, 2].min())
        crossings = downward_crossings(result.t, wave, result.v[:, 2])
        angle = np.unwrap(np.arctan2(result.q[:, 1], result.q[:, 0]))
        along = np.diff(np.interp(crossings[[0, 4]], result.t, angle))[0]
        turned = along / (crossings[4] - crossings[0])
        tried = f"half angle {degrees} deg, orbit of 35 mm"
        law = "sqrt(g / (tan(half angle) radius))"
        yield compare("orbit [rad/s]", tried, law, orbit, turned, 1e-4)
        law, seen = "sqrt(3) sin(half angle)", 8 * math.pi / along
        yield compare("radial / orbit frequency", tried, law, expected, seen, 1e-4)
