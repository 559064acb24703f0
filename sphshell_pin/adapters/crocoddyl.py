"""Scenes as models of Crocoddyl, with residuals of contact forces and of frames.

    state = crocoddyl.StateMultibody(scene.model)
    actuation = crocoddyl.ActuationModelFull(state)
    costs = crocoddyl.CostModelSum(state)
    force = ContactForceResidual(scene, state, "tip-blade", 5.0)
    costs.addCost("force", crocoddyl.CostModelResidual(state, force), 1.0)
    model = ContactStep(Simulation(scene, RungeKutta4(1e-3)), state, actuation, costs)

Such a model goes into crocoddyl.ShootingProblem like Crocoddyl's own. ContactDynamics is a scene
without a time step, for Crocoddyl's integrators.
"""

# Crocoddyl calls methods by these names.
# ruff: noqa: N802

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin import _core
from sphshell_pin.adapters import imports_of
from sphshell_pin.adapters.evaluator import (
    FORCES,
    Evaluator,
    StepEvaluator,
    check_fixed_step,
    check_without_history,
)
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_placement, check_type, check_vector
from sphshell_pin.dynamics import Scene, Simulation
from sphshell_pin.errors import InvalidParameter

with imports_of("crocoddyl"):
    import crocoddyl

__all__ = ["ContactDynamics", "ContactForceResidual", "ContactStep", "FrameResidual"]


class _Model:
    """What the models share: a scene, torques by an actuation, and costs."""

    def _take(
        self,
        scene: Scene,
        state: crocoddyl.StateMultibody,
        actuation: crocoddyl.ActuationModelAbstract,
        costs: crocoddyl.CostModelSum,
        without_history: bool,
    ) -> None:
        check_without_history(scene, without_history)
        _check_state(scene, state)
        _check_costs(scene, costs)
        self.scene, self.actuation, self.costs = scene, actuation, costs
        self._nq = scene.model.nq
        # Torques are the controls.
        self._full = isinstance(actuation, crocoddyl.ActuationModelFull)

    def calc(self, data: _Data, x: Array, u: Array | None = None) -> None:
        """Compute forces, costs, and where it leads; without u, as of a last node, no motion."""
        q, v = x[: self._nq], x[self._nq :]
        if u is None:
            data.last.calc(q, v, data.no_torque, data.unused, data.forces)
            self.costs.calc(data.costs, x)
        else:
            if not self._full:
                self.actuation.calc(data.actuation, x, u)
            tau = u if self._full else data.tau
            data.evaluator.calc(q, v, tau, data.motion, data.forces)
            self.costs.calc(data.costs, x, u)
        data.cost = data.costs.cost

    def calcDiff(self, data: _Data, x: Array, u: Array | None = None) -> None:
        """Compute the derivatives of what `calc` has computed last."""
        q, v = x[: self._nq], x[self._nq :]
        if u is None:
            derivatives = *data.last_derivatives, data.forces_by_state
            data.last.calc_diff(q, v, data.no_torque, *derivatives)
            self.costs.calcDiff(data.costs, x)
            return
        tau = u if self._full else data.tau
        data.evaluator.calc_diff(q, v, tau, data.by_state, data.by_tau, data.forces_by_state)
        if not self._full:
            self.actuation.calcDiff(data.actuation, x, u)
            data.Fx[:] = data.by_state + data.by_tau @ data.actuation.dtau_dx
            data.Fu[:] = data.by_tau @ data.actuation.dtau_du
        self.costs.calcDiff(data.costs, x, u)


class ContactDynamics(_Model, crocoddyl.DifferentialActionModelAbstract):
    """The motion of a scene, with Crocoddyl's costs.

    The acceleration and its derivatives are those of the scene: all of its pairs, on moving shells
    too, and what acts in its joints. `state` is a crocoddyl.StateMultibody of `scene.model`,
    `actuation` and `costs` are as of crocoddyl.DifferentialActionModelFreeFwdDynamics.
    crocoddyl.IntegratedActionModelEuler of it makes the steps of
    `Simulation(scene, SemiImplicitEuler(dt))`.

    Costs may have the residuals of this module, Crocoddyl's ResidualModelState and
    ResidualModelControl, and your own. Others of Crocoddyl's are refused, as its wheels (3.2.1) are
    built for Pinocchio 4.0 and read frames and gravity of Pinocchio 4.1's models at wrong places in
    memory.

    Raises InvalidParameter for them, for a state of another model, and for friction with bristles,
    as a state of q and v does not hold their stretch; `without_history=True` takes them
    unstretched in every state: friction then creeps as if it had no spring.
    """

    def __init__(
        self,
        scene: Scene,
        state: crocoddyl.StateMultibody,
        actuation: crocoddyl.ActuationModelAbstract,
        costs: crocoddyl.CostModelSum,
        *,
        without_history: bool = False,
    ) -> None:
        self._take(scene, state, actuation, costs, without_history)
        super().__init__(state, actuation.nu, costs.nr)

    def createData(self) -> _DynamicsData:
        """Return the memory of one node."""
        return _DynamicsData(self)


class ContactStep(_Model, crocoddyl.ActionModelAbstract):
    """A step of a simulation under held torques, with Crocoddyl's costs: a node by itself.

    It makes the steps of `simulation`, with any integrator of a fixed dt, such as
    LinearlyImplicitEuler. The costs of a node are dt times those at its start, without controls
    (as of a last node) those. The whole step is one call of the compiled core: it takes about half
    the time of crocoddyl.IntegratedActionModelRK of a ContactDynamics.

    Arguments, costs and errors as of ContactDynamics; InvalidParameter for an integrator with error
    control, too.
    """

    def __init__(
        self,
        simulation: Simulation,
        state: crocoddyl.StateMultibody,
        actuation: crocoddyl.ActuationModelAbstract,
        costs: crocoddyl.CostModelSum,
        *,
        without_history: bool = False,
    ) -> None:
        check_type("simulation", simulation, Simulation, "must be a sphshell_pin.Simulation")
        self._take(simulation.scene, state, actuation, costs, without_history)
        self.dt = check_fixed_step(simulation)
        super().__init__(state, actuation.nu, costs.nr)
        self.simulation = simulation

    def createData(self) -> _StepData:
        """Return the memory of one node."""
        return _StepData(self)

    def calc(self, data: _Data, x: Array, u: Array | None = None) -> None:
        """Compute the next state, forces and costs; without u, as of a last node, it stays."""
        super().calc(data, x, u)
        if u is None:
            data.motion[:] = x
        else:
            data.cost *= self.dt

    def calcDiff(self, data: _Data, x: Array, u: Array | None = None) -> None:
        """Compute the derivatives of what `calc` has computed last."""
        super().calcDiff(data, x, u)
        if u is not None:
            for name in ("Lx", "Lu", "Lxx", "Lxu", "Luu"):
                derivative = getattr(data, name)
                np.multiply(derivative, self.dt, out=derivative)


class _Data:
    """The memory of one node: actuation, costs, and the forces that their residuals read."""

    evaluator: Evaluator | StepEvaluator
    last: Evaluator
    """Evaluator of a last node, which has no controls."""
    last_derivatives: tuple[Array, Array]
    motion: Array
    """The acceleration, or the next state."""
    cost: float
    Fx: Array
    Fu: Array

    def _share(self, model: ContactDynamics | ContactStep, rows: int) -> None:
        """Share memory with Crocoddyl; derivatives have `rows`."""
        nv, forces = model.state.nv, FORCES * len(model.scene.pairs)
        self.forces = np.zeros((forces, 1))
        self.forces_by_state = np.zeros((forces, 2 * nv))
        self.no_torque, self.unused = np.zeros(nv), np.zeros(nv)
        self.actuation = model.actuation.createData()
        self.collector = crocoddyl.DataCollectorActuation(self.actuation)
        self.costs = model.costs.createData(self.collector)
        self.costs.shareMemory(self)
        self.tau = self.actuation.tau
        full = model._full
        self.by_state = _matrix(self.Fx if full else np.zeros((rows, 2 * nv), order="F"), rows)
        self.by_tau = _matrix(self.Fu if full else np.zeros((rows, nv), order="F"), rows)
        for cost in self.costs.costs.todict().values():
            if isinstance(cost.residual, _ForceData):
                cost.residual.follow(self)


class _DynamicsData(crocoddyl.DifferentialActionDataAbstract, _Data):
    """The memory of one node of a ContactDynamics."""

    def __init__(self, model: ContactDynamics) -> None:
        super().__init__(model)
        self.evaluator = self.last = Evaluator(model.scene)
        self.motion = self.xout
        self._share(model, model.state.nv)
        self.last_derivatives = self.by_state, self.by_tau


class _StepData(crocoddyl.ActionDataAbstract, _Data):
    """The memory of one node of a ContactStep."""

    def __init__(self, model: ContactStep) -> None:
        super().__init__(model)
        nv = model.state.nv
        self.evaluator, self.last = StepEvaluator(model.simulation), Evaluator(model.scene)
        self.last_derivatives = np.zeros((nv, 2 * nv), order="F"), np.zeros((nv, nv), order="F")
        self.motion = self.xnext
        self._share(model, 2 * nv)


class ContactForceResidual(crocoddyl.ResidualModelAbstract):
    """The force of a pair on its sphere minus a reference [N].

    `pair` names a pair of `scene`; of all its contacts the residual takes the sum. `reference` is a
    number for the normal force (nr = 1), the sum of `normal_force`, or three numbers for the force
    in the world (nr = 3), the sum of `force_world`. It can be changed between solves. `nu` is the
    number of controls (default nv).

    Where nothing touches, the force and its derivatives are zero: what is to find a contact needs a
    cost besides, such as a FrameResidual, that leads there. The residual works in the costs of a
    ContactDynamics or ContactStep of the same scene.
    """

    def __init__(
        self,
        scene: Scene,
        state: crocoddyl.StateMultibody,
        pair: str,
        reference: ArrayLike,
        nu: int | None = None,
    ) -> None:
        _check_state(scene, state)
        size = 1 if np.ndim(reference) == 0 else 3
        self._reference = check_vector("reference", np.atleast_1d(reference), size, " [N]")
        super().__init__(state, size, state.nv if nu is None else nu, True, True, False)
        self.scene = scene
        self.pair = scene.pair(pair).name

    @property
    def reference(self) -> Array:
        """The reference (nr,) [N]."""
        return self._reference

    @reference.setter
    def reference(self, reference: ArrayLike) -> None:
        self._reference = check_vector("reference", np.atleast_1d(reference), self.nr, " [N]")

    def createData(self, collector: crocoddyl.DataCollectorAbstract) -> _ForceData:
        """Return the memory of one node."""
        return _ForceData(self, collector)

    def calc(self, data: _ForceData, x: Array, u: Array | None = None) -> None:
        """Compute the residual."""
        np.subtract(data.force, self._reference, out=data.residual)

    def calcDiff(self, data: _ForceData, x: Array, u: Array | None = None) -> None:
        """Compute its derivatives."""
        data.by_state[:] = data.force_by_state


class _ForceData(crocoddyl.ResidualDataAbstract):
    """The memory of one node of a ContactForceResidual."""

    def __init__(
        self, model: ContactForceResidual, collector: crocoddyl.DataCollectorAbstract
    ) -> None:
        super().__init__(model, collector)
        self.model = model
        self.residual, self.by_state = self.r, _matrix(self.Rx, model.nr)

    def follow(self, data: _Data) -> None:
        """Read the forces of a node."""
        names = [pair.name for pair in self.model.scene.pairs]
        first = FORCES * names.index(self.model.pair)
        rows = slice(first, first + 1) if self.model.nr == 1 else slice(first + 1, first + FORCES)
        self.force, self.force_by_state = data.forces[rows, 0], data.forces_by_state[rows]


class FrameResidual(crocoddyl.ResidualModelAbstract):
    """Where a frame of a scene's model is, against a reference.

    `reference` is three numbers for its place in the world (nr = 3) [m], or a pinocchio.SE3 for its
    placement (nr = 6): log6 of the placement against the reference, in the frame. It can be changed
    between solves. These are Crocoddyl's ResidualModelFrameTranslation and
    ResidualModelFramePlacement. `nu` is the number of controls (default nv). Raises FrameNotFound.
    """

    def __init__(
        self,
        scene: Scene,
        state: crocoddyl.StateMultibody,
        frame: str,
        reference: ArrayLike | pin.SE3,
        nu: int | None = None,
    ) -> None:
        _check_state(scene, state)
        size = 6 if isinstance(reference, pin.SE3) else 3
        super().__init__(state, size, state.nv if nu is None else nu, True, False, False)
        self.scene = scene
        self.frame = frame
        self._joint, self._placement = scene.frame_in_joint(frame)
        self._nq = scene.model.nq
        self._scene = scene._binding
        self.reference = reference

    @property
    def reference(self) -> Array | pin.SE3:
        """The place (3,) [m], or the placement."""
        return self._reference

    @reference.setter
    def reference(self, reference: ArrayLike | pin.SE3) -> None:
        if self.nr == 3:
            self._reference = check_vector("reference", reference, 3, " [m]")
            placement = pin.SE3(np.eye(3), self._reference)
        else:
            self._reference = placement = check_placement("reference", reference)
        self._frame = _core.Frame(self._joint, self._placement.homogeneous, placement.homogeneous)

    def createData(self, collector: crocoddyl.DataCollectorAbstract) -> _FrameData:
        """Return the memory of one node."""
        return _FrameData(self, collector)

    def calc(self, data: _FrameData, x: Array, u: Array | None = None) -> None:
        """Compute the residual."""
        _core.frame_into(self._scene, self._frame, x[: self._nq], data.residual)

    def calcDiff(self, data: _FrameData, x: Array, u: Array | None = None) -> None:
        """Compute its derivatives."""
        _core.differentiate_frame_into(self._scene, self._frame, x[: self._nq], data.by_q)


class _FrameData(crocoddyl.ResidualDataAbstract):
    """The memory of one node of a FrameResidual."""

    def __init__(self, model: FrameResidual, collector: crocoddyl.DataCollectorAbstract) -> None:
        super().__init__(model, collector)
        self.residual = self.r
        self.by_q = _matrix(self.Rx, model.nr)[:, : model.state.nv]


def _matrix(array: Array, rows: int) -> Array:
    """Return a view of a matrix with `rows`; of one row or column, bindings make it flat."""
    return array.reshape((rows, -1), order="F")


def _check_state(scene: Scene, state: crocoddyl.StateMultibody) -> None:
    check_type("scene", scene, Scene, "must be a sphshell_pin.Scene")
    check_type("state", state, crocoddyl.StateMultibody, "must be a crocoddyl.StateMultibody")
    if state.pinocchio != scene.model:
        raise InvalidParameter(
            "state", state, "must be crocoddyl.StateMultibody(scene.model), of the scene's model"
        )


def _check_costs(scene: Scene, costs: crocoddyl.CostModelSum) -> None:
    for name, item in costs.costs.todict().items():
        residual = item.cost.residual
        kind, where = type(residual), f"costs['{name}']"
        if isinstance(residual, ContactForceResidual) and residual.scene is not scene:
            raise InvalidParameter(where, kind.__name__, "must be of the same scene")
        safe = kind.__name__ in ("ResidualModelState", "ResidualModelControl")
        if kind.__module__.split(".")[0] == "crocoddyl" and not safe:
            # Its own text would read the model.
            raise InvalidParameter(
                where,
                kind.__name__,
                "must not be used: Crocoddyl's wheels are built for Pinocchio 4.0 and misread the "
                "models of 4.1; take a FrameResidual of sphshell_pin.adapters.crocoddyl, or a "
                "residual of your own",
            )
