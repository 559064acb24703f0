"""Two bodies that may touch, as constant descriptions."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from sphshell_pin import _core, contact
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.contact.friction import check_friction
from sphshell_pin.contact.normal_law import check_law
from sphshell_pin.dynamics.scene import sides as ends
from sphshell_pin.errors import InvalidParameter


@dataclass(frozen=True, repr=False)
class ContactPair(Summarized):
    """Two bodies that may touch: `side_i` and `side_j`, with their law and friction.

    Side i is a SphereSide beside a ShellSide or another SphereSide, a PlaneSide beside a ShellSide,
    or the SourceSide of a contact source. `group` names the entry of which there are several pairs.
    """

    name: str
    side_i: ends.Side
    side_j: ends.Side
    law: contact.NormalLaw
    friction: contact.Friction | None
    group: str = ""

    def __post_init__(self) -> None:
        """Check law and friction, and what needs a sphere where there is none.

        Raises InvalidParameter.
        """
        is_source = isinstance(self.side_i, ends.SourceSide)
        check_law(self.law, "at the points of a contact source" if is_source else "")
        check_friction(self.friction)
        if isinstance(self.side_i, ends.PlaneSide):
            self._check_plane()
        if isinstance(self.friction, contact.FunctionFriction) and isinstance(
            self.law, contact.FoundationLaw
        ):
            must = "is for contacts at a point: beside a FoundationLaw take a CoulombFriction"
            raise InvalidParameter("friction", self.friction.kind, must)
        if is_source and isinstance(self.friction, contact.MindlinFriction):
            must = "needs a sphere, and a contact source has none: take a BristleFriction"
            raise InvalidParameter("friction", self.friction.kind, must)

    @property
    def _title(self) -> str:
        return f"ContactPair '{self.name}'"

    def _facts(self) -> list[Fact]:
        return [Fact("between", self.side_i.text), Fact("and", self.side_j.text)]

    @property
    def frame_i(self) -> str:
        """The frame of body i."""
        return self.side_i.frame

    @property
    def frame_j(self) -> str:
        """The frame of body j."""
        return self.side_j.frame

    @property
    def joint_i(self) -> int:
        """The joint that carries body i."""
        return self.side_i.joint

    @property
    def joint_j(self) -> int:
        """The joint that carries body j."""
        return self.side_j.joint

    @property
    def placement_i(self) -> pin.SE3:
        """The sphere's center, or the plane, in joint_i; of a source, frame_i."""
        return self.side_i.in_joint

    @property
    def placement_j(self) -> pin.SE3:
        """The shell, or the other sphere's center, in joint_j; of a source, frame_j."""
        return self.side_j.in_joint

    @cached_property
    def spheres(self) -> tuple[ends.SphereSide, ...]:
        """The spheres of this pair: one, two, or none."""
        return tuple(one for one in (self.side_i, self.side_j) if isinstance(one, ends.SphereSide))

    @cached_property
    def shells(self) -> tuple[ends.ShellSide, ...]:
        """The shells of this pair: one or none."""
        return (self.side_j,) if isinstance(self.side_j, ends.ShellSide) else ()

    @property
    def sphere_on_shell(self) -> tuple[tuple[ends.SphereSide, ends.ShellSide], ...]:
        """Both sides of a pair of a sphere and a shell; nothing of another."""
        return tuple(zip(self.spheres, self.shells, strict=False))

    @property
    def parts(self) -> dict[str, tuple[str, ...]]:
        """The fields that lead to what can be changed, by the names of files and derivatives."""
        found: dict[str, tuple[str, ...]] = {"law": ("law",), "friction": ("friction",)}
        for name, end in (("sphere", "side_i"), ("other_sphere", "side_j")):
            if isinstance(getattr(self, end), ends.SphereSide):
                found[name] = end, "sphere"
        if self.shells:
            found["placement"] = "side_j", "placement"
        return found

    @cached_property
    def plane_law(self) -> contact.NormalLaw:
        """The law, and of one that follows the curvature of the shell that of a plane shell.

        Of a foundation beside a Plane it is that of a face as large as the shell's box: stiffest.
        """
        if not self.law.needs_shape:
            return self.law
        if isinstance(self.side_i, ends.PlaneSide) and isinstance(self.law, contact.FoundationLaw):
            (on_shell,) = self.shells
            sides = np.sort(np.ptp(on_shell.shell.vertices, axis=0))
            return self.law.on_face(float(sides[1] * sides[2]))
        return self.law.on_plane(1 / sum(1 / one.radius for one in self.spheres))

    @cached_property
    def least_radius(self) -> float:
        """The radius of the smallest of `spheres` [m], nan without any."""
        return min((one.radius for one in self.spheres), default=math.nan)

    def _check_plane(self) -> None:
        """Refuse what follows from the radius of a sphere, and flat elements.

        A bristle under what can lie flat resists spin: else a part would spin on its face without
        end.
        """
        why = "beside a Plane: it follows from the radius of a Sphere"
        if self.law.needs_shape and not isinstance(self.law, contact.FoundationLaw):
            must = "take law.on_plane(radius), or a FoundationLaw, which needs no radius"
            raise InvalidParameter("law", self.law, f"must be one of the depth alone {why}; {must}")
        friction = self.friction
        lies = isinstance(self.law, contact.FoundationLaw) or any(
            one.shell.core_for(one.method).has_flats for one in self.shells if one.is_smooth
        )
        if isinstance(friction, contact.BristleFriction) and lies:
            object.__setattr__(self, "friction", replace(friction, torsional=True))
        elif friction is not None and (
            isinstance(friction, contact.MindlinFriction) or friction._binding.torsional
        ):
            raise InvalidParameter("friction", friction, f"must have no disc of contact {why}")
        for one in self.shells:
            if not one.is_smooth:
                must = "must be 'smooth' beside a Plane; flat elements: a Shell with crease_angle 0"
                raise InvalidParameter("method", one.method, must)

    @property
    def core_sides(self) -> tuple[ends.Side, ends.Side]:
        """The core's body i, and j.

        Against a plane the core's body i is the one with the shell: in the frame of the plane, its
        body j, the normal is constant.
        """
        if isinstance(self.side_i, ends.PlaneSide):
            return self.side_j, self.side_i
        return self.side_i, self.side_j

    @cached_property
    def modelled(self) -> tuple[str, ...]:
        """What is modeled of this pair, in sentences."""
        first, second = self.side_i.text, self.side_j.text
        bodies = f"{first} against {second}"
        if isinstance(self.side_i, ends.SourceSide):
            bodies = (
                "contact points of the user's own routine between frames "
                f"'{self.frame_i}' and '{self.frame_j}'"
            )
        moving = "moves with its frame" if self.joint_j else "does not move: no wrench on its side"
        lines = [
            f"{len(one.shell.elements)} elements, box diagonal {one.shell.size * 1e3:.4g} mm, "
            f"side '{one.shell.side}', method '{one.method}'; the shell {moving}"
            for one in self.shells
        ]
        friction = "no friction: no tangential force is computed"
        if self.friction is not None:
            friction = f"friction: {self.friction.text}"
        return bodies, *lines, f"normal force: {self.law.text}", friction

    def _bind(self) -> _core.Pair:
        """Build the C++ binding of this pair."""
        source = None
        if isinstance(self.side_i, ends.SourceSide):
            has_state = self.friction is not None and self.friction.has_state
            source = ends.checked_source(self.side_i.find, self.name, has_state)
        method = self.shells[0].method if self.shells else "facets"
        side_i, side_j = self.core_sides
        core = _core.Pair(
            name=self.name,
            joint_i=side_i.joint,
            placement_i=side_i.in_joint.homogeneous,
            joint_j=side_j.joint,
            placement_j=side_j.in_joint.homogeneous,
            radius=self.spheres[0].radius if self.spheres else 0.0,
            ball=self.spheres[1].radius if len(self.spheres) > 1 else 0.0,
            shell=self.shells[0].shell.core_for(method) if self.shells else None,
            source=source,
            method=int(contact.Method.from_name(method)),
            law=self.law._binding,
            friction=None if self.friction is None else self.friction._binding,
            plane=isinstance(self.side_i, ends.PlaneSide),
        )
        core.group = self.group
        return core
