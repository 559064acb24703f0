"""The controller that follows a path with a point of the robot and presses on a surface."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.base import checks
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.parameters import parameter
from sphshell_pin.dynamics.control.controllers import Controller, Gain, Posture, ShellPlace
from sphshell_pin.dynamics.control.target_path import Curve, Timing, path_fields
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.scene.models import find_frame, find_moving_frame, model_reach
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell import Shell

__all__ = ["CartesianImpedance"]


# Distances of a path's points from their shell, as a part of its size, and of the path from the
# moved point, as a part of the robot's reach: what is farther is probably a mistake.
OFF_PATH, OUT_OF_REACH = 0.1, 0.05
# A step between neighboring knots, as a part of the shell's size: the nearest point has changed to
# another side. And the part of the speed that the curvature of a spline leaves.
JUMP, SLOW = 0.05, 0.2
# Rows of a run that are looked at.
_MOST_ROWS = 200


# What the C++ class takes as it is.
_NUMBERS = (
    *("stiffness", "damping", "normal_force", "force_rise"),
    *("rotational_stiffness", "rotational_damping", "decoupled", "friction_compensation"),
)


@dataclass(frozen=True)
class CartesianImpedance(Controller, kind="cartesian-impedance"):
    """Follow a path with a point of a frame and press on the surface: J^T F plus the bias torques.

    F = stiffness (x_d - x) + damping (x_d' - x') [N/m], [N s/m] (Hogan 1985), at the point x with
    the coordinates `offset` (3,) [m] in the frame: its origin by default. `path` (k, 3) [m] are
    its points: with `shell` in the shell's frame and projected on it, else in the world. Straight
    pieces join them, or with `spline` one smooth curve. With `normal_force` [N] (needs a shell) the
    spring acts in the tangent plane only, and the point is pushed against the shell's normal, on
    the side where it is at the start; the force comes on smoothly over the first `force_rise` [s].

    The target waits `lead_in` [s] at the first point, moves at `speed` [m/s], and waits at the
    last. With `acceleration` [m/s2], `jerk` [m/s3] or both it sets out and stops softly, at each
    point of straight pieces, and of a spline where it turns back or goes over an edge of the shell;
    over a spline the speed is reduced to one at which the curvature takes no more than
    `acceleration`. Without them its speed jumps, and a force with it.

    `rotational_stiffness` [N m/rad] and `rotational_damping` [N m s/rad] hold the orientation of
    the start. `posture_stiffness` [N m/rad] pulls the joints to `q_ref` (default: the start) and
    `joint_damping` [N m s/rad] damps the motion of the joints; gains and `q_ref` as in JointPD.

    Without `decoupled` the robot's inertia acts on the surface as it follows the path. With it
    the wrench that the target's acceleration a_d takes is added, Lambda (a_d - J' v) with Lambda =
    (J M^-1 J^T)^-1, and posture and joint damping act where they do not accelerate the frame
    (Khatib, IEEE Journal of Robotics and Automation 3, 1987).

    The shell is at `placement` in `shell_frame`; if neither is given, where the contacts of the
    scene have it, and if none has it, in the universe. If they have it in several places,
    InvalidParameter asks for `shell_frame`.

    Parameters
    ----------
    frame : the frame that is moved
    path : points of the path (k, 3)
    stiffness : pull towards the target
    damping : damping relative to the target
    normal_force : push against the normal of the shell
    shell : the surface to press on
    speed : speed of the target
    lead_in : time before the target moves
    rotational_stiffness : holds the orientation of the start
    rotational_damping : damps the rotation of the frame
    posture_stiffness : pull towards `q_ref`
    joint_damping : damping of the joints
    q_ref : posture; by default that of the start
    offset : of the point that is moved, in the frame
    spline : a smooth curve through the points of the path
    acceleration : limit of the target's
    jerk : limit of the target's along the path
    decoupled : the robot's inertia, posture and joint damping do not act on the frame
    force_rise : time in which the normal force comes on, smoothly
    friction_compensation : add the torques that damping and dry friction of the joints take
    """

    posture_gain: ClassVar[str | None] = "posture_stiffness"
    frame: str = parameter()
    path: Sequence[tuple[float, float, float]] | Array = parameter(unit="m", min_length=1)
    stiffness: float = parameter(at_least=0, unit="N/m", label="tip stiffness")
    damping: float = parameter(at_least=0, unit="N s/m", label="tip damping")
    normal_force: float = parameter(0.0, at_least=0, unit="N")
    shell: Shell | str | None = parameter(None)
    shell_frame: str | None = None
    placement: pin.SE3 | None = None
    speed: float = parameter(0.05, above=0, unit="m/s", label="path speed")
    lead_in: float = parameter(0.0, at_least=0, unit="s", label="lead-in")
    rotational_stiffness: float = parameter(0.0, at_least=0, unit="N m/rad")
    rotational_damping: float = parameter(0.0, at_least=0, unit="N m s/rad")
    posture_stiffness: Gain = parameter(0.0, unit="N m/rad")
    joint_damping: Gain = parameter(0.0, unit="N m s/rad")
    q_ref: Posture | None = parameter(None)
    joints: Iterable[str] | None = None
    offset: Sequence[float] | Array = parameter(
        (0.0, 0.0, 0.0), unit="m", min_length=3, max_length=3
    )
    spline: bool = parameter(False)
    acceleration: float | None = parameter(None, above=0, unit="m/s2", label="path acceleration")
    jerk: float | None = parameter(None, above=0, unit="m/s3", label="path jerk")
    decoupled: bool = parameter(False)
    force_rise: float = parameter(0.0, at_least=0, unit="s", label="force rise")
    friction_compensation: bool = parameter(False)

    def __post_init__(self) -> None:
        """Raise InvalidParameter for wrong types, and for a shell's place without a shell."""
        super().__post_init__()
        checks.check_name("frame", self.frame)
        if self.shell is not None:
            checks.check_type("shell", self.shell, (Shell, str), "must be a Shell or None")
        for name, value in (("shell_frame", self.shell_frame), ("placement", self.placement)):
            if value is not None and self.shell is None:
                raise InvalidParameter(name, value, "says where the shell is: give the shell too")
        if self.shell_frame is not None:
            checks.check_name("shell_frame", self.shell_frame)
        checks.check_placement("placement", self.placement)
        checks.check_vector("offset", self.offset, 3, " [m]")

    def in_scenario(self, find_shell: Callable[[str], ShellPlace]) -> CartesianImpedance:
        """Return this controller with the shell that it names."""
        if not isinstance(self.shell, str):
            return self
        shell, frame, placement = find_shell(self.shell)
        return replace(self, shell=shell, shell_frame=frame, placement=placement)

    def _fields(self, scene: Scene, q0: Array) -> dict[str, ArrayLike]:
        """Resample the path, project it, find the frames."""
        model = scene.model
        frame_index = find_moving_frame(model, self.frame)
        if isinstance(self.shell, str):
            raise InvalidParameter("shell", self.shell, "must be a Shell: names are for files")
        if self.normal_force and self.shell is None:
            raise InvalidParameter("normal_force", self.normal_force, "needs a shell to press on")
        frame = model.frames[frame_index]
        carrier_name, placement = self._shell_place(scene)
        carrier_index = find_frame(model, carrier_name, "shell_frame")
        carrier = model.frames[carrier_index]
        curve, timing = self._motion()
        if self.shell is not None:
            data = model.createData()
            pin.framesForwardKinematics(model, data, q0)
            shell_pose = data.oMf[carrier_index] * placement
            at = shell_pose.actInv(data.oMf[frame_index].act(np.asarray(self.offset)))
            if float((at - curve.points[0]) @ curve.normals[0]) < 0:
                curve = replace(curve, normals=-curve.normals)
        offset = pin.SE3(np.eye(3), np.array(self.offset, dtype=float))
        return {
            **path_fields(curve, timing),
            **{name: getattr(self, name) for name in _NUMBERS},
            **{name: self.gain(name, model) for name in ("posture_stiffness", "joint_damping")},
            "joint": int(frame.parentJoint),
            "frame": (frame.placement * offset).homogeneous,
            "path_joint": int(carrier.parentJoint),
            "path_placement": (carrier.placement * placement).homogeneous,
            "q_ref": self.posture(model, q0),
            "actuated": self.actuated(model),
        }

    def _shell_place(self, scene: Scene) -> tuple[str, pin.SE3]:
        """Return the frame that carries the path, and where the path's own frame is in it."""
        placement = checks.check_placement("placement", self.placement)
        if self.shell_frame is not None or self.placement is not None:
            return self.shell_frame or "universe", placement
        places: list[tuple[str, pin.SE3]] = []
        for one in (one for pair in scene.pairs for one in pair.shells):
            place = one.frame, one.placement
            if one.shell is self.shell and place not in places:
                places.append(place)
        if len(places) > 1:
            frames = ", ".join(f"'{frame}'" for frame, _ in places)
            raise InvalidParameter(
                "shell",
                self.shell,
                f"is in several places of the scene ({frames}): give shell_frame and placement",
            )
        return places[0] if places else ("universe", placement)

    def _motion(self) -> tuple[Curve, Timing]:
        """Return the target's curve, in the path's own frame, and its motion along it."""
        points = checks.check_points("path", self.path)
        if len(points) == 0:
            raise InvalidParameter("path", [], "must have at least one point")
        shell = self.shell if isinstance(self.shell, Shell) else None
        curve = Curve.through(points, shell, spline=self.spline)
        return curve, Timing.along(curve, self.lead_in, self.speed, self.acceleration, self.jerk)

    def _setup_warnings(self, scene: Scene, q0: Array) -> list[str]:
        """Say where the path is off the shell or jumps on it, and bends that take the speed."""
        said: list[str] = []
        curve = self._motion()[0]
        if isinstance(self.shell, Shell):
            corners = checks.check_points("path", self.path)
            off = np.abs(self.shell.closest_points(corners).distances)
            k, size = int(np.argmax(off)), self.shell.size
            if off[k] > OFF_PATH * size:
                said.append(
                    f"the controller's path is off the shell: path[{k}] is {off[k]:.3g} m from "
                    f"'{self.shell.name}', which measures {size:.3g} m; its nearest point is "
                    "taken: give points on the surface, in the shell's own coordinates [m]"
                )
            step, before, after = curve.jump
            if off[k] <= OFF_PATH * size and step > JUMP * size:
                said.append(
                    f"the controller's path jumps by {step:.3g} m, from {_text(before)} to "
                    f"{_text(after)} m: there the nearest point of '{self.shell.name}' is on "
                    "another side: give points of the path on the surface in between"
                )
        away = float(
            np.linalg.norm(self._off_target(scene, curve, curve.at(np.zeros(1))[0], 0.0, q0))
        )
        pull = away * self.stiffness
        if self.normal_force and pull > self.normal_force:
            said.append(
                f"the controller's path begins {away:.3g} m from the tip, which its spring pulls "
                f"there with {pull:.3g} N at once, more than normal_force = {self.normal_force:g} "
                "N: begin the path under the tip, or start with the tip on the path"
            )
        if len(curve.tangents):
            pieces = [
                (curve.speed_limit(a, b, self.speed, self.acceleration), b - a)
                for a, b in pairwise(curve.corners)
            ]
            least, length = min(pieces)
            if least < SLOW * self.speed:
                said.append(
                    f"the controller's path bends so much that its target goes at {least:.3g} m/s, "
                    f"not {self.speed:g} m/s, over {length:.3g} m: raise `acceleration`, or give "
                    "points with wider bends"
                )
        return said

    def _result_warnings(self, result: Result) -> list[str]:
        """Say so if a controller that presses has touched nothing, or never came to its path."""
        scene, said = result.scene, list[str]()
        if scene is None or len(result.t) == 0:
            return said
        touched = any(one.contact_time > 0 for one in result.stats.pairs.values())
        if self.normal_force and scene.pairs and not touched:
            said.append(
                f"nothing was touched, though the controller presses with {self.normal_force:g} N: "
                "is the start near the shell, and on the side that the contact allows?"
            )
        nearest, reach = self._nearest_to_target(scene, result), model_reach(scene.model)
        if nearest > OUT_OF_REACH * reach:
            said.append(
                f"the controller's target was never in reach: frame '{self.frame}' came no nearer "
                f"than {nearest:.3g} m: move the path or the start, or raise the stiffness"
            )
        return said

    def _nearest_to_target(self, scene: Scene, result: Result) -> float:
        """Return the smallest distance [m] of the moved point from the target over the rows."""
        (curve, timing), nearest = self._motion(), np.inf
        some = slice(None, None, -(-len(result.t) // _MOST_ROWS))
        places = timing.at(result.t[some])
        targets = zip(places, curve.at(places), strict=True)
        for (place, target), q in zip(targets, result.q[some], strict=True):
            away = self._off_target(scene, curve, target, place, q)
            nearest = min(nearest, float(np.linalg.norm(away)))
        return nearest

    def _off_target(
        self, scene: Scene, curve: Curve, target: Array, place: float, q: Array
    ) -> Array:
        """Return the moved point from a `target` at `place` [m] of the curve (3,) [m].

        A controller that presses leaves out what is along the surface's normal.
        """
        model, data = scene.model, scene.model.createData()
        name, placement = self._shell_place(scene)
        pin.framesForwardKinematics(model, data, q)
        at = (data.oMf[find_frame(model, name)] * placement).actInv(
            data.oMf[find_frame(model, self.frame)].act(np.array(self.offset, dtype=float))
        )
        away: Array = at - target
        if self.normal_force:
            k = min(int(np.searchsorted(curve.along, place)), len(curve.normals) - 1)
            away = away - curve.normals[k] * (curve.normals[k] @ away)
        return away

    def duration(self) -> float:
        """Return the time [s] at which the target reaches the last point."""
        return float(self._motion()[1].times[-1])


def _text(point: Array) -> str:
    return "({:.3g}, {:.3g}, {:.3g})".format(*point)
