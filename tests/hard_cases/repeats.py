"""The same bits again, and the energy audit of the shipped scenarios.

A run repeated, by one Simulation or by several that run in 1, 2 and 4 threads at once, gives the
same rows, contacts and energies bit for bit.
"""

from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from typing import Any

import numpy as np

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import MissingExtra
from sphshell_pin.scenario import build, shipped_scenarios
from tests import meshes, models
from tests.hard_cases.verdict import Verdicts, at_most, case

RADIUS = 0.01
AUDIT = 1e-4


def bowl_scene() -> sp.Scene:
    """Return a free ball over a bowl with moved vertices, with friction."""
    vertices, elements = meshes.bowl(12, 0.12, 0.1)
    scene = sp.Scene(models.ball(mass=0.03, radius=RADIUS))
    scene.add_contact(
        sp.Sphere(RADIUS, "ball"),
        sp.Shell(vertices, elements),
        law=sp.HuntCrossleyLaw(1e6, 1.5, 0.3),
        friction=sp.CoulombFriction(0.3, 0.2, 0.01, 0.1),
        name="ball-bowl",
    )
    return scene


def start(aside: float) -> tuple[Array, Array]:
    """Return a place over the bowl and a throw with spin."""
    return models.free_q(np.array([aside, 0.013, 0.025])), np.array(
        [0.3, -0.2, -0.5, 9.0, 5.0, 3.0]
    )


def digest(result: sp.Result) -> str:
    """Return a number of every bit of the rows, the contacts, the energies and the events."""
    digest = hashlib.sha256()
    for part in (result.contacts, result.energy):
        for field in fields(part):
            digest.update(np.ascontiguousarray(getattr(part, field.name)).tobytes())
    for column in (result.t, result.q, result.v):
        digest.update(column.tobytes())
    digest.update(repr(result.events).encode())
    return digest.hexdigest()


def once(integrator: Any) -> str:
    """Run in a scene of its own."""
    q, v = start(0.021)
    return digest(sp.Simulation(bowl_scene(), integrator).run(q, v, 0.2))


def again(integrator: Any) -> str:
    """Run after another run of the same Simulation, which must leave nothing behind."""
    simulation = sp.Simulation(bowl_scene(), integrator)
    simulation.run(*start(-0.017), 0.1)
    return digest(simulation.run(*start(0.021), 0.2))


@case("the same bits again")
def repeated() -> Verdicts:
    for integrator in (
        sp.SemiImplicitEuler(1e-5),
        sp.RungeKutta4(2e-5),
        sp.Adaptive(),
        sp.Implicit(),
        sp.LinearlyImplicitEuler(1e-4),
    ):
        first = once(integrator)
        others = int(again(integrator) != first)
        tried = f"{type(integrator).__name__}, once more after another run"
        yield at_most("repeat", tried, "same bits", others, 0)
        for threads in (1, 2, 4):
            with ThreadPoolExecutor(threads) as pool:
                results = list(pool.map(once, [integrator] * 4))
            others = sum(one != first for one in results)
            tried = f"{type(integrator).__name__}, 4 runs in {threads} threads"
            yield at_most("repeat", tried, "same bits", others, 0)


@case("energy audit of the shipped scenarios", slow=True)
def audits() -> Verdicts:
    for name in shipped_scenarios():
        try:
            built = build(name)
        except MissingExtra:
            continue
        run = built.scenario.run
        result = built.simulation.run(
            built.q0,
            built.v0,
            run.duration,
            built.controller,
            run.control_dt,
            record_dt=run.record_dt,
        )
        energy = result.energy
        share = float(np.abs(energy.residual).max() / energy.exchanged)
        tried = f"{name}, {built.simulation.integrator}"
        law = "energy from nowhere, of what is exchanged"
        yield at_most("audit", tried, law, share, AUDIT)
