"""Energy and momentum. Nothing may be gained: not in long swings, and not by fast spin.

A free body without forces keeps its kinetic energy and its angular momentum `L`. If it is round
about one axis, its motion is known: the axis goes round `L` at `|L| / I_1`, and the body turns
about the axis at `(1 - I_3 / I_1) w_3` against that (Landau and Lifshitz, *Mechanics*, 35).
"""

import math

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import MissingExtra
from sphshell_pin.scenario import build, shipped_scenarios
from sphshell_pin.scenario.running.run import simulate
from sphshell_pin.study.report import swing
from tests import models
from tests.hard_cases import analytic_impact, balls
from tests.hard_cases.verdict import Verdicts, at_most, case, compare
from tests.oracle.mechanics import total_momentum

SPIN = 300.0  # [rad/s]
SWINGS = 100


def drift(scene: sp.Scene, swings: int = SWINGS) -> tuple[float, float]:
    """Return the drift over so many swings and the largest change, both over a swing's energy.

    The drift is the change of the mean from the first to the last swing.
    """
    period = swing.PERIOD
    simulation = sp.Simulation(scene, sp.Adaptive(1e-10))
    start = swing.start(float(swing.AZIMUTHS[0]))
    result = simulation.run(start, None, swings * period, record_dt=period / 200)
    changes = result.energy.residual / swing.ENERGY
    return float(changes[-200:].mean() - changes[:200].mean()), float(np.abs(changes).max())


def of_energy(tried: str, figures: tuple[float, float], largest: float) -> Verdicts:
    yield at_most("drift of energy / that of a swing", tried, "0", figures[0], 1e-8)
    yield at_most("largest change of energy", tried, "0", figures[1], largest)


@case("100 swings in a bowl", slow=True)
def swings() -> Verdicts:
    """From element to element the normal turns by 1e-7 rad at h / r = 0.15, an eighth at 0.075.

    The error control cannot see it, and what it costs at each border may add up.
    """
    tried = "100 swings from 40 deg, R = 4 r, h / r = {}, Adaptive(1e-10)"
    mesh = swing.turned_icosphere(6, swing.BOWL)
    coarse = drift(swing.mesh_scene(swing.bowl(0.15)))
    yield from of_energy(tried.format(0.075), drift(swing.mesh_scene(mesh)), 1e-7)
    yield at_most("largest change of energy", tried.format(0.15), "0", coarse[1], 1e-6)


@case("swings in the exact bowl", slow=True)
def exact_swings() -> Verdicts:
    """What the surface has no part in: a contact source is called at every evaluation."""
    tried = "20 swings, the surface by its formula (contact source)"
    yield from of_energy(tried, drift(balls.exact_scene(), 20), 1e-8)


def free_body(moments: tuple[float, float, float]) -> pin.Model:
    model = models.empty(gravity=0.0)
    inertia = pin.Inertia(1.0, np.zeros(3), np.diag(moments))
    models.add_body(model, "body", pin.JointModelFreeFlyer(), inertia=inertia)
    return model


def top_error(integrator: object) -> float:
    """Return how far a free symmetric top is from its closed form after 0.1 s [rad]."""
    first, third, end = 3e-5, 5e-5, 0.1
    spin = SPIN * np.array([0.6, 0.0, 0.8])
    q0, v0 = balls.state(np.zeros(3), [1.0, 2.0, 3.0], spin)
    scene = sp.Scene(free_body((first, first, third)))
    q = sp.Simulation(scene, integrator).run(q0, v0, end).q[-1]
    momentum = np.array([first, first, third]) * spin
    about_axis = np.array([0.0, 0.0, (1 - third / first) * spin[2]])
    exact = pin.exp3(momentum / first * end) @ pin.exp3(about_axis * end)
    return float(np.linalg.norm(pin.log3(exact.T @ pin.Quaternion(q[3:7]).matrix())))


@case("order of the steppers with a free top")
def top() -> Verdicts:
    tried, name = "symmetric top, 300 rad/s, 0.1 s, against its closed form", "order of {}"
    for integrator, order in analytic_impact.FIXED:
        steps = (2e-4, 1e-4) if order == 4 else (1e-6, 5e-7)
        seen = analytic_impact.order_by_step(top_error, integrator, steps)
        title = name.format(integrator.__name__)
        yield compare(title, tried, "error ~ dt^p", order, seen, 0.1, scale=1.0)
    for integrator, span in analytic_impact.BY_TOLERANCE:
        unit = tried, "0", " [rad]"
        yield from analytic_impact.by_tolerance(top_error, integrator, span, *unit)


# What energy and momentum of a tumbling body may change by.
DEFAULTS = ((sp.RungeKutta4(), 1e-8), (sp.Adaptive(1e-9), 1e-8), (sp.Implicit(1e-7), 1e-7))
FIRST_ORDER = (sp.SemiImplicitEuler, sp.LinearlyImplicitEuler)


def tumbling(integrator: object, duration: float = 0.5) -> tuple[Array, float]:
    """Return the energy at the rows and the change of momentum of a free body, both relative."""
    model = free_body((3e-5, 2e-5, 4e-5))
    q0, v0 = balls.state(np.zeros(3), [1.0, 0.0, 0.0], SPIN * np.array([2.0, -1.5, 1.66]) / 3.0)
    result = sp.Simulation(sp.Scene(model), integrator).run(q0, v0, duration)
    energy = result.energy.kinetic
    before, after = (total_momentum(model, result.q[row], result.v[row]).angular for row in (0, -1))
    lost = np.linalg.norm(after - before) / np.linalg.norm(before)
    return energy / energy[0] - 1, float(lost)


@case("tumbling at 300 rad/s")
def free_tumbling() -> Verdicts:
    """The explicit Euler gains, the implicit one loses, both in proportion to spin^2 dt."""
    body = "free body of three moments"
    for integrator, bound in DEFAULTS:
        energy, momentum = tumbling(integrator)
        tried = f"{body}, 0.5 s, {integrator}"
        yield at_most("change of energy", tried, "0", np.abs(energy).max(), bound)
        yield at_most("change of angular momentum", tried, "0", momentum, bound)
    for kind in FIRST_ORDER:
        seen = analytic_impact.order_by_step(
            lambda stepper: np.abs(tumbling(stepper, 0.05)[0]).max(), kind, (1e-6, 5e-7)
        )
        title, tried = f"order of the energy, {kind.__name__}", f"{body}, 0.05 s"
        yield compare(title, tried, "change ~ spin^2 dt", 1.0, seen, 0.1, scale=1.0)
    implicit = sp.LinearlyImplicitEuler()
    gain = float(tumbling(implicit)[0].max())
    yield at_most("gain of energy", f"{body}, 0.5 s, {implicit}", "none", gain, 1e-12)


@case("a fast spin under a rolling ball")
def spinning_ball() -> Verdicts:
    """A ball that rolls on while it spins about the vertical: neither changes."""
    law = balls.spring(1e5)
    depth = law.depth_at(balls.MASS * balls.GRAVITY)
    speed = 0.1
    for integrator, bound in (
        (sp.SemiImplicitEuler(), 1e-8),
        (sp.RungeKutta4(), 1e-8),
        (sp.LinearlyImplicitEuler(), 1e-8),
        (sp.Adaptive(1e-9), 1e-8),
        (sp.Implicit(1e-7), 1e-7),
    ):
        scene = balls.scene_of(models.square(), law, balls.bristle(0.3, 1e5))
        spin = [0.0, speed / (balls.RADIUS - depth), SPIN]
        q0, v0 = balls.state([-0.5, 0.0, balls.RADIUS - depth], [speed, 0.0, 0.0], spin)
        result = sp.Simulation(scene, integrator).run(q0, v0, 2.0, record_dt=0.1)
        seen = balls.velocities(result)
        tried = f"0.1 m/s, {SPIN:g} rad/s about the vertical, 2 s, {integrator}"
        turn = np.abs(result.v[:, 5] / SPIN - 1).max()
        yield at_most("change of speed", tried, "0", np.abs(seen[:, 0] / speed - 1).max(), bound)
        yield at_most("change of spin", tried, "0", turn, bound)


@case("a fast ball put on a turntable")
def on_turntable() -> Verdicts:
    """Friction between the two only takes: their energy never rises."""
    law = balls.spring(1e5)
    for integrator in (sp.RungeKutta4(2e-5), balls.PRECISE, sp.Implicit(1e-7)):
        model = balls.free_ball()
        disc = pin.Inertia(1.0, np.zeros(3), 1e-2 * np.eye(3))
        models.add_body(model, "table", pin.JointModelRUBZ(), inertia=disc)
        friction = balls.bristle(0.3, 1e5)
        scene = balls.scene_of(models.square(), law, friction, model=model, frame="table")
        spin = SPIN * np.array([0.5, 0.5, math.sqrt(0.5)])
        height = balls.RADIUS - law.depth_at(balls.MASS * balls.GRAVITY)
        q0, v0 = balls.state([0.1, 0.0, height], np.zeros(3), spin)
        simulation = sp.Simulation(scene, integrator)
        result = simulation.run(np.append(q0, [1.0, 0.0]), np.append(v0, 6.0), 1.0)
        energy = result.energy.kinetic + result.energy.potential + result.energy.elastic
        energy = energy - result.energy.potential[0]
        gain = float((energy - np.minimum.accumulate(energy)).max() / energy[0])
        residual = float(np.abs(result.energy.residual).max() / energy[0])
        tried = f"tilted spin of {SPIN:g} rad/s, table at 6 rad/s, 1 s, {integrator}"
        yield at_most("largest rise of energy", tried, "0", gain, 1e-8)
        yield at_most("residual of the energy", tried, "0", residual, 1e-8)


AUDIT = 1e-4  # energy from nowhere in a shipped scenario, over what is exchanged


@case("energy audit of the shipped scenarios", slow=True)
def audits() -> Verdicts:
    for name in shipped_scenarios():
        try:
            built = build(name)
        except MissingExtra:
            continue
        energy = simulate(built)[0].energy
        share = float(np.abs(energy.residual).max() / energy.exchanged)
        tried = f"{name}, {built.simulation.integrator}"
        law = "energy from nowhere, of what is exchanged"
        yield at_most("audit", tried, law, share, AUDIT)
