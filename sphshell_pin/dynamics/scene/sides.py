"""What each of two bodies that may touch brings: a sphere, a shell, a plane or a contact source."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from sphshell_pin.contact import Method, Plane, Sphere
from sphshell_pin.dynamics.scene.sources import Find
from sphshell_pin.shell import Shell


@dataclass(frozen=True)
class Side:
    """A body by its `frame`, at `pose` in `joint`: all that a contact source needs of a body."""

    frame: str
    joint: int
    pose: pin.SE3

    @property
    def in_joint(self) -> pin.SE3:
        """The placement of the geometry in the joint: of a sphere, its center."""
        return self.pose

    @property
    def text(self) -> str:
        """The side in a few words."""
        return f"'{self.frame}'"

    @property
    def sentence(self) -> str:
        """The side as the words of a sentence on what is modeled."""
        return f"frame '{self.frame}'"


@dataclass(frozen=True)
class SphereSide(Side):
    """A sphere on a body."""

    sphere: Sphere

    @property
    def radius(self) -> float:
        """The radius of the sphere [m]."""
        return self.sphere.radius

    @cached_property
    def in_joint(self) -> pin.SE3:
        """The center of the sphere in the joint."""
        return self.pose * pin.SE3(np.eye(3), np.array(self.sphere.offset))

    @property
    def text(self) -> str:
        """Radius and frame."""
        return f"radius {self.radius * 1e3:g} mm at '{self.frame}'"

    @property
    def sentence(self) -> str:
        """The sphere and its frame."""
        return f"sphere of radius {self.radius * 1e3:.4g} mm on frame '{self.frame}'"


@dataclass(frozen=True)
class ShellSide(Side):
    """A shell at `placement` in the frame of a body, whose contacts `method` finds.

    Raises NameNotFound for an unknown method.
    """

    shell: Shell
    placement: pin.SE3
    method: str

    def __post_init__(self) -> None:
        """Check the method."""
        Method.from_name(self.method)

    @cached_property
    def in_joint(self) -> pin.SE3:
        """The shell in the joint."""
        return self.pose * self.placement

    @property
    def is_smooth(self) -> bool:
        """Whether contact uses the curved elements."""
        return self.method == "smooth"

    @property
    def key(self) -> tuple[int, int, bytes]:
        """A key: sides with equal keys have the same shell at the same place."""
        place = self.in_joint.homogeneous + 0.0  # no -0.0
        return id(self.shell), self.joint, place.tobytes()

    @property
    def text(self) -> str:
        """Shell, frame and method."""
        return f"'{self.shell.name}' at '{self.frame}', {self.method}"

    @property
    def sentence(self) -> str:
        """The shell and its frame."""
        return f"shell '{self.shell.name}' on frame '{self.frame}'"


@dataclass(frozen=True)
class PlaneSide(Side):
    """A plane on a body."""

    plane: Plane

    @cached_property
    def in_joint(self) -> pin.SE3:
        """The plane in the joint."""
        return self.pose * self.plane.placement

    @property
    def text(self) -> str:
        """The frame of the plane."""
        return f"plane at '{self.frame}'"

    @property
    def sentence(self) -> str:
        """The plane and its frame."""
        return f"plane on frame '{self.frame}'"


@dataclass(frozen=True)
class SourceSide(Side):
    """The first body of a contact source, with the routine that says where it touches the other."""

    find: Find

    @property
    def text(self) -> str:
        """The frame of the source."""
        return f"contact source at '{self.frame}'"
