"""A scene as a function of q, v and tau alone, for those who differentiate it."""

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_type
from sphshell_pin.dynamics import Scene, Simulation
from sphshell_pin.dynamics.run.advance import step_of
from sphshell_pin.errors import InvalidParameter

FORCES = 4
"""Numbers of a pair: its normal force [N], and its force on the sphere in the world [N]."""


def check_without_history(scene: Scene, without_history: bool) -> None:
    """Raise InvalidParameter for a scene whose friction remembers more than q and v."""
    check_type("scene", scene, Scene, "must be a sphshell_pin.Scene")
    if without_history or not scene._binding.bristle_size:
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


def check_fixed_step(simulation: Simulation) -> float:
    """Return the dt of a simulation [s]; raise InvalidParameter for one with error control."""
    if dt := step_of(simulation.integrator):
        return dt
    raise InvalidParameter(
        "integrator",
        simulation.integrator,
        "must have a fixed step: SemiImplicitEuler(dt), RungeKutta4(dt) or "
        "LinearlyImplicitEuler(dt)",
    )


class Evaluator:
    """Evaluates a scene into arrays of its user, without checking them.

    The forces of a pair are sums over its contacts. Bristles are unstretched.
    """

    def __init__(self, scene: Scene) -> None:
        self._core = scene._binding

    def calc(self, q: Array, v: Array, tau: Array, acceleration: Array, forces: Array) -> None:
        """Fill acceleration (nv,) and forces (FORCES pairs, 1)."""
        _core.evaluate_into(self._core, q, v, tau, acceleration, forces)

    def calc_diff(
        self, q: Array, v: Array, tau: Array, by_state: Array, by_tau: Array, forces_by_state: Array
    ) -> None:
        """Fill by_state (nv, 2 nv), by_tau (nv, nv), forces_by_state (FORCES pairs, 2 nv)."""
        _core.differentiate_into(self._core, q, v, tau, by_state, by_tau, forces_by_state)


class StepEvaluator:
    """The same of a fixed step of a simulation; forces are those where it begins."""

    def __init__(self, simulation: Simulation) -> None:
        self._core = simulation.scene._binding
        self._step = simulation.integrator.kind, step_of(simulation.integrator)

    def calc(self, q: Array, v: Array, tau: Array, following: Array, forces: Array) -> None:
        """Fill following (nq + nv,) and forces (FORCES pairs, 1)."""
        _core.step_into(self._core, *self._step, q, v, tau, following, forces)

    def calc_diff(
        self, q: Array, v: Array, tau: Array, by_state: Array, by_tau: Array, forces_by_state: Array
    ) -> None:
        """Fill by_state (2 nv, 2 nv), by_tau (2 nv, nv), forces_by_state (FORCES pairs, 2 nv)."""
        derivatives = by_state, by_tau, forces_by_state
        _core.differentiate_step_into(self._core, *self._step, q, v, tau, *derivatives)
