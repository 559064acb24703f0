"""Two bodies that may touch, as constant descriptions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.contact import Friction, Method, NormalLaw, Sphere
from sphshell_pin.deprecation import renamed
from sphshell_pin.dynamics.sources import Find, checked_source
from sphshell_pin.shell import Shell


@dataclass(frozen=True)
class ContactPair:
    """One pair of bodies that may touch; body i carries the sphere, body j the shell.

    `frame_i`, `frame_j` name their frames, `joint_i`, `joint_j` the joints, `pose_i`, `pose_j` the
    frames' placements in the joints. The shell is at `placement` in frame_j. A pair of a contact
    source has `find` instead of `sphere` and `shell`.
    """

    name: str
    frame_i: str
    frame_j: str
    joint_i: int
    joint_j: int
    pose_i: pin.SE3
    pose_j: pin.SE3
    placement: pin.SE3
    law: NormalLaw
    friction: Friction | None
    method: str = "facets"
    sphere: Sphere | None = None
    shell: Shell | None = None
    find: Find | None = None

    frame = renamed("frame", "frame_j")
    sphere_placement = renamed("sphere_placement", "placement_i")
    shell_placement = renamed("shell_placement", "placement_j")

    @property
    def kind(self) -> str:
        """Return "sphere-shell" or "source"."""
        return "sphere-shell" if self.find is None else "source"

    @cached_property
    def placement_i(self) -> pin.SE3:
        """The sphere's center in joint_i; of a source, frame_i."""
        if self.sphere is None:
            return self.pose_i
        return self.pose_i * pin.SE3(np.eye(3), np.array(self.sphere.offset))

    @cached_property
    def placement_j(self) -> pin.SE3:
        """The shell in joint_j; of a source, frame_j."""
        return self.pose_j * self.placement

    def to_core(self) -> _core.Pair:
        """Build the C++ binding of this pair."""
        source = None
        if self.find is not None:
            has_state = self.friction is not None and self.friction.has_state
            source = checked_source(self.find, self.name, has_state)
        return _core.Pair(
            name=self.name,
            joint_i=self.joint_i,
            placement_i=self.placement_i.homogeneous,
            joint_j=self.joint_j,
            placement_j=self.placement_j.homogeneous,
            radius=0.0 if self.sphere is None else self.sphere.radius,
            shell=None if self.shell is None else self.shell.core_for(self.method),
            source=source,
            method=int(Method.from_name(self.method)),
            law=self.law.core,
            friction=None if self.friction is None else self.friction.core,
        )
