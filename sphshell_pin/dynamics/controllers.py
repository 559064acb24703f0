"""Joint torques: the controllers that run inside the compiled loop."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.checks import (
    check_configuration,
    check_name,
    check_names,
    check_not_negative,
    check_placement,
    check_points,
    check_positive,
    check_type,
    check_vector,
)
from sphshell_pin.dynamics.models import find_frame
from sphshell_pin.dynamics.scene import Scene, SceneContacts
from sphshell_pin.errors import InvalidParameter, NameNotFound, add_origin
from sphshell_pin.shell import Shell

Array = NDArray[np.float64]
Callback = Callable[[float, Array, Array, SceneContacts], Any]


class Controller(ABC):
    """A recipe for joint torques, bound to a scene when a run begins.

    `joints` names the driven joints; by default all but free-flyers (a floating base or object has
    no motor).
    """

    joints: Iterable[str] | None

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless `joints` is None or a list of names."""
        if self.joints is not None:
            object.__setattr__(self, "joints", check_names("joints", self.joints))

    @abstractmethod
    def to_core(self, scene: Scene, q0: Array) -> _core.Controller:
        """Build the C++ controller for `scene`, started at q0 (nq,)."""

    def actuated(self, model: pin.Model) -> Array:
        """Return (nv,): 1 where a velocity is driven, else 0."""
        names = list(model.names)
        if self.joints is None:
            chosen = [
                n
                for n in names[1:]
                if model.joints[model.getJointId(n)].shortname() != "JointModelFreeFlyer"
            ]
        else:
            chosen = list(self.joints)
        mask = np.zeros(model.nv)
        for name in chosen:
            if name not in names[1:]:
                raise NameNotFound("joint", name, "the model", names[1:])
            joint = model.joints[model.getJointId(name)]
            mask[joint.idx_v : joint.idx_v + joint.nv] = 1
        return mask


@dataclass(frozen=True)
class GravityCompensation(Controller):
    """Torques that hold the robot against gravity."""

    joints: Iterable[str] | None = None

    def to_core(self, scene: Scene, q0: Array) -> _core.Controller:
        """Build the C++ controller."""
        return _core.GravityCompensation(self.actuated(scene.model))


@dataclass(frozen=True)
class JointPD(Controller):
    """Torques kp (q_ref - q) - kd v, plus gravity unless `gravity_compensation` is False.

    `kp` [N m/rad or N/m] and `kd` [N m s/rad or N s/m] are one number or (nv,); `q_ref` (nq,) is
    the start of the run where it is None; the difference is pinocchio.difference's.
    """

    kp: Any
    kd: Any
    q_ref: Any = None
    gravity_compensation: bool = True
    joints: Iterable[str] | None = None

    def to_core(self, scene: Scene, q0: Array) -> _core.Controller:
        """Build the C++ controller."""
        model = scene.model
        q_ref = q0 if self.q_ref is None else check_configuration("q_ref", model, self.q_ref)
        return _core.JointPd(
            _gains("kp", self.kp, model.nv),
            _gains("kd", self.kd, model.nv),
            q_ref,
            bool(self.gravity_compensation),
            self.actuated(model),
        )


@dataclass(frozen=True)
class CartesianImpedance(Controller):
    """Follow a path with a frame's origin and press on the surface: J^T F plus the bias torques.

    F = stiffness (x_d - x) + damping (x_d' - x') [N/m], [N s/m] (Hogan 1985). `path` (k, 3) [m] are
    the corners of the way: with `shell` (at `placement` in `shell_frame`, by default the universe)
    in the shell's frame and projected on it, else in the world. With `normal_force` [N] (needs a
    shell) the spring acts in the tangent plane only, and the frame is pushed against the shell's
    normal, on the side where the frame is at the start. The target waits `lead_in` [s] at the first
    point, then moves at `speed` [m/s], then waits at the last. `rotational_stiffness` [N m/rad] and
    `rotational_damping` [N m s/rad] hold the orientation of the start. `posture_stiffness`
    [N m/rad] draws the joints to `q_ref` (default: the start) and `joint_damping` [N m s/rad]
    calms the motion that the frame does not show; both are one number or (nv,).
    """

    frame: str
    path: Any
    stiffness: float
    damping: float
    normal_force: float = 0.0
    shell: Shell | None = None
    shell_frame: str | None = None
    placement: pin.SE3 | None = None
    speed: float = 0.05
    lead_in: float = 0.0
    rotational_stiffness: float = 0.0
    rotational_damping: float = 0.0
    posture_stiffness: Any = 0.0
    joint_damping: Any = 0.0
    q_ref: Any = None
    joints: Iterable[str] | None = None

    def __post_init__(self) -> None:
        """Raise InvalidParameter for wrong types, and for a shell's place without a shell."""
        super().__post_init__()
        check_name("frame", self.frame)
        if self.shell is not None:
            check_type("shell", self.shell, Shell, "must be a Shell or None")
        for name, value in (("shell_frame", self.shell_frame), ("placement", self.placement)):
            if value is not None and self.shell is None:
                raise InvalidParameter(name, value, "says where the shell is: give the shell too")
        if self.shell_frame is not None:
            check_name("shell_frame", self.shell_frame)
        check_placement("placement", self.placement)

    def to_core(self, scene: Scene, q0: Array) -> _core.Controller:
        """Build the C++ controller: resample the path, project it, find the frames."""
        model = scene.model
        frame_index = find_frame(model, self.frame)
        carrier_index = find_frame(model, self.shell_frame or "universe", "shell_frame")
        frame, carrier = model.frames[frame_index], model.frames[carrier_index]
        placement = check_placement("placement", self.placement)
        normal_force = check_not_negative("normal_force", self.normal_force, "N")
        if normal_force and self.shell is None:
            raise InvalidParameter("normal_force", normal_force, "needs a shell to press on")
        points, normals = self._way()
        if self.shell is not None:
            data = model.createData()
            pin.framesForwardKinematics(model, data, q0)
            shell_pose = data.oMf[carrier_index] * placement
            at = shell_pose.actInv(data.oMf[frame_index].translation)
            above = float((at - points[0]) @ normals[0])
            normals = normals if above >= 0 else -normals
        times = self._times(points)
        return _core.CartesianImpedance(
            num_joints=model.njoints,
            joint=int(frame.parentJoint),
            frame=frame.placement.homogeneous,
            path_joint=int(carrier.parentJoint) if self.shell is not None else 0,
            path_placement=(
                (carrier.placement * placement).homogeneous if self.shell is not None else np.eye(4)
            ),
            times=times.tolist(),
            points=points,
            normals=normals,
            stiffness=check_not_negative("stiffness", self.stiffness, "N/m"),
            damping=check_not_negative("damping", self.damping, "N s/m"),
            normal_force=normal_force,
            rotational_stiffness=check_not_negative(
                "rotational_stiffness", self.rotational_stiffness, "N m/rad"
            ),
            rotational_damping=check_not_negative(
                "rotational_damping", self.rotational_damping, "N m s/rad"
            ),
            posture_stiffness=_gains("posture_stiffness", self.posture_stiffness, model.nv),
            joint_damping=_gains("joint_damping", self.joint_damping, model.nv),
            q_ref=q0 if self.q_ref is None else check_configuration("q_ref", model, self.q_ref),
            actuated=self.actuated(model),
        )

    def _way(self) -> tuple[Array, Array]:
        """Return points (n, 3) and normals (n, 3) (zero without a shell) along the path."""
        corners = check_points("path", self.path)
        if len(corners) == 0:
            raise InvalidParameter("path", [], "must have at least one point")
        if self.shell is None:
            return corners, np.zeros_like(corners)
        # Straight pieces between corners leave a curved surface: project a fine division of them.
        spacing = self.shell.size / 500
        pieces = [corners[:1]]
        for a, b in itertools.pairwise(corners):
            n = max(1, int(np.ceil(np.linalg.norm(b - a) / spacing)))
            pieces.append(a + (b - a) * (np.arange(1, n + 1) / n)[:, None])
        at = self.shell.closest_points(np.concatenate(pieces))
        return at.points, at.normals

    def _times(self, points: Array) -> Array:
        speed = check_positive("speed", self.speed, "m/s")
        lead_in = check_not_negative("lead_in", self.lead_in, "s")
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        return lead_in + np.concatenate([[0.0], np.cumsum(lengths)]) / speed

    def duration(self) -> float:
        """Return the time [s] at which the target reaches the last point."""
        return float(self._times(self._way()[0])[-1])


def wrap_callable(callback: Callback, model: pin.Model) -> _core.Controller:
    """Wrap tau(t, q, v, contacts) -> (nv,) for the core; its answers are checked."""

    def torque(t: float, q: bytearray, v: bytearray, rows: bytearray) -> Array:
        contacts = SceneContacts.from_rows(rows)
        try:
            tau = callback(t, np.frombuffer(q), np.frombuffer(v), contacts)
        except Exception as error:
            add_origin(error, f"the controller at t = {t:.6g} s")
            raise
        return check_vector("controller's tau", tau, model.nv)

    return _core.PythonController(torque)


def _gains(name: str, value: Any, nv: int) -> Array:
    if np.ndim(value) == 0:
        return np.full(nv, check_not_negative(name, value))
    gains = check_vector(name, value, nv)
    if (gains < 0).any():
        k = int(np.argmin(gains))
        raise InvalidParameter(f"{name}[{k}]", float(gains[k]), "must not be negative")
    return gains
