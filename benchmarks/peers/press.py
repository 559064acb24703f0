"""The Panda that presses a fingertip on a sheet of 200 k triangles: what a step costs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from benchmarks.peers import shapes
from benchmarks.peers.engine import Trajectory
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import MissingExtra
from sphshell_pin.study.report import steps as panda
from sphshell_pin.study.report.surfaces import height as wavy_height

FRAME = "panda_hand_tcp"
CELLS, SIZE = 316, 1.0  # 2 * 316^2 = 199712 triangles; [m]
PUSH = 0.015  # [m]


@dataclass(frozen=True)
class PressScene:
    """A Panda, fingers locked, joint PD with gravity compensation, on a wavy sheet.

    torque = kp (q_ref - q) - kd v + what balances gravity. At q0 the fingertip is `rise` [m] deep
    in the sheet, at q_ref PUSH [m] below its place at q0: it presses with some 5 N. `urdf` is its
    text for every engine: the arm without pictures, fingers fixed, no joint friction, and the
    fingertip as a collision sphere on the link FRAME. The law: linear spring and dashpot, Coulomb
    friction.

    Truth: none; the fingertip's depth in the exact sheet at the end is reported, to see that every
    engine presses.
    """

    name: str
    title: str
    urdf: str
    surface: shapes.Surface
    place: tuple[float, float, float]
    q0: tuple[float, ...]
    q_ref: tuple[float, ...]
    dt: float = 1e-4
    steps: int = 5000
    radius: float = panda.RADIUS
    rise: float = 5e-4
    kp: float = 100.0
    kd: float = 10.0
    stiffness: float = 1e4
    damping: float = 20.0
    mu: float = 0.3
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    unit: ClassVar[str] = "us / step"

    @property
    def duration(self) -> float:
        """Duration of the run [s]."""
        return self.dt * self.steps

    @property
    def record_dt(self) -> float:
        """Rows are not wanted: the end is enough [s]."""
        return self.duration

    def variants(self) -> tuple[PressScene, ...]:
        """One run."""
        return (self,)

    def errors(self, found: Trajectory) -> dict[str, float]:
        """`pressed [mm]`: depth of the fingertip in the exact sheet at the end."""
        place = np.array(self.place)
        x, y, z = found.position[-1] - place
        # Newton's method for the nearest place of the sheet, in x and y.
        at = np.array([x, y])
        for _ in range(20):
            gap, gradient = z - _height(at), _gradient(at)
            at += 0.5 * (np.array([x, y]) - at + gap * gradient)
        away = float(np.linalg.norm([x - at[0], y - at[1], z - _height(at)]))
        return {"pressed [mm]": (self.radius - away) * 1e3}

    @staticmethod
    def joined(errors: list[dict[str, float]]) -> dict[str, float]:
        """Return those of the only run."""
        return errors[0]


def _height(at: Array) -> float:
    return float(wavy_height(at[:1], at[1:])[0])


def _gradient(at: Array, small: float = 1e-6) -> Array:
    steps = small * np.eye(2)
    return np.array([(_height(at + e) - _height(at - e)) / (2 * small) for e in steps])


def tip_motion(scene: PressScene, q: Array, v: Array) -> tuple[Array, Array, Array]:
    """Return the fingertip's place [m], velocity [m/s] and angular velocity [rad/s]."""
    model = pin.buildModelFromXML(scene.urdf)
    data, frame = model.createData(), model.getFrameId(FRAME)
    pin.forwardKinematics(model, data, q, v)
    tip = pin.updateFramePlacement(model, data, frame).translation
    motion = pin.getFrameVelocity(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    return tip.copy(), motion.linear.copy(), motion.angular.copy()


def at_the_end(
    scene: PressScene, q: Array, v: Array, cpu: float, steps: int, force: Array | None = None
) -> Trajectory:
    """Return the only row of a run of the Panda; `force` (3,) [N] is that on the fingertip."""
    position, velocity, spin = tip_motion(scene, q, v)
    return Trajectory(
        t=np.array([steps * scene.dt]),
        position=position[None],
        velocity=velocity[None],
        angular_velocity=spin[None],
        cpu=cpu,
        simulated=steps * scene.dt,
        steps=steps,
        force=None if force is None else force[None],
    )


def panda_urdf(radius: float) -> str:
    """Return the text of the Panda's URDF, made bare: see PressScene.

    Raises MissingExtra.
    """
    try:
        from example_robot_data import getModelPath
    except ImportError:
        raise MissingExtra("example-robot-data-loaders", "robots", "the Panda") from None
    file = "panda_description/urdf/panda.urdf"
    robot = ElementTree.parse(Path(getModelPath(file)) / file).getroot()
    for link in robot.iter("link"):
        for part in (*link.findall("visual"), *link.findall("collision")):
            link.remove(part)
        if link.get("name") == FRAME:
            geometry = ElementTree.SubElement(
                ElementTree.SubElement(link, "collision", name="fingertip"), "geometry"
            )
            ElementTree.SubElement(geometry, "sphere", radius=str(radius))
    for joint in robot.iter("joint"):
        if joint.get("name") in panda.FINGERS:
            joint.set("type", "fixed")
        for name in ("dynamics", "mimic", "safety_controller"):
            for part in joint.findall(name):
                joint.remove(part)
    return ElementTree.tostring(robot, encoding="unicode")


@cache
def press() -> PressScene:
    """Return the scene; raise MissingExtra."""
    urdf = panda_urdf(panda.RADIUS)
    model = pin.buildModelFromXML(urdf)
    data = model.createData()
    frame, axes = model.getFrameId(FRAME), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    jacobian = pin.computeFrameJacobian(model, data, panda.START, frame, axes)
    pin.framesForwardKinematics(model, data, panda.START)
    tip = data.oMf[frame].translation
    lower = np.linalg.pinv(jacobian[:3]) @ [0.0, 0.0, -PUSH]
    place = tip + [0.0, 0.0, PressScene.rise - panda.RADIUS]
    return PressScene(
        name="press",
        title="Panda presses a fingertip on 199712 triangles, joint PD + gravity compensation",
        urdf=urdf,
        surface=shapes.wavy(CELLS, SIZE, place),
        place=tuple(place.tolist()),
        q0=tuple(panda.START.tolist()),
        q_ref=tuple((panda.START + lower).tolist()),
    )
