"""The cost of derivatives of the dynamics against Pinocchio's: python -m benchmarks.derivatives.

The Panda's fingertip touches 200 k triangles, with damping and friction. Both sides are times of
compiled code: of Scene.dynamics_derivatives by repeating it inside the core, of
pin.computeABADerivatives by taking the Python call off, which is timed with a model of one joint.
"""

import time
import timeit
from collections.abc import Callable, Sequence

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.contents import times_table
from sphshell_pin.study.report.machine import machine
from sphshell_pin.study.report.steps import START, panda, with_sheet
from sphshell_pin.study.report.surfaces import wavy_sheet
from sphshell_pin.study.report.timing import one_core, take_turns
from sphshell_pin.testing.differences import names_of

CALLS, ROUNDS = 2000, 50


def timed(call: Callable[[], object], calls: int = CALLS) -> Callable[[], float]:
    """Return what measures the seconds of one call."""
    return lambda: timeit.timeit(call, number=calls) / calls


def pinocchios(model: pin.Model, q: Array, v: Array) -> Callable[[], float]:
    """Seconds of pin.computeABADerivatives, Python's call included."""
    data, tau = model.createData(), np.zeros(model.nv)
    return timed(lambda: pin.computeABADerivatives(model, data, q, v, tau))


def one_joint() -> pin.Model:
    """Return the model whose derivatives cost little but the call."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "one")
    return model


def compiled(scene: sp.Scene, q: Array, v: Array, names: Sequence[str] = ()) -> Callable[[], float]:
    """Seconds of Scene.dynamics_derivatives without its Python."""
    _, parameters = scene._bind_parameters(names)

    def run() -> float:
        begin = time.perf_counter()
        scene._binding.dynamics_derivatives(q, v, None, parameters, CALLS)
        return (time.perf_counter() - begin) / CALLS

    return run


def main() -> None:
    """Print the ratios."""
    one_core()
    print(machine())
    free, touching = panda(), with_sheet(panda(), sp.Shell(*wavy_sheet(316, 1.0)), 5e-4)
    model, q = free.model, START
    v = 0.1 * np.ones(model.nv)
    if len(touching.contacts(q, v)) != 1:
        raise SystemExit("the fingertip does not touch")
    names = names_of(touching)
    columns = len(touching.dynamics_derivatives(q, v, parameters=names).parameters)
    call, whole = "a call", "computeABADerivatives with its call"
    lone = one_joint()
    own = {
        "dynamics_derivatives, no contact": compiled(free, q, v),
        "dynamics_derivatives, touching": compiled(touching, q, v),
        f"the same by {columns} parameters": compiled(touching, q, v, names),
        "touching, with Python": timed(lambda: touching.dynamics_derivatives(q, v)),
        f"by {columns} parameters, with Python": timed(
            lambda: touching.dynamics_derivatives(q, v, parameters=names), CALLS // 100
        ),
    }
    contestants = {
        call: pinocchios(lone, np.zeros(1), np.zeros(1)),
        whole: pinocchios(model, q, v),
        **own,
    }
    times = take_turns(contestants, ROUNDS)
    shown = {"pin.computeABADerivatives": times[whole] - times[call]}
    shown |= {name: times[name] for name in own}
    caption = "Derivatives of the Panda's dynamics, fingertip on 199712 triangles, C++ unless said"
    first, heading = "derivatives", "over_aba: over Pinocchio's"
    print(f"{caption}\n")
    print(times_table("", caption, first, shown, next(iter(shown)), heading).markdown())


if __name__ == "__main__":
    main()
