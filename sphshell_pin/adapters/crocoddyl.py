"""Scenes as models of Crocoddyl, with residuals of contact forces and of frames.

    state = crocoddyl.StateMultibody(scene.model)
    actuation = crocoddyl.ActuationModelFull(state)
    costs = crocoddyl.CostModelSum(state)
    force = ContactForceResidual(scene, state, "tip-blade", 5.0)
    costs.addCost("force", crocoddyl.CostModelResidual(state, force), 1.0)
    dynamics = ContactDynamics(scene, state, actuation, costs)
    model = crocoddyl.IntegratedActionModelEuler(dynamics, 1e-3)

Such a model goes into crocoddyl.ShootingProblem like Crocoddyl's own.
"""

# Crocoddyl calls methods by these names.
# ruff: noqa: N802

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from sphshell_pin.adapters.evaluator import FORCES, Evaluator, check_without_history
from sphshell_pin.checks import check_type, check_vector
from sphshell_pin.dynamics import Scene
from sphshell_pin.dynamics.models import find_frame
from sphshell_pin.errors import InvalidParameter, MissingExtra

try:
    import crocoddyl
except ModuleNotFoundError as missing:
    if missing.name != "crocoddyl":
        raise
    raise MissingExtra("crocoddyl", "crocoddyl", "sphshell_pin.adapters.crocoddyl") from missing

__all__ = ["ContactDynamics", "ContactForceResidual", "FrameResidual"]

Array = NDArray[np.float64]


class ContactDynamics(crocoddyl.DifferentialActionModelAbstract):
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
        check_without_history(scene, without_history)
        _check_state(scene, state)
        _check_costs(scene, costs)
        super().__init__(state, actuation.nu, costs.nr)
        self.scene = scene
        self.actuation = actuation
        self.costs = costs
        self._nq = scene.model.nq
        # Torques are the controls.
        self._full = isinstance(actuation, crocoddyl.ActuationModelFull)

    def createData(self) -> _DynamicsData:
        """Return the memory of one node."""
        return _DynamicsData(self)

    def calc(self, data: _DynamicsData, x: Array, u: Array | None = None) -> None:
        """Compute acceleration, forces and costs; without u, as of a last node, no acceleration."""
        q, v = x[: self._nq], x[self._nq :]
        if u is None:
            data.evaluator.calc(q, v, data.no_torque, data.unused, data.forces)
            self.costs.calc(data.costs, x)
        else:
            if not self._full:
                self.actuation.calc(data.actuation, x, u)
            tau = u if self._full else data.tau
            data.evaluator.calc(q, v, tau, data.acceleration, data.forces)
            self.costs.calc(data.costs, x, u)
        data.cost = data.costs.cost

    def calcDiff(self, data: _DynamicsData, x: Array, u: Array | None = None) -> None:
        """Compute the derivatives of what `calc` has computed last."""
        q, v = x[: self._nq], x[self._nq :]
        slopes = data.by_state, data.by_tau, data.forces_by_state
        if u is None:
            data.evaluator.calc_diff(q, v, data.no_torque, *slopes)
            self.costs.calcDiff(data.costs, x)
            return
        data.evaluator.calc_diff(q, v, u if self._full else data.tau, *slopes)
        if not self._full:
            self.actuation.calcDiff(data.actuation, x, u)
            data.Fx[:] = data.by_state + data.by_tau @ data.actuation.dtau_dx
            data.Fu[:] = data.by_tau @ data.actuation.dtau_du
        self.costs.calcDiff(data.costs, x, u)


class _DynamicsData(crocoddyl.DifferentialActionDataAbstract):
    """The memory of one node of a ContactDynamics."""

    def __init__(self, model: ContactDynamics) -> None:
        super().__init__(model)
        nv, pairs = model.state.nv, len(model.scene.pairs)
        self.evaluator = Evaluator(model.scene)
        self.actuation = model.actuation.createData()
        self.collector = crocoddyl.DataCollectorActuation(self.actuation)
        self.costs = model.costs.createData(self.collector)
        self.costs.shareMemory(self)
        # These share the memory that Crocoddyl reads and writes.
        self.acceleration, self.tau = self.xout, self.actuation.tau
        full = model._full
        self.by_state = _matrix(self.Fx if full else np.zeros((nv, 2 * nv), order="F"), nv)
        self.by_tau = _matrix(self.Fu if full else np.zeros((nv, nv), order="F"), nv)
        self.forces = np.zeros((FORCES * pairs, 1))
        self.forces_by_state = np.zeros((FORCES * pairs, 2 * nv))
        self.no_torque, self.unused = np.zeros(nv), np.zeros(nv)
        for cost in self.costs.costs.todict().values():
            if isinstance(cost.residual, _ForceData):
                cost.residual.follow(self)


class ContactForceResidual(crocoddyl.ResidualModelAbstract):
    """The force of a pair on its sphere minus a reference [N].

    `pair` names a pair of `scene`; of all its contacts the residual takes the sum. `reference` is a
    number for the normal force (nr = 1), the sum of `normal_force`, or three numbers for the force
    in the world (nr = 3), the sum of `force_world`. It can be changed between solves. `nu` is the
    number of controls (default nv).

    Where nothing touches, the force and its derivatives are zero: what is to find a contact needs a
    cost besides, such as a FrameResidual, that leads there. The residual works in the costs of a
    ContactDynamics of the same scene.
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

    def follow(self, data: _DynamicsData) -> None:
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
        self.frame = find_frame(scene.model, frame, "frame")
        self._model = scene.model
        self._nq = scene.model.nq
        self.reference = reference

    @property
    def reference(self) -> Array | pin.SE3:
        """The place (3,) [m], or the placement."""
        return self._reference

    @reference.setter
    def reference(self, reference: ArrayLike | pin.SE3) -> None:
        if self.nr == 6:
            check_type("reference", reference, pin.SE3, "must be a pinocchio.SE3, as before")
            self._reference, self._inverse = pin.SE3(reference), reference.inverse()
        else:
            self._reference = check_vector("reference", reference, 3, " [m]")

    def createData(self, collector: crocoddyl.DataCollectorAbstract) -> _FrameData:
        """Return the memory of one node."""
        return _FrameData(self, collector)

    def calc(self, data: _FrameData, x: Array, u: Array | None = None) -> None:
        """Compute the residual."""
        data.q = x[: self._nq]
        pin.forwardKinematics(self._model, data.pinocchio, data.q)
        placement = pin.updateFramePlacement(self._model, data.pinocchio, self.frame)
        if self.nr == 6:
            data.error = self._inverse * placement
            data.residual[:] = pin.log6(data.error).vector
        else:
            data.residual[:] = placement.translation - self._reference

    def calcDiff(self, data: _FrameData, x: Array, u: Array | None = None) -> None:
        """Compute its derivatives."""
        frame = pin.ReferenceFrame.LOCAL if self.nr == 6 else pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        found = pin.computeFrameJacobian(self._model, data.pinocchio, data.q, self.frame, frame)
        jacobian = _matrix(found, 6)
        data.by_q[:] = pin.Jlog6(data.error) @ jacobian if self.nr == 6 else jacobian[:3]


class _FrameData(crocoddyl.ResidualDataAbstract):
    """The memory of one node of a FrameResidual."""

    def __init__(self, model: FrameResidual, collector: crocoddyl.DataCollectorAbstract) -> None:
        super().__init__(model, collector)
        self.pinocchio = model._model.createData()
        self.residual = self.r
        self.by_q = _matrix(self.Rx, model.nr)[:, : model.state.nv]
        self.q = model.scene.neutral
        self.error = pin.SE3.Identity()


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
