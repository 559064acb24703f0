"""The shell: a surface of three- and four-sided elements that spheres can touch."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sphshell_pin import _core
from sphshell_pin.checks import (
    check_each_positive,
    check_flag,
    check_points,
    check_positive,
    check_type,
    check_vector,
    read_only,
)
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell.closest_points import ClosestPoints
from sphshell_pin.shell.options import (
    CREASE_ANGLE,
    SIDES,
    check_options,
    check_size,
    thread_count,
)
from sphshell_pin.shell.topology import Topology

# Readers, writers, cleaning and tessellation load with the first shell that needs them: importing
# the package should cost little more than importing Pinocchio.
if TYPE_CHECKING:
    from sphshell_pin.contact.contact_set import ContactSet
    from sphshell_pin.shell.cleaning import CleanedSurface
    from sphshell_pin.shell.curvature import CurvatureReport
    from sphshell_pin.shell.health import ShellHealth
    from sphshell_pin.shell.raw import Floats, Ints, Mask


class Shell(Topology):
    """A surface of three- and four-sided elements, open or closed, in its own frame [m].

    The surface is cleaned when it is made; `health` says what was found and repaired. All arrays
    are read-only.

    Parameters
    ----------
    vertices : (n, 3) [m]
    elements : (m, 3) or (m, 4) vertex indices, triangles among four columns ending in -1; or a list
        of lists for polygons of any size
    normals : unit normals per vertex (n, 3) or per element corner (m, 3 or 4, 3), or None
    crease_angle : edges that turn by less are smooth [rad], and smooth edges join elements to a
        patch; 0 leaves smooth only the edges within a plane and every element flat. It matters to
        the method "smooth"; "facets" and "elements" are flat and exact at any angle
    side : where spheres may be: "both", "outside" (where the winding's normals point), "inside"
    name : how messages call it
    clean : False takes the elements as they are: no welding, no repair, no reorientation

    Attributes
    ----------
    vertices : (n, 3) [m]; elements : (m, 4), triangles ending in -1
    triangles : (t, 3); triangle_element : (t,) element of each
    normals : (t, 3, 3) per triangle corner, or None
    source_element : (m,) index of the input element each came from
    element_face : (m,) row in `face_names` of the CAD face each element lies on, or None; within
        a face and across tangent joints edges are smooth, whatever the crease angle, unless that is
        0
    face_names : of the CAD faces
    straight : (t, 3) sides kept straight whatever the normals say, as curved ones would leave the
        exact CAD faces; or None
    box : (2, 3) lowest and highest corner [m]; size : its diagonal [m]
    health : ShellHealth; source : path of the file, or None; unit : its unit, or None
    core : the compiled surface that queries run on

    Raises
    ------
    InvalidShell
        If no surface can be made of the arrays; the message names the element or vertex.
    InvalidParameter
        If side or crease_angle is out of range.
    """

    vertices: Floats
    elements: Ints
    triangles: Ints
    triangle_element: Ints
    normals: Floats | None
    source_element: Ints
    element_face: Ints | None
    face_names: tuple[str, ...]
    straight: Mask | None
    box: Floats

    def __init__(
        self,
        vertices: npt.ArrayLike,
        elements: Any,
        normals: npt.ArrayLike | None = None,
        crease_angle: float = CREASE_ANGLE,
        side: str = "both",
        *,
        name: str = "shell",
        clean: bool = True,
    ) -> None:
        from sphshell_pin.shell.cleaning import clean_surface, take_surface
        from sphshell_pin.shell.raw import raw_surface

        check_options(crease_angle, side)
        made = clean_surface if check_flag("clean", clean) else take_surface
        surface = made(raw_surface(vertices, elements, normals))
        self._set(surface, crease_angle, side, name, None, None)

    @classmethod
    def from_file(
        cls,
        path: str | os.PathLike[str],
        unit: str | None = None,
        scale: str | float | None = None,
        *,
        chord_error: float | None = None,
        bodies: Sequence[str] | None = None,
        faces: Sequence[str | int] | None = None,
        sew: float | None = None,
        time_limit: float | None = None,
        memory_limit: float | None = None,
        side: str = "both",
        crease_angle: float = CREASE_ANGLE,
        name: str | None = None,
    ) -> Shell:
        """Load a surface file: a mesh, ADAMS's .shl, or CAD.

        Meshes are .stl, .obj, .ply and .off; CAD files are .step, .stp, .iges, .igs, .brep and
        .brp, which need the extra `cad`. Their trimmed faces become triangles with exact normals.

        Parameters
        ----------
        path : the file; its suffix names the format
        unit : unit of length of its numbers ("m", "mm", "cm", "in", "ft", ...). It must be stated,
            except for .shl files, which carry metres per file unit (SCALE), and for STEP and IGES,
            which carry a unit: another one that is stated is taken instead, with a UnitWarning
        scale : of a .shl file: "apply" its SCALE (default where no unit is stated), "ignore" it
            (default otherwise), or a number to use instead; of other files a number by which the
            surface is made larger. `health` says which was used
        chord_error : of CAD: largest distance between the elements, flat or curved, and the exact
            surface [m], 1e-3 of the box diagonal unless given; `health` says what was measured
        bodies : of CAD: names of the bodies to take; all unless given
        faces : of CAD: names of the faces to take, or their numbers in the file (from 1); all
            unless given
        sew : of CAD: faces whose borders are nearer than this are joined [m], 0 joins none; unless
            given, within up to 1e-4 of the box diagonal, if that closes gaps
        time_limit, memory_limit : of CAD: after which OpenCASCADE is ended [s], 600 unless given;
            which it may take beyond what it takes by itself [bytes], 8e9 unless given. It runs in a
            process of its own
        side, crease_angle, name : as of Shell; the name is the file's unless given

        Raises
        ------
        ShellFileError
            If the file is missing, empty, truncated or damaged, or if OpenCASCADE crashes on it or
            goes beyond a limit.
        InvalidParameter
            If the unit is missing or unknown, or suffix, scale, side or crease_angle is, or an
            option is out of range or does not belong to the format.
        NameNotFound
            If no body or face has a name; the message lists the valid ones.
        InvalidShell
            If the file holds no element with an area.
        MissingExtra
            If the library that reads CAD files is not installed.
        """
        from sphshell_pin.shell.cad import CadOptions
        from sphshell_pin.shell.loading import load_surface

        check_options(crease_angle, side)
        options = CadOptions(chord_error, bodies, faces, sew, time_limit, memory_limit)
        surface, taken_unit, factor = load_surface(path, unit, scale, options, crease_angle)
        found = surface.health.labelled(source=str(path), unit=taken_unit, scale=factor)
        shell = cls.__new__(cls)
        called = Path(path).stem if name is None else name
        cleaned = replace(surface, health=found)
        shell._set(cleaned, crease_angle, side, called, str(path), taken_unit)
        return shell

    @classmethod
    def from_geometry(
        cls,
        geometry: Any,
        *,
        chord_error: float | None = None,
        segments: int | None = None,
        extent: float | None = None,
        side: str = "both",
        crease_angle: float = CREASE_ANGLE,
        name: str | None = None,
    ) -> Shell:
        """Turn a pinocchio.GeometryObject or a coal geometry into a shell, in its own frame.

        Meshes are taken as they are, in metres; Box, Sphere, Cylinder, Capsule, Cone, Ellipsoid and
        Convex become closed shells with exact normals; Halfspace and Plane a square sheet. The
        placement of a GeometryObject is not applied: it is where the shell is to be mounted.

        Parameters
        ----------
        geometry : the geometry
        chord_error : largest distance between the elements and a round solid [m], 1e-3 of its
            diameter unless given
        segments : elements round a full circle, instead of chord_error
        extent : side of the square that stands for a half-space [m], 10 m unless given
        side, crease_angle, name : as of Shell; the name is the object's unless given

        Raises
        ------
        InvalidParameter
            If the geometry is of another kind, or an option is out of range.
        """
        from sphshell_pin.shell.cleaning import clean_surface
        from sphshell_pin.shell.primitives import geometry_surface

        check_options(crease_angle, side)
        surface = clean_surface(geometry_surface(geometry, chord_error, segments, extent))
        shell = cls.__new__(cls)
        own = getattr(geometry, "name", None)
        called = name if name is not None else own if isinstance(own, str) else "shell"
        shell._set(surface, crease_angle, side, called or "shell", None, None)
        return shell

    def _set(
        self,
        surface: CleanedSurface,
        crease_angle: float,
        side: str,
        name: str,
        source: str | None,
        unit: str | None,
    ) -> None:
        self.name = str(name)
        self.side = side
        self.crease_angle = float(crease_angle)
        self.source = source
        self.unit = unit
        vertices = np.ascontiguousarray(surface.vertices, np.float64)
        triangles = np.ascontiguousarray(surface.triangles, np.int32)
        triangle_element = np.ascontiguousarray(surface.triangle_element, np.int32)
        self.elements = read_only(np.ascontiguousarray(surface.elements, np.int32))
        self.source_element = read_only(np.ascontiguousarray(surface.source_element, np.int32))
        self.normals = None
        if surface.normals is not None:
            self.normals = read_only(np.ascontiguousarray(surface.normals))
        self.element_face = None
        if surface.element_face is not None:
            self.element_face = read_only(np.ascontiguousarray(surface.element_face, np.int32))
        self.face_names = tuple(surface.face_names)
        self.straight = None if surface.straight is None else read_only(surface.straight.copy())
        # Without cleaning there may be vertices no element uses.
        in_use = np.zeros(len(vertices), np.bool_)
        in_use[triangles] = True
        corners = vertices if in_use.all() else vertices[in_use]
        self.box = read_only(np.stack([corners.min(axis=0), corners.max(axis=0)]))
        self.size = float(np.linalg.norm(self.box[1] - self.box[0]))
        check_size(self.size)
        self.health: ShellHealth = surface.health.labelled(name=self.name, size=self.size)
        self.core = _core.Shell(
            vertices,
            triangles,
            triangle_element,
            crease_angle,
            SIDES.index(side),
            *self._joints(triangle_element),
        )
        # The compiled surface has its own copies: these are views of them.
        self.vertices = self.core.vertices
        self.triangles = self.core.triangles
        self.triangle_element = self.core.triangle_element

    def _joints(self, triangle_element: Ints) -> tuple[Ints | None, Floats | None]:
        """CAD face of each triangle (t,) and corner normals (3 t, 3), which say what is smooth."""
        if self.element_face is None or self.normals is None or self.crease_angle == 0.0:
            return None, None
        return self.element_face[triangle_element], self.normals.reshape(-1, 3)

    def contacts(
        self,
        center: npt.ArrayLike,
        radius: float,
        method: str = "smooth",
        gradient: bool = False,
    ) -> ContactSet:
        """Find every place where a sphere touches, deepest first.

        Parameters
        ----------
        center : (3,) of the sphere, in the shell's frame [m]
        radius : of the sphere [m]
        method : "smooth" (elements curved to meet the vertex normals; a connected piece of surface
            inside the sphere counts once), "facets" (each true feature of the polyhedron once) or
            "elements" (every touched element by itself, as ADAMS's SPHSHL3 has it: counts shared
            edges twice)
        gradient : also find how the normals turn as the sphere moves, for
            `ContactSet.force_gradient`; not with "elements"

        Raises
        ------
        InvalidParameter, NameNotFound
            If center or radius is out of range, or the method unknown.
        """
        from sphshell_pin.contact.contact_set import ContactSet, Method

        centre = check_vector("center", center, 3, " [m]")
        radius = check_positive("radius", radius, "m")
        number = Method.from_name(method)
        gradient = check_flag("gradient", gradient)
        if gradient and number is Method.ELEMENTS:
            raise InvalidParameter("gradient", gradient, "is not known with method 'elements'")
        shown, terms = self.core_for(method).contacts(centre, radius, int(number), gradient)

        def contact_set(columns: Any, terms: ContactSet | None = None) -> ContactSet:
            point, normal, depth, element, feature, weight, turn = (read_only(c) for c in columns)
            return ContactSet(
                point=point,
                normal=normal,
                depth=depth,
                element=element,
                patch=read_only(self.element_patch[element]),
                feature=feature,
                weight=weight,
                turn=turn if gradient else None,
                summed=terms,
            )

        return contact_set(shown, None if terms is None else contact_set(terms))

    def contacts_batch(
        self,
        centers: npt.ArrayLike,
        radii: npt.ArrayLike | float,
        method: str = "smooth",
        threads: int | None = None,
    ) -> tuple[Floats, Ints]:
        """Find the contacts of many spheres at once.

        Parameters
        ----------
        centers : (n, 3) in the shell's frame [m]
        radii : (n,) or one number [m]
        method : as of `contacts`
        threads : how many to use; all processors unless given. The results do not depend on it

        Returns
        -------
        depth (n,) : the largest of each sphere [m], 0 if it does not touch
        count (n,) : how many contacts it has

        Raises
        ------
        InvalidParameter, NameNotFound
            If centers or radii are out of range, or the method unknown.
        """
        from sphshell_pin.contact.contact_set import Method

        places = check_points("centers", centers)
        sizes = check_each_positive("radii", radii, len(places), "m")
        workers, number = thread_count(threads), Method.from_name(method)
        depth, count = self.core_for(method).contacts_batch(places, sizes, int(number), workers)
        return depth, count

    def core_for(self, method: str) -> _core.Shell:
        """Return the compiled surface, with curved elements if `method` is "smooth"."""
        if method == "smooth":
            # With no smooth edges every element is flat, whatever normals came with it.
            given = self.normals if self.crease_angle > 0 else None
            exact = self.element_face is not None  # CAD's own
            straight = None if self.straight is None else self.straight.ravel().view(np.uint8)
            self.core.curve(None if given is None else given.reshape(-1, 3), exact, straight)
        core: _core.Shell = self.core
        return core

    def curvature_report(self) -> CurvatureReport:
        """Return how far the curved elements stand off the flat ones, and which stayed flat.

        It makes the curved elements, if no query has. `health` shows the report from then on.
        """
        from sphshell_pin.shell.curvature import curvature_report

        report = self.health.curvature
        if report is None:
            report = curvature_report(self)
            self.health = self.health.labelled(curvature=report)
        return report

    def closest_points(
        self, points: npt.ArrayLike, threads: int | None = 1, method: str = "smooth"
    ) -> ClosestPoints:
        """Project points (n, 3) [m] of the shell's frame on the surface.

        On that of the method "smooth", or else on the flat elements. Raises InvalidParameter if
        the points are out of range, NameNotFound if the method is unknown.
        """
        from sphshell_pin.contact.contact_set import Method

        smooth = Method.from_name(method) is Method.SMOOTH
        places = check_points("points", points)
        core = self.core_for(method)
        found = core.closest_points(places, smooth, thread_count(threads))
        return ClosestPoints(*(read_only(column) for column in found))

    def transformed(self, placement: Any = None, scale: float = 1.0) -> Shell:
        """Return the shell moved by a pinocchio.SE3 and made `scale` times larger first.

        A number in place of `placement` is the scale alone.

        Raises InvalidParameter unless the scale is positive and the placement an SE3.
        """
        if isinstance(placement, (int, float, np.number)):
            placement, scale = None, float(placement)
        from sphshell_pin.shell.cleaning import CleanedSurface

        scale = check_positive("scale", scale)
        rotation, translation = np.eye(3), np.zeros(3)
        if placement is not None:
            try:
                rotation = np.array(placement.rotation, np.float64)
                translation = np.array(placement.translation, np.float64)
            except AttributeError:
                raise InvalidParameter(
                    "placement", placement, "must be a pinocchio.SE3 or a scale"
                ) from None
        own = CleanedSurface(
            **{one.name: getattr(self, one.name) for one in fields(CleanedSurface)}
        )
        surface = own.moved(scale, rotation, translation)
        shell = type(self).__new__(type(self))
        shell._set(surface, self.crease_angle, self.side, self.name, self.source, self.unit)
        return shell

    def to_file(self, path: str | os.PathLike[str], unit: str = "m") -> None:
        """Write the shell in the format its suffix names: .shl, .stl, .obj, .ply, .off.

        The numbers are in `unit`; .shl files also carry it, as SCALE, and are of version 2 if the
        shell has normals. Quads stay quads, except in .stl. A file that was there before is
        replaced only when the new one is complete.

        Raises
        ------
        InvalidParameter
            If the suffix or the unit is unknown.
        ShellFileError
            If the file cannot be written.
        """
        from sphshell_pin.shell.writers import write_surface

        check_type("path", path, (str, os.PathLike), "must be a path")
        write_surface(path, self, unit)

    @property
    def is_closed(self) -> bool:
        """True if every component is closed."""
        return self.health.is_closed

    def __repr__(self) -> str:
        """Name, elements, size and state in one line."""
        state = "closed" if self.is_closed else "open"
        return (
            f"<Shell '{self.name}': {len(self.elements)} elements, {len(self.vertices)} vertices, "
            f"{state}, size {self.size:.4g} m, side {self.side}>"
        )

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the compiled surface, which is made again."""
        return {k: v for k, v in self.__dict__.items() if k not in ("core", "_arrays")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Rebuild from arrays that are clean already."""
        from sphshell_pin.shell.cleaning import CleanedSurface

        names = [field.name for field in fields(CleanedSurface)]
        surface = CleanedSurface(**{name: state[name] for name in names})
        rest = (state[name] for name in ("crease_angle", "side", "name", "source", "unit"))
        self._set(surface, *rest)
