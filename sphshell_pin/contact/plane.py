"""A plane on a link of the robot, or on the ground."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.checks import check_name, check_vector
from sphshell_pin.errors import InvalidParameter


@dataclass(frozen=True)
class Plane:
    """A plane with a solid below it, fixed to `frame`: through `offset` (3,) [m], in that frame.

    `normal` (3,), in the same frame, points out of the solid; it need not be of unit length. By
    default it is the frame's z axis, at its origin.
    """

    frame: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a normal without direction, or another type."""
        check_name("frame", self.frame)
        for name in ("offset", "normal"):
            x, y, z = check_vector(name, getattr(self, name), 3).tolist()
            object.__setattr__(self, name, (x, y, z))
        if not np.linalg.norm(self.normal) > 0:
            raise InvalidParameter("normal", self.normal, "must not be zero")

    @property
    def placement(self) -> pin.SE3:
        """The plane in its frame: its z axis is the normal, its origin the offset."""
        up = np.array(self.normal) / np.linalg.norm(self.normal)
        if up[2] == 1.0:
            return pin.SE3(np.eye(3), np.array(self.offset))
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), up)
        return pin.SE3(turn.toRotationMatrix(), np.array(self.offset))
