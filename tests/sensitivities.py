"""Runs whose sensitivities are compared with differences of whole runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from tests import differences, models

R = 0.05
ADAPTIVE, IMPLICIT = sp.Adaptive(1e-11), sp.Implicit(1e-9)
INTEGRATORS = {
    "adaptive": ADAPTIVE,
    "implicit": IMPLICIT,
    "runge-kutta": sp.RungeKutta4(2e-5),
    "semi-implicit": sp.SemiImplicitEuler(2e-5),
    "linearly implicit": sp.LinearlyImplicitEuler(2e-5),
}
every_integrator = pytest.mark.parametrize("integrator", INTEGRATORS)
IMPACT = sp.ImpactLaw(2e6, 1.5, 50.0, 1e-3)
HUNT = sp.HuntCrossleyLaw(2e6, 1.5, 0.3)
COULOMB = sp.CoulombFriction(0.3, 0.2, 0.02, 0.2)
BRISTLE = sp.BristleFriction(0.4, 0.3, 2e4, 20.0, 0.05)


PAIR = "ball-plate"


@dataclass
class Case:
    """A scene, where it starts, and how it is run; its sensitivities and those by differences."""

    scene: sp.Scene
    q0: Any
    v0: Any
    duration: float
    integrator: Any = ADAPTIVE
    record_dt: float | None = None
    controller: Any = None
    control_dt: float | None = None

    def __post_init__(self):
        self.q0, self.v0 = (np.array(one, dtype=float) for one in (self.q0, self.v0))
        self.options = {"controller": self.controller, "control_dt": self.control_dt}
        self.options["record_dt"] = self.record_dt or self.duration / 8

    def run(self, scene=None, q0=None, v0=None, names=None):
        asked = self.options if names is None else {**self.options, "sensitivities": names}
        start = self.q0 if q0 is None else q0, self.v0 if v0 is None else v0
        simulation = sp.Simulation(scene or self.scene, self.integrator)
        return simulation.run(*start, self.duration, **asked)

    def columns(self, names: Sequence[str]) -> list[str]:
        """The names of the columns."""
        nv, out = self.scene.model.nv, []
        for name in names:
            own = name in ("q0", "v0")
            out += [f"{name}.{k}" for k in range(nv)] if own else differences.columns_of(name)
        return out

    def moved(self, column: str, x: float) -> sp.Result:
        """The run with one number changed by x."""
        part, _, k = column.partition(".")
        if part == "q0":
            step = x * np.eye(self.scene.model.nv)[int(k)]
            return self.run(q0=pin.integrate(self.scene.model, self.q0, step))
        if part == "v0":
            return self.run(v0=self.v0 + x * np.eye(self.scene.model.nv)[int(k)])
        return self.run(differences.changed(self.scene, column, x))

    def scale(self, column: str, depth: float) -> tuple[float, bool]:
        """What a number is changed by is a small part of this; and whether it is at its bound."""
        part = column.partition(".")[0]
        if part == "v0":
            return max(float(np.abs(self.v0).max()), 0.1), False
        return (depth, False) if part == "q0" else differences.scale_of(self.scene, column, depth)

    def check(self, names, *, tolerance=1e-5, depth=1e-3, error=10.0, bounces=None):
        """Compare motion, forces and depths of all rows, each relative to its largest entry.

        Runs of an integrator that controls its error are known to `error` times its tolerance.
        """
        result, model = self.run(names=names), self.scene.model
        plain, got = self.run(), result.sensitivities
        assert plain.sensitivities is None
        columns = self.columns(names)
        count, rows, logged = len(columns), len(result.t), len(result.contacts.t)
        assert list(got.parameters) == columns
        assert got.q.shape == got.v.shape == (rows, model.nv, count)
        assert got.force_world.shape == (logged, 3, count)
        assert got.depth.shape == (logged, count)
        # The run itself is the same.
        np.testing.assert_array_equal(plain.t, result.t)
        for one, other in ((plain.q, result.q), (plain.v, result.v)):
            np.testing.assert_allclose(other, one, rtol=0, atol=1e-9 * np.abs(one).max())
        if bounces is not None:
            kinds = [event.kind for event in result.events]
            assert kinds.count("lift_off") == bounces, kinds

        arrays = (got.q, got.v, got.force_world, got.depth)

        @cache
        def parts(column: str, x: float) -> tuple[Array, ...]:
            run = self.moved(column, x)
            moves = [pin.difference(model, *two) for two in zip(plain.q, run.q, strict=True)]
            log = run.contacts
            if log.row.tolist() != plain.contacts.row.tolist():
                return tuple(np.full(one.shape[:-1], np.nan) for one in arrays)  # another touches
            forces, depths = log.force_world, log.depth
            changes = forces - plain.contacts.force_world, depths - plain.contacts.depth
            return np.array(moves), run.v - plain.v, *changes

        errors = {}
        # What hardly matters is measured by what is alike: spins by velocities.
        kinds = [name.rstrip("0123456789xyz") for name in columns]
        sizes = [plain.q, plain.v, plain.contacts.force_world, plain.contacts.depth]
        # How well a run is known: no difference of runs shows more.
        known = max(1e-13, error * float(getattr(self.integrator, "rtol", 0.0)))
        resolved = [known * max(float(np.abs(one).max(initial=0.0)), 1e-3) for one in sizes]
        # A touch within a step of fixed length leaves kinks, one a step.
        shares = (1e-5, 1e-4, 1e-6) if hasattr(self.integrator, "dt") else (1e-3, 1e-2, 1e-4, 1e-5)
        for k, column in enumerate(columns):
            alike = [j for j, kind in enumerate(kinds) if kind == kinds[k]]
            scale, ahead = self.scale(column, depth)
            unseen = tolerance * max(shares) * scale
            for part, name in enumerate(("q", "v", "force", "depth")):
                largest = float(np.abs(arrays[part][..., alike]).max(initial=0.0))
                errors[f"{name} by {column}"] = differences.off(
                    arrays[part][..., k],
                    lambda x, column=column, part=part: parts(column, x)[part],
                    scale,
                    floor=max(1e-2 * largest, resolved[part] / unseen),
                    known=0.0,
                    tolerance=tolerance,
                    shares=shares,
                    ahead=ahead,
                )
        over = {name: f"{least:.1e}" for name, least in errors.items() if not least <= tolerance}
        assert not over, over
        return result


def drop(law, integrator=ADAPTIVE, *, gap=0.01, speed=0.5, duration=0.1, gravity=9.81, **more):
    """A mass that falls on a plate, `gap` below it."""
    scene = models.on_plate(models.slider(gravity), law)
    return Case(scene, [R + gap], [-speed], duration, integrator, **more)  # type: ignore[arg-type]


def thrown(
    law, friction, integrator=ADAPTIVE, *, shell=None, method="smooth", duration=0.06, gap=0.01
) -> Case:
    """A free, spinning ball that meets a plate at an angle."""
    shell = models.plate(4.0) if shell is None else shell
    scene = models.on_shell(models.ball(), shell, law, friction, method=method)
    q0 = models.free_q([0.02, -0.03, R + gap])
    return Case(scene, q0, [0.3, 0.15, -0.5, 2.0, -3.0, 1.0], duration, integrator)
