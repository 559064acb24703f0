"""Rolling and sliding on flat walls. A solid ball, r = 10 mm, m = 50 g, I = 2/5 m r^2.

One point counts for both bodies, the contact point on the shell: the lever of friction about the
center is `r - depth`, and `b = I / (m (r - depth)^2)` stands where a hard ball has 2/5. The depths
are large enough for the difference to show where the law says b.
"""

import math

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.swing import ball_model
from tests import models
from tests.hard_cases import balls, surfaces
from tests.hard_cases.verdict import Verdicts, at_most, case, compare

SOFT = balls.spring(1e5)


def coulomb(mu: float) -> sp.CoulombFriction:
    return sp.CoulombFriction(mu, mu, 1e-3, 2e-3)


def acceleration(shell: sp.Shell, friction: sp.Friction, slope: pin.SE3, start: Array) -> float:
    """Return that along `start`, in which the ball touches [m]: the first axis that is off it."""
    scene = balls.scene_of(shell, SOFT, friction, placement=slope)
    q0, v0 = balls.state(slope.act(start))
    result = sp.Simulation(scene, balls.PRECISE).run(q0, v0, 0.2, record_dt=0.1)
    along = balls.velocities(result) @ slope.rotation[:, np.flatnonzero(start)[0]]
    return float((along[2] - along[1]) / (result.t[2] - result.t[1]))


@case("incline")
def incline() -> Verdicts:
    for degrees, mu, make in (
        (5, 0.3, balls.bristle),
        (30, 0.5, balls.bristle),
        (30, 0.5, coulomb),
        (30, 0.1, balls.bristle),
        (30, 0.1, coulomb),
        (60, 0.2, balls.bristle),
    ):
        angle = math.radians(degrees)
        depth = SOFT.depth_at(balls.MASS * balls.GRAVITY * math.cos(angle))
        b, pull = balls.beta(depth), balls.GRAVITY * math.sin(angle)
        rolling = "rolling acceleration", "g sin A / (1 + b), 5/7 g sin A", pull / (1 + b)
        slides = pull - mu * balls.GRAVITY * math.cos(angle)
        sliding = "sliding acceleration", "g (sin A - mu cos A)", slides
        name, law, expected = rolling if mu >= b / (1 + b) * math.tan(angle) else sliding
        friction, start = make(mu), np.array([-0.5, 0.0, balls.RADIUS - depth])
        seen = acceleration(models.square(), friction, balls.tilted(angle), start)
        tried = f"A = {degrees} deg, mu = {mu:g}, {type(friction).__name__}"
        yield compare(name, tried, law, expected, seen, 1e-6)


@case("from sliding to rolling")
def sliding_to_rolling() -> Verdicts:
    speed, mu = 0.5, 0.2
    depth = SOFT.depth_at(balls.MASS * balls.GRAVITY)
    b = balls.beta(depth)
    for make in (balls.bristle, coulomb):
        scene = balls.scene_of(models.square(), SOFT, make(mu))
        q0, v0 = balls.state([-0.5, 0.0, balls.RADIUS - depth], [speed, 0.0, 0.0])
        slide = speed / (mu * balls.GRAVITY * (1 + 1 / b))
        result = sp.Simulation(scene, balls.PRECISE).run(q0, v0, 2.5 * slide, record_dt=slide / 4)
        along = balls.velocities(result)[:, 0]
        # The line of the slide, through a quarter and a half of it, meets the speed of rolling.
        pace = (along[1] - along[2]) / (result.t[2] - result.t[1])
        seen = result.t[1] + (along[1] - along[-1]) / pace
        tried = f"v0 = {speed:g} m/s, mu = {mu:g}, {make.__name__}"
        law = "v0 b / ((1 + b) mu g), 2 v0 / (7 mu g)"
        yield compare("end of the slide", tried, law, slide, seen, 1e-4)
        law, rolls = "v0 / (1 + b), 5/7 v0", speed / (1 + b)
        yield compare("speed of rolling", tried, law, rolls, along[-1], 1e-6)


@case("V-groove")
def v_groove() -> Verdicts:
    """Both contact points are at rest: the ball turns about the line through them.

    Its distance from the center is h = (r - depth) sin(half angle), and each wall carries
    m g cos A / (2 sin(half angle)).
    """
    for half, degrees in ((45, 20), (30, 20), (60, 10)):
        angle, opening = math.radians(degrees), math.radians(half)
        load = balls.MASS * balls.GRAVITY * math.cos(angle) / (2 * math.sin(opening))
        reach = balls.RADIUS - SOFT.depth_at(load)
        h = reach * math.sin(opening)
        expected = balls.GRAVITY * math.sin(angle) / (1 + balls.INERTIA / (balls.MASS * h**2))
        # The groove runs along y: turn it into x, then let it fall.
        slope = balls.tilted(angle) * pin.SE3(pin.utils.rotate("z", -math.pi / 2), np.zeros(3))
        start = np.array([0.0, -0.5, reach / math.sin(opening)])
        seen = acceleration(surfaces.groove(opening), balls.bristle(1.0), slope, start)
        tried = f"walls at {half} deg from the middle, A = {degrees} deg"
        law = "g sin A / (1 + 2 r^2 / (5 h^2)), h = (r - depth) sin(half angle)"
        yield compare("rolling acceleration", tried, law, expected, seen, 1e-6)


MU_SLOPE, OF_CONE = 0.5, 0.9


def creep(integrator: object, friction: object, duration: float) -> float:
    """Return the mean speed [m/s] in the second half, down a slope at 0.9 of the cone of friction.

    The sphere cannot turn: it would roll.
    """
    slope = balls.tilted(math.atan(OF_CONE * MU_SLOPE))
    model = ball_model()
    scene = balls.scene_of(models.square(), SOFT, friction, model=model, placement=slope)
    depth = SOFT.depth_at(balls.MASS * balls.GRAVITY * slope.rotation[2, 2])
    q0 = slope.act(np.array([0.0, 0.0, balls.RADIUS - depth]))
    result = sp.Simulation(scene, integrator).run(q0, None, duration, record_dt=duration / 2)
    return float(np.linalg.norm(result.q[2] - result.q[1]) / (duration / 2))


@case("stands on a slope")
def stands() -> Verdicts:
    friction = balls.bristle(MU_SLOPE, stiffness=1e5, mass=balls.MASS)
    for stepper in (sp.Adaptive(1e-6), sp.Implicit(1e-6), sp.LinearlyImplicitEuler(1e-3)):
        tried = f"slope of 0.9 mu_s, 60 s, BristleFriction, {stepper}"
        speed = creep(stepper, friction, 60.0)
        yield at_most("creep [m/s], last 30 s", tried, "0", speed, 1e-9)


@case("creeps on a slope")
def creeps() -> Verdicts:
    for v_static in (1e-2, 1e-3):
        friction = sp.CoulombFriction(MU_SLOPE, MU_SLOPE, v_static, 2 * v_static)
        # (3 x - x^3) / 2 = c has the root x = 2 sin(asin(c) / 3).
        expected = v_static * 2 * math.sin(math.asin(OF_CONE) / 3)
        tried = f"slope of 0.9 mu_s, CoulombFriction, v_static = {v_static:g} m/s"
        law = "mu_s (3 x - x^3) / 2 = tan A, x = s / v_static"
        seen = creep(balls.PRECISE, friction, 1.0)
        yield compare("creep [m/s]", tried, law, expected, seen, 1e-6)
