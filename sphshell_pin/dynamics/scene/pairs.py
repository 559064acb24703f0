"""Two bodies that may touch, as constant descriptions."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.contact import (
    FoundationLaw,
    Friction,
    FunctionFriction,
    Method,
    MindlinFriction,
    NormalLaw,
    Plane,
    Sphere,
)
from sphshell_pin.contact.friction import check_friction
from sphshell_pin.contact.normal_law import check_law
from sphshell_pin.dynamics.scene.sources import Find, checked_source
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell import Shell


class PlacedSphere(NamedTuple):
    """A sphere of `radius` [m] whose center is the origin of `placement` in a joint."""

    joint: int
    placement: pin.SE3
    radius: float


@dataclass(frozen=True, repr=False)
class ContactPair(Summarized):
    """One pair of bodies that may touch; body i carries the sphere, body j the shell.

    `frame_i`, `frame_j` name their frames, `joint_i`, `joint_j` the joints, `pose_i`, `pose_j` the
    frames' placements in the joints. The shell is at `placement` in frame_j; a pair of two spheres
    has `other_sphere`, on body j, instead of it, a pair of a plane and a shell has `plane`, on body
    i, instead of `sphere`, and a pair of a contact source has `find` instead of `sphere` and
    `shell`. `group` names the entry of which there are several pairs.
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
    other_sphere: Sphere | None = None
    group: str = ""
    plane: Plane | None = None

    def __post_init__(self) -> None:
        """Check law, friction and method, and what needs a sphere or a shell where there is none.

        Raises InvalidParameter, NameNotFound for a method.
        """
        check_law(self.law, "" if self.find is None else "at the points of a contact source")
        check_friction(self.friction)
        Method.from_name(self.method)
        if self.plane is not None:
            self._check_plane()
        if isinstance(self.friction, FunctionFriction) and isinstance(self.law, FoundationLaw):
            must = "is for contacts at a point: beside a FoundationLaw take a CoulombFriction"
            raise InvalidParameter("friction", self.friction.kind, must)
        if self.find is not None and isinstance(self.friction, MindlinFriction):
            must = "needs a sphere, and a contact source has none: take a BristleFriction"
            raise InvalidParameter("friction", self.friction.kind, must)

    @property
    def _title(self) -> str:
        return f"ContactPair '{self.name}'"

    def _facts(self) -> list[Fact]:
        labels = ("sphere", "with", "normal law", "friction")
        return [
            Fact(label, text, brief=label in labels[:2])
            for label, text in zip(labels, self.shown[1:], strict=True)
        ]

    @cached_property
    def plane_law(self) -> NormalLaw:
        """The law, and of one that follows the curvature of the shell that of a plane shell.

        Of a foundation beside a Plane it is that of a face as large as the shell's box: stiffest.
        """
        if not self.law.needs_shape:
            return self.law
        if self.plane and self.shell and isinstance(self.law, FoundationLaw):
            sides = np.sort(np.ptp(self.shell.vertices, axis=0))
            return self.law.on_face(float(sides[1] * sides[2]))
        return self.law.on_plane(1 / sum(1 / one.radius for one in self.spheres))

    @property
    def kind(self) -> str:
        """Return "sphere-shell", "sphere-sphere", "plane-shell" or "source"."""
        if self.find is not None:
            return "source"
        if self.plane is not None:
            return "plane-shell"
        return "sphere-shell" if self.other_sphere is None else "sphere-sphere"

    @cached_property
    def spheres(self) -> tuple[PlacedSphere, ...]:
        """The spheres of this pair: one, two, or none of a source."""
        out = []
        if self.sphere is not None:
            out.append(PlacedSphere(self.joint_i, self.placement_i, self.sphere.radius))
        if self.other_sphere is not None:
            out.append(PlacedSphere(self.joint_j, self.placement_j, self.other_sphere.radius))
        return tuple(out)

    @cached_property
    def least_radius(self) -> float:
        """The radius of the smallest of `spheres` [m], nan without any."""
        return min((one.radius for one in self.spheres), default=math.nan)

    @cached_property
    def placement_i(self) -> pin.SE3:
        """The sphere's center, or the plane, in joint_i; of a source, frame_i."""
        if self.plane is not None:
            return self.pose_i * self.plane.placement
        return self.pose_i if self.sphere is None else _center(self.pose_i, self.sphere)

    @cached_property
    def placement_j(self) -> pin.SE3:
        """The shell, or the other sphere's center, in joint_j; of a source, frame_j."""
        if self.other_sphere is not None:
            return _center(self.pose_j, self.other_sphere)
        return self.pose_j * self.placement

    def _check_plane(self) -> None:
        """Refuse what follows from the radius of a sphere, and flat elements."""
        why = "beside a Plane: it follows from the radius of a Sphere"
        if self.law.needs_shape and not isinstance(self.law, FoundationLaw):
            must = "take law.on_plane(radius), or a FoundationLaw, which needs no radius"
            raise InvalidParameter("law", self.law, f"must be one of the depth alone {why}; {must}")
        friction = self.friction
        if friction is not None and (
            isinstance(friction, MindlinFriction) or friction._binding.torsional
        ):
            raise InvalidParameter("friction", friction, f"must have no disc of contact {why}")
        if self.method != "smooth":
            must = "must be 'smooth' beside a Plane; flat elements: a Shell with crease_angle 0"
            raise InvalidParameter("method", self.method, must)

    @property
    def core_sides(self) -> tuple[str, str]:
        """Which of "frame_i", "frame_j" names the frame of the core's body i, and j.

        Against a plane the core's body i is the one with the shell: in the frame of the plane, its
        body j, the normal is constant.
        """
        return ("frame_i", "frame_j") if self.plane is None else ("frame_j", "frame_i")

    @property
    def shown(self) -> tuple[str, str, str, str, str]:
        """Name, sphere, what it touches, law and friction, each in a few words."""
        spheres = [
            f"radius {one.radius * 1e3:g} mm at '{one.frame}'"
            for one in (self.sphere, self.other_sphere)
            if one is not None
        ]
        if self.plane is not None:
            first = f"plane at '{self.frame_i}'"
        else:
            first = spheres[0] if self.sphere is not None else f"contact source at '{self.frame_i}'"
        if self.shell is not None:
            other = f"'{self.shell.name}' at '{self.frame_j}', {self.method}"
        else:
            other = spheres[1] if len(spheres) > 1 else f"'{self.frame_j}'"
        return (
            self.name,
            first,
            other,
            self.law.text,
            ("none" if self.friction is None else self.friction.text),
        )

    @cached_property
    def modelled(self) -> tuple[str, ...]:
        """What is modeled of this pair, in sentences."""
        shell, frame_i, frame_j = self.shell, self.frame_i, self.frame_j
        bodies = [
            f"sphere of radius {one.radius * 1e3:.4g} mm on frame '{one.frame}'"
            for one in (self.sphere, self.other_sphere)
            if one is not None
        ]
        lines = []
        if shell is not None:
            bodies = bodies or [f"plane on frame '{frame_i}'"]
            bodies.append(f"shell '{shell.name}' on frame '{frame_j}'")
            moving = (
                "moves with its frame" if self.joint_j else "does not move: no wrench on its side"
            )
            lines.append(
                f"{len(shell.elements)} elements, box diagonal {shell.size * 1e3:.4g} mm, "
                f"side '{shell.side}', method '{self.method}'; the shell {moving}"
            )
        own = f"contact points of the user's own routine between frames '{frame_i}' and '{frame_j}'"
        friction = "no friction: no tangential force is computed"
        if self.friction is not None:
            friction = f"friction: {self.friction.text}"
        first = " against ".join(bodies) or own
        return first, *lines, f"normal force: {self.law.text}", friction

    def _bind(self) -> _core.Pair:
        """Build the C++ binding of this pair."""
        source = None
        if self.find is not None:
            has_state = self.friction is not None and self.friction.has_state
            source = checked_source(self.find, self.name, has_state)
        ends = [(self.joint_i, self.placement_i), (self.joint_j, self.placement_j)]
        if self.plane is not None:
            ends.reverse()  # see core_sides
        core = _core.Pair(
            name=self.name,
            joint_i=ends[0][0],
            placement_i=ends[0][1].homogeneous,
            joint_j=ends[1][0],
            placement_j=ends[1][1].homogeneous,
            radius=0.0 if self.sphere is None else self.sphere.radius,
            ball=0.0 if self.other_sphere is None else self.other_sphere.radius,
            shell=None if self.shell is None else self.shell.core_for(self.method),
            source=source,
            method=int(Method.from_name(self.method)),
            law=self.law._binding,
            friction=None if self.friction is None else self.friction._binding,
            plane=self.plane is not None,
        )
        core.group = self.group
        return core


def shell_key(pair: ContactPair) -> tuple[int, int, bytes]:
    """Return a key: pairs with equal keys have the same shell at the same place."""
    place = pair.placement_j.homogeneous + 0.0  # no -0.0
    return id(pair.shell), pair.joint_j, place.tobytes()


def _center(frame: pin.SE3, sphere: Sphere) -> pin.SE3:
    return frame * pin.SE3(np.eye(3), np.array(sphere.offset))
