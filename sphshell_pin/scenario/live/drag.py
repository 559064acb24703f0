"""A spring from a point of a body to a cursor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.dynamics.scene.models import apparent_mass, find_frame
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter


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
        where = model.frames[find_frame(model, frame)]
        if where.parentJoint == 0:
            raise InvalidParameter("frame", frame, "is fixed to the world: nothing would move")
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
