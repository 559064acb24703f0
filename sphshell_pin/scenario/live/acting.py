"""What acts on a live run: a body that is dragged, and targets of joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.control.controllers import Controller
from sphshell_pin.dynamics.run.advance import AnyController
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.dynamics.scene import models
from sphshell_pin.dynamics.scene.joint_components import joint_slides
from sphshell_pin.dynamics.scene.mimic import joint_angle, mimics
from sphshell_pin.dynamics.scene.models import apparent_mass, find_frame, model_reach, set_joint
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter, NameNotFound


def movable_bodies(scene: Scene) -> tuple[str, ...]:
    """Return a frame of each moving body; those with a sphere first."""
    model = scene.model
    names = {pair.joint_i: pair.frame_i for pair in scene.pairs if pair.joint_i}
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint:
            names.setdefault(frame.parentJoint, frame.name)
    for joint in range(1, model.njoints):
        if model.existFrame(model.names[joint]):
            names.setdefault(joint, model.names[joint])
    return tuple(names.values())


@dataclass(frozen=True)
class Dragged:
    """A drag at one instant: points [m], force [N] on the body, in the world, each (3,)."""

    frame: str
    point_world: Array
    target_world: Array
    force_world: Array


@dataclass(frozen=True)
class Drag:
    """A spring and a damper from a point of the body of `frame` to a target in the world.

    A free body of the mass that they were made for moves as x'' + 2 rate x' + rate^2 x = 0:
    critically damped.
    """

    frame: str
    point: Array
    """(3,) [m], in the frame."""
    rate: float
    """[1/s]"""
    mass: float
    """[kg]"""
    target: Array
    """(3,) [m], in the world."""

    @property
    def stiffness(self) -> float:
        """Stiffness of the spring [N/m]."""
        return self.mass * self.rate**2

    @property
    def damping(self) -> float:
        """Damping of the damper [N s/m]."""
        return 2.0 * self.mass * self.rate

    @classmethod
    def hold(cls, model: pin.Model, q: Array, frame: str, point: Array, rate: float) -> Drag:
        """Take hold of a point of a body in configuration q (nq,), where it is.

        Raises NameNotFound for an unknown frame, InvalidParameter for one that cannot move.
        """
        where = model.frames[models.find_moving_frame(model, frame)]
        at = where.placement.act(point)
        mass = apparent_mass(model, q, where.parentJoint, at)
        return cls(frame, point, rate, mass, np.zeros(3))

    def is_at(self, frame: str, point: Array, rate: float) -> bool:
        """Tell whether it holds this point of this body with this rate."""
        return (self.frame, self.rate) == (frame, rate) and bool((self.point == point).all())

    def act_on(self, run: OpenRun) -> None:
        """Let it act in `run` from now on."""
        run.pull(self.frame, self.point, self.target, self.stiffness, self.damping)

    def at(self, model: pin.Model, q: Array, v: Array) -> Dragged:
        """Return what it does in the state q (nq,), v (nv,)."""
        data = model.createData()
        number = find_frame(model, self.frame)
        pin.forwardKinematics(model, data, q, v)
        where = pin.updateFramePlacement(model, data, number)
        twist = pin.getFrameVelocity(model, data, number, pin.ReferenceFrame.LOCAL)
        speed = where.rotation @ (twist.linear + np.cross(twist.angular, self.point))
        x = where.act(self.point)
        force = self.stiffness * (self.target - x) - self.damping * speed
        return Dragged(self.frame, x, self.target, force)


@dataclass(frozen=True)
class Target:
    """Where a controller wants a joint of one coordinate."""

    joint: str
    rotates: bool
    """Whether the numbers are angles [rad]; else lengths [m]."""
    low: float
    high: float
    limited: bool
    """Whether `low` and `high` are the limits of the joint, else a range to move it in."""
    value: float


def targets_of(controller: AnyController, model: pin.Model, start: Array) -> tuple[Target, ...]:
    """Return the targets of the joints that `controller` pulls to its `q_ref`.

    `start` (nq,) is the start of the run, which is the target where `q_ref` states none. Joints of
    several coordinates, and those that mimic others, have none.
    """
    if not isinstance(controller, Controller) or controller.posture_gain is None:
        return ()
    pulled = controller.gain(controller.posture_gain, model) * controller.actuated(model)
    posture = controller.posture(model, start)
    follows = mimics(model)
    return tuple(
        _target(model, joint, posture)
        for joint in list(model.joints)[1:]
        if joint.nv == 1
        and joint.nq <= 2
        and pulled[joint.idx_v] > 0
        # A mimic joint has the coordinate of another one.
        and model.names[joint.id] not in follows
    )


def aimed(
    controller: AnyController, model: pin.Model, start: Array, aims: Mapping[str, float]
) -> AnyController:
    """Return `controller` with the targets `aims` [rad or m] by joint, and those it had."""
    if not isinstance(controller, Controller) or controller.posture_gain is None:
        return controller
    posture = controller.posture(model, start)
    for joint, value in aims.items():
        set_joint(model, posture, joint, value)
    changes: dict[str, Any] = {"q_ref": posture}
    return replace(controller, **changes)


def check_aim(targets: tuple[Target, ...], joint: str, value: float) -> None:
    """Raise NameNotFound or InvalidParameter unless `joint` may be sent to `value` [rad or m]."""
    found = next((one for one in targets if one.joint == joint), None)
    if found is None:
        raise NameNotFound("joint with a target", joint, "this run", [o.joint for o in targets])
    if found.limited and not found.low <= value <= found.high:
        unit = "rad" if found.rotates else "m"
        raise InvalidParameter(
            f"target of '{joint}'",
            value,
            f"must be within the limits of the joint, {found.low:.6g} to {found.high:.6g} {unit}",
        )


def _target(model: pin.Model, joint: pin.JointModel, posture: Array) -> Target:
    value = joint_angle(posture[joint.idx_q : joint.idx_q + joint.nq])
    rotates = not joint_slides(joint)
    low, high = -np.inf, np.inf
    if joint.nq == 1:
        low = float(model.lowerPositionLimit[joint.idx_q])
        high = float(model.upperPositionLimit[joint.idx_q])
    # A model that states none has infinite ones, very large ones, or the same for both.
    room = 4.0 * np.pi if rotates else 4.0 * model_reach(model)
    limited = low < high and low > -room and high < room
    if not limited:
        half = np.pi if rotates else model_reach(model)
        low, high = -half, half
    name = model.names[joint.id]
    return Target(name, rotates, min(low, value), max(high, value), limited, value)
