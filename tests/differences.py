"""Derivatives by their definition: differences of an own loop, written without the analytic ones.

Central differences of order 4. A step h leaves the truncation h^4 f''''' / 30 and the rounding
eps |f| / h; steps of 1e-3, 1e-4 and 1e-5 of the length or value on which a function changes are
tried, and the best counts: a kink nearby or rounding spoils one of them, a wrong derivative none.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.named_numbers import AXES, TWIST
from sphshell_pin.testing.differences import _AHEAD as AHEAD
from sphshell_pin.testing.differences import _PLACES as PLACES
from sphshell_pin.testing.differences import changed, is_place, names_of, scale_of
from sphshell_pin.testing.differences import differentiated as derivative
from sphshell_pin.testing.forces import accelerations

__all__ = ["AHEAD", "PLACES", "changed", "columns_of", "is_place", "names_of", "scale_of"]

COORDINATES = {"offset": AXES, "placement": TWIST}

Function = Callable[[float], Array]
State = tuple[sp.Scene, Array, Array, Array]

SHARES = (1e-3, 1e-4, 1e-5)
ROUNDING = 8.0 * float(np.finfo(float).eps)


def columns_of(name: str) -> list[str]:
    """Return the coordinates of what is called `name`: three of an offset, six of a placement."""
    ends = COORDINATES.get(name.rpartition(".")[2])
    return [name] if ends is None else [f"{name}.{end}" for end in ends]


def off(got, f, scale, *, floor=0.0, tolerance=1e-6, known=None, shares=SHARES, ahead=False):
    """Return by how much `got` is not the derivative of f at 0, relative to its largest entry.

    f changes on the length `scale`; what is smaller than `floor`, or than what differences resolve
    with a tenth of `tolerance` where f is `known` to so much, counts as that large.
    """
    if known is None:
        known = ROUNDING * float(np.abs(f(0.0)).max(initial=0.0))
    best = np.inf
    for share in shares:
        step = share * scale
        expected = derivative(f, step, ahead=ahead)
        assert got.shape == expected.shape
        size = max(np.abs(expected).max(initial=0.0), floor, 10.0 / tolerance * known / step)
        error = np.abs(got - expected).max(initial=0.0)
        best = min(best, error / size if size > 0.0 else (0.0 if error == 0.0 else np.inf))
        if best <= 0.1 * tolerance:
            break
    return best


class Move(NamedTuple):
    """How one number is changed by x, and on what length or value a function changes with it."""

    moved: Callable[[float], State]
    scale: float
    ahead: bool = False
    """Whether the number is at its bound, 0."""


def moves(scene: sp.Scene, q: Array, v: Array, tau: Array | None = None) -> dict[str, Move]:
    """Return the moves of q, v, tau and all numbers of the contacts, by the names of columns."""
    model, found = scene.model, {}
    tau = np.zeros(model.nv) if tau is None else tau
    depth, fast = depth_of(scene, q, v), max(float(np.abs(v).max(initial=0.0)), 1e-2)
    for k, e in enumerate(np.eye(model.nv)):
        found |= {
            f"q.{k}": Move(lambda x, e=e: (scene, pin.integrate(model, q, x * e), v, tau), depth),
            f"v.{k}": Move(lambda x, e=e: (scene, q, v + x * e, tau), fast),
            f"tau.{k}": Move(lambda x, e=e: (scene, q, v, tau + x * e), 1e3),
        }
    for one in (one for name in names_of(scene) for one in columns_of(name)):
        scale = scale_of(scene, one, depth)
        found[one] = Move(lambda x, one=one: (changed(scene, one, x), q, v, tau), *scale)
    return found


def acceleration(scene, q, v, tau, state=None):
    """ABA with `Scene.external_forces`; of mimic joints, which ABA has not, M^-1 (tau - rnea)."""
    model = scene.model
    torques = tau + scene.joint_forces(q, v, state=state)
    forces = scene.external_forces(q, v, state=state)
    return accelerations(model, model.createData(), q, v, torques, forces)


def depth_of(scene: sp.Scene, q: Array, v: Array) -> float:
    """Return the least depth of all contacts, 1 cm where there is none [m]."""
    return float(scene.contacts(q, v).depth.min(initial=1e-2))
