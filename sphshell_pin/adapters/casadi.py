"""Scenes as functions of CasADi, with their analytic Jacobians.

    f = ForwardDynamics(scene)
    q, v, tau = (casadi.MX.sym(name, scene.model.nv) for name in ("q", "v", "tau"))
    acceleration = f(q, v, tau)

Keep the object (here `f`) as long as an expression or a solver uses it.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.adapters import imports_of
from sphshell_pin.adapters.evaluator import check_fixed_step, check_without_history
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_names, check_type
from sphshell_pin.base.named_numbers import find_name, names_of_pairs
from sphshell_pin.dynamics import Scene, Simulation
from sphshell_pin.dynamics.scene.variations import Variations

with imports_of("casadi"):
    import casadi

__all__ = ["ForwardDynamics", "Step"]


class _Found(NamedTuple):
    """Outputs, and the derivatives of each by each input."""

    values: list[Array]
    blocks: list[list[Array]]


class _Callback(casadi.Callback):
    """A function with names for its inputs and outputs, as CasADi asks for them."""

    _inputs: Sequence[str]
    _outputs: Sequence[str]

    def get_n_in(self) -> int:
        """Return the number of inputs."""
        return len(self._inputs)

    def get_n_out(self) -> int:
        """Return the number of outputs."""
        return len(self._outputs)

    def get_name_in(self, i: int) -> str:
        """Return the name of an input."""
        return self._inputs[i]

    def get_name_out(self, i: int) -> str:
        """Return the name of an output."""
        return self._outputs[i]


class _SceneFunction(_Callback):
    """A function of q, v, tau (nv,) and, where some are named, of parameters p.

    CasADi knows no manifolds. Its q is the displacement from `q0` (nq,) in the tangent space:
    Pinocchio's is pinocchio.integrate(model, q0, q).
    """

    def __init__(
        self,
        scene: Scene,
        q0: ArrayLike | None = None,
        *,
        parameters: Iterable[str] = (),
        without_history: bool = False,
    ) -> None:
        check_without_history(scene, without_history)
        super().__init__()
        self.scene = scene
        single = {n: one for n, one in names_of_pairs(scene.pairs).items() if one.shape == ()}
        names = check_names("parameters", parameters)
        self.parameters = tuple(find_name(n, single, "parameter of one number") for n in names)
        self._model = scene.model
        self._q0, _ = scene.check_state(scene.neutral if q0 is None else q0)
        self._inputs = ("q", "v", "tau", "p") if self.parameters else ("q", "v", "tau")
        self._varied = b"", scene
        self._last: tuple[bytes, _Found] | None = None
        self._jacobians: list[_Jacobian] = []
        self.construct(type(self).__name__, {})

    def find(self, arguments: Sequence[Array]) -> _Found:
        """Return outputs and derivatives; CasADi often asks for both at the same place."""
        key = b"".join(one.tobytes() for one in arguments)
        if self._last is None or self._last[0] != key:
            x, v, tau = arguments[:3]
            q = pin.integrate(self._model, self._q0, x)
            found = self._find(self._with(arguments[3:]), q, v, tau)
            by_x = pin.dIntegrate(self._model, self._q0, x, pin.ArgumentPosition.ARG1)
            for row in found.blocks:
                row[0] = row[0] @ by_x
            self._last = key, found
        return self._last[1]

    def length_of(self, i: int) -> int:
        """Return the size of an input."""
        return len(self.parameters) if i == 3 else int(self._model.nv)

    def _with(self, values: Sequence[Array]) -> Scene:
        """Return the scene with the values of its parameters."""
        if not values:
            return self.scene
        key = values[0].tobytes()
        if self._varied[0] != key:
            vary = {name: [value] for name, value in zip(self.parameters, values[0], strict=True)}
            self._varied = key, Variations(self.scene, vary, 1).scene(0)
        return self._varied[1]

    def _find(self, scene: Scene, q: Array, v: Array, tau: Array) -> _Found:
        """Compute, with derivatives in the tangent space of q."""
        raise NotImplementedError

    # What follows is called by CasADi.

    def get_sparsity_in(self, i: int) -> casadi.Sparsity:
        """Return the size of an input."""
        return casadi.Sparsity.dense(self.length_of(i), 1)

    def get_sparsity_out(self, i: int) -> casadi.Sparsity:
        """Return the size of an output."""
        return casadi.Sparsity.dense(self._model.nv, 1)

    def eval(self, arguments: Sequence[casadi.DM]) -> list[Array]:
        """Return the outputs."""
        return self.find(_arrays(arguments)).values

    def has_jacobian(self) -> bool:
        """Say that there are derivatives."""
        return True

    def get_jacobian(
        self, name: str, inames: Sequence[str], onames: Sequence[str], opts: dict[str, object]
    ) -> casadi.Function:
        """Return the function of all derivatives."""
        jacobian = _Jacobian(self, name, inames, onames, opts)
        self._jacobians.append(jacobian)  # CasADi keeps no reference to it
        return jacobian


class _Jacobian(_Callback):
    """All derivatives of a _SceneFunction, of its inputs and outputs."""

    def __init__(
        self,
        function: _SceneFunction,
        name: str,
        inames: Sequence[str],
        onames: Sequence[str],
        opts: dict[str, object],
    ) -> None:
        super().__init__()
        self._function = function
        self._inputs, self._outputs = inames, onames
        self._sizes = [function.length_of(i) for i in range(function.get_n_in())]
        self.construct(name, opts)

    def get_sparsity_in(self, i: int) -> casadi.Sparsity:
        """Return the size of an input; the outputs of the function are not read."""
        if i < len(self._sizes):
            return casadi.Sparsity.dense(self._sizes[i], 1)
        return casadi.Sparsity(self._sizes[0], 1)

    def get_sparsity_out(self, i: int) -> casadi.Sparsity:
        """Return the size of a block."""
        return casadi.Sparsity.dense(self._sizes[0], self._sizes[i % len(self._sizes)])

    def eval(self, arguments: Sequence[casadi.DM]) -> list[Array]:
        """Return the blocks, row by row."""
        found = self._function.find(_arrays(arguments[: len(self._sizes)]))
        # Without parameters the last ones are empty.
        return [block for row in found.blocks for block in row[: len(self._sizes)]]


class ForwardDynamics(_SceneFunction):
    """acceleration = f(q, v, tau[, p]) of a scene, with all of its contacts, for CasADi.

    q, v, tau and acceleration are (nv,). CasADi's q is the displacement from `q0` (nq,) in the
    tangent space: Pinocchio's is pinocchio.integrate(model, q0, q). Where each joint is prismatic,
    or revolute with one coordinate, and q0 is neutral (the default), the two are equal. First
    derivatives are analytic, second ones are not known: solvers approximate the Hessian
    (ipopt.hessian_approximation = "limited-memory").

    `parameters` names numbers of the scene by which it is a function, too: those of the `vary` of
    Simulation.rollout that have one value, such as "PAIR.law.stiffness". p (n,) are their values.

    Friction with bristles is refused with InvalidParameter, as q and v do not hold their stretch;
    `without_history=True` takes them unstretched in every state: friction then creeps as if it
    had no spring.
    """

    _outputs = ("acceleration",)

    def _find(self, scene: Scene, q: Array, v: Array, tau: Array) -> _Found:
        d = scene.dynamics_derivatives(q, v, tau, parameters=self.parameters)
        return _Found([d.acceleration], [[d.by_q, d.by_v, d.by_tau, d.by_parameters]])


class Step(_SceneFunction):
    """(q_next, v_next) = step(q, v, tau[, p]): a step of a simulation with fixed dt, for CasADi.

    The torques tau are held. All are (nv,), with q and p as of `ForwardDynamics`. Raises
    InvalidParameter for an integrator with error control, and for friction with bristles.
    """

    _outputs = ("q_next", "v_next")

    def __init__(
        self,
        simulation: Simulation,
        q0: ArrayLike | None = None,
        *,
        parameters: Iterable[str] = (),
        without_history: bool = False,
    ) -> None:
        check_type("simulation", simulation, Simulation, "must be a sphshell_pin.Simulation")
        self._integrator = simulation.integrator
        check_fixed_step(simulation)
        super().__init__(
            simulation.scene, q0, parameters=parameters, without_history=without_history
        )

    def _find(self, scene: Scene, q: Array, v: Array, tau: Array) -> _Found:
        simulation = Simulation(scene, self._integrator)
        d = simulation.step_derivatives(q, v, tau, parameters=self.parameters)
        nv = len(v)
        # Derivative of the displacement from q0 by the tangent space where the step ends.
        end = pin.difference(self._model, self._q0, d.q)
        back = pin.dDifference(self._model, self._q0, d.q, pin.ArgumentPosition.ARG1)
        blocks = [d.by_state[:, :nv], d.by_state[:, nv:], d.by_tau, d.by_parameters]
        return _Found(
            [end, d.v], [[back @ one[:nv] for one in blocks], [one[nv:] for one in blocks]]
        )


def _arrays(arguments: Sequence[casadi.DM]) -> list[Array]:
    return [np.array(one, dtype=float).ravel() for one in arguments]
