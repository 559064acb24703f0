"""Inverse kinematics of a point on a frame, by damped least squares within the joints' limits."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.models import find_frame

# Steps of a solution, the largest turn of a joint in one of them [rad], its least damping, and the
# residual at which it is found.
_STEPS, _LARGEST, _DAMPING, _FOUND = 80, 0.25, 1e-5, 1e-7
# Distance of a joint from a limit that it has passed, as a part of its range.
_MARGIN = 0.02


def turn_between(axis: Array, along: Array) -> Array:
    """Return the shortest rotation vector (3,) that turns the unit vector `axis` to `along`."""
    turn: Array = pin.skew(axis) @ along
    sine = math.sqrt(turn @ turn)
    if sine < 1e-9 and axis @ along < 0:
        turn, sine = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))]), 0.0
        turn = turn / np.linalg.norm(turn)
        return np.pi * turn
    return turn * (math.atan2(sine, axis @ along) / max(sine, 1e-12))


class Reach:
    """Where a point of a frame is, and the joints that bring it somewhere.

    `offset` (3,) [m] are its coordinates in the frame; joints of `lock` stay as they are.
    """

    def __init__(
        self, model: pin.Model, frame: str, offset: npt.ArrayLike, lock: Sequence[str] = ()
    ) -> None:
        self.model, self.data = model, model.createData()
        self.frame, self.offset = find_frame(model, frame), np.asarray(offset, dtype=float)
        moving = [model.joints[j] for j in range(1, model.njoints) if model.names[j] not in lock]
        self.columns = np.array(
            [k for one in moving for k in range(one.idx_v, one.idx_v + one.nv)], dtype=int
        )
        hinges = np.array([one.idx_q for one in moving if one.nq == 1], dtype=int)
        low, high = model.lowerPositionLimit[hinges], model.upperPositionLimit[hinges]
        bounded = np.isfinite(low) & np.isfinite(high) & (low < high)
        self.hinges, self.bounded = hinges, hinges[bounded]
        self.low, self.high = low[bounded], high[bounded]
        # The point's velocity by the joints that move (3, k), where jacobian() was asked for last.
        self.moves = np.zeros((3, len(self.columns)))

    def center(self, q: Array) -> Array:
        """Return where the point is (3,) [m]; the places of frame and joints are in `data` then."""
        pin.forwardKinematics(self.model, self.data, q)
        pin.updateFramePlacement(self.model, self.data, self.frame)
        return np.asarray(self.data.oMf[self.frame].act(self.offset))

    def jacobian(self, q: Array) -> Array:
        """Return the point's velocity and the frame's rotation, (6, k), by the joints that move."""
        local = pin.computeFrameJacobian(
            self.model, self.data, q, self.frame, pin.LOCAL_WORLD_ALIGNED
        )
        # Pinocchio returns (6,) for one velocity.
        found: Array = np.reshape(local, (6, self.model.nv))[:, self.columns].copy()
        arm = self.center(q) - self.data.oMf[self.frame].translation
        found[:3] -= pin.skew(arm) @ found[3:]
        self.moves = found[:3]
        return found

    def into_limits(self, q: Array) -> Array:
        """Return q (nq,) with each joint that is outside its limits a little inside them."""
        inside = np.array(q, dtype=float)
        at, room = inside[self.bounded], _MARGIN * (self.high - self.low)
        clipped = np.clip(at, self.low + room, self.high - room)
        inside[self.bounded] = np.where((at < self.low) | (at > self.high), clipped, at)
        return inside

    def seed(self, q: Array, rng: np.random.Generator) -> Array:
        """Return q (nq,) with joints anywhere within their limits, else within a turn."""
        seed = np.array(q, dtype=float)
        seed[self.hinges] += rng.uniform(-1.0, 1.0, len(self.hinges))
        low, high = np.maximum(self.low, -np.pi), np.minimum(self.high, np.pi)
        seed[self.bounded] = rng.uniform(low, np.maximum(high, low))
        return self.into_limits(seed)

    def turn_of_axis(self, along: Array) -> Array:
        """Return the rotation vector (3,) from the frame's z axis in `data` to `along` (3,)."""
        return turn_between(self.data.oMf[self.frame].rotation[:, 2], along)

    def solve(
        self,
        q: Array,
        place: Array,
        *,
        rows: Array | None = None,
        turn: Callable[[], Array] | None = None,
    ) -> tuple[Array, float]:
        """Return joints near q (nq,) that bring the point to `place` (3,), and how far off it is.

        `rows` (k, 3) are the directions in which it shall be there, by default all. `turn()` is the
        rotation vector (3,) by which the frame shall turn, from what is in `data`. A place out of
        reach is approached as far as the joints go. Damping follows the residual (Sugihara, IEEE
        Transactions on Robotics 27, 2011).
        """
        rows = np.eye(3) if rows is None else rows
        jacobian = self.jacobian(q)
        scale = 1.0 / max(float(np.linalg.norm(jacobian[:3])), 1e-6)
        best, best_off, least = q, np.inf, np.inf
        for _ in range(_STEPS):
            away = rows @ (place - self.data.oMf[self.frame].act(self.offset))
            error, slopes = scale * away, scale * rows @ jacobian[:3]
            if turn is not None:
                error = np.concatenate([error, turn()])
                slopes = np.concatenate([slopes, jacobian[3:]])
            residual = float(error @ error)
            if residual < least:
                best, best_off, least = q, float(np.linalg.norm(away)), residual
            if residual < _FOUND**2:
                break
            square = slopes.T @ slopes + (min(residual, 1.0) + _DAMPING) * 1e-1 * np.eye(
                len(self.columns)
            )
            step = np.linalg.solve(square, slopes.T @ error)
            step *= min(1.0, _LARGEST / max(float(np.abs(step).max(initial=0.0)), 1e-12))
            change = np.zeros(self.model.nv)
            change[self.columns] = step
            q = self.into_limits(pin.integrate(self.model, q, change))
            jacobian = self.jacobian(q)
        return best, best_off
