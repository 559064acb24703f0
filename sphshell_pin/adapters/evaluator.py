"""A scene as a function of q, v and tau alone, for those who differentiate it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin.checks import check_type
from sphshell_pin.dynamics import Scene
from sphshell_pin.errors import InvalidParameter

Array = NDArray[np.float64]


def check_without_history(scene: Scene, without_history: bool) -> None:
    """Raise InvalidParameter for a scene whose friction remembers more than q and v."""
    check_type("scene", scene, Scene, "must be a sphshell_pin.Scene")
    if without_history or not scene.core.bristle_size:
        return
    names = [p.name for p in scene.pairs if p.friction is not None and p.friction.has_state]
    where = f"the friction of {', '.join(names)}" if names else "the dry friction in its joints"
    raise InvalidParameter(
        "scene",
        scene,
        f"has bristles in {where}, whose stretch a state of q and v does not hold: take a "
        "CoulombFriction, or say without_history=True; bristles are then unstretched in every "
        "state, and friction creeps as if it had no spring",
        "",
    )


class Evaluator:
    """Evaluates a scene into arrays that its user owns.

    Forces are one row per pair: the sum of `normal_force` over the pair's contacts [N], and the
    three components of the sum of `force_world` [N].
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._data = scene.model.createData()
        self._none = np.zeros(scene.core.bristle_size)

    def calc(self, q: Array, v: Array, tau: Array, acceleration: Array, forces: Array) -> None:
        """Fill acceleration (nv,) and forces (pairs, 4)."""
        acceleration[:] = self._scene.core.rates(q, v, self._none, tau)[: len(v)]
        forces[:] = self._forces(q, v)

    def calc_diff(
        self, q: Array, v: Array, tau: Array, by_state: Array, by_tau: Array, forces_by_state: Array
    ) -> None:
        """Fill by_state (nv, 2 nv), by_tau (nv, nv) and forces_by_state (pairs, 4, 2 nv)."""
        nv = len(v)
        by_state[:] = self._scene.core.rate_jacobian(q, v, self._none, tau)[:nv, : 2 * nv]
        by_tau[:] = pin.computeMinverse(self._scene.model, self._data, q)
        forces_by_state[:] = 0.0
        if not len(self._scene.contacts(q, v)):
            return
        step = 1e-7
        for k, e in enumerate(step * np.eye(nv)):
            ends = (
                [self._forces(pin.integrate(self._scene.model, q, s * e), v) for s in (1, -1)],
                [self._forces(q, v + s * 1e2 * e) for s in (1, -1)],
            )
            forces_by_state[:, :, k] = (ends[0][0] - ends[0][1]) / (2 * step)
            forces_by_state[:, :, nv + k] = (ends[1][0] - ends[1][1]) / (2e2 * step)

    def _forces(self, q: Array, v: Array) -> Array:
        contacts = self._scene.contacts(q, v)
        out = np.zeros((len(self._scene.pairs), 4))
        np.add.at(out[:, 0], contacts.pair, contacts.normal_force)
        np.add.at(out[:, 1:], contacts.pair, contacts.force_world)
        return out
