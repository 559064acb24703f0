"""The shell: a surface of three- and four-sided elements that spheres can touch."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sphshell_pin.base.checks import check_flag, check_positive, check_type
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.base.summary import Fact
from sphshell_pin.errors import InvalidParameter, InvalidShell, UnitMissing, UnitWarning
from sphshell_pin.shell.cad import CAD_SUFFIXES, CadOptions
from sphshell_pin.shell.cad.framing import check_frame
from sphshell_pin.shell.cad.kept_surface import KeptSurface, Read
from sphshell_pin.shell.cad.process import run_in_child, warn_caller
from sphshell_pin.shell.cleaning import box_diagonal, clean_surface, take_surface
from sphshell_pin.shell.options import CREASE_ANGLE, check_options
from sphshell_pin.shell.queries import Queries
from sphshell_pin.shell.raw import RawSurface, raw_surface
from sphshell_pin.shell.readers import READERS, read_shl, reader_for
from sphshell_pin.units import METERS_PER_UNIT, meters_per_unit

if TYPE_CHECKING:
    import pinocchio as pin

    from sphshell_pin.shell.health import CurvatureReport

Scale = str | float | None


def load_surface(
    path: StrPath, unit: str | None, scale: Scale, cad: CadOptions, crease_angle: float
) -> Read:
    """Read and clean a surface file.

    With a crease angle above 0 the sides that curvature would take off the faces of a CAD file are
    marked as straight.

    Returns the surface in meters, the unit taken, and meters per file unit.

    Raises as `Shell.from_file` does.
    """
    if unit is not None:
        meters_per_unit(unit)  # an unknown unit is reported before a long file is read
    number = _check_scale(scale)
    file, suffix = reader_for(path)
    if suffix not in CAD_SUFFIXES:
        cad.check_unused(suffix)
    elif not isinstance(scale, str):
        return _load_cad(file, unit, number, cad, crease_angle)
    raw, taken, factor = _load_raw(file, suffix, unit, scale, number)
    try:
        return clean_surface(raw), taken, factor
    except InvalidShell as error:
        raise InvalidShell(f"{path}: {error}") from error


def _load_cad(
    file: Path, unit: str | None, number: float, cad: CadOptions, crease_angle: float
) -> Read:
    check_frame(file)
    arguments = (file, unit, cad, number, crease_angle, _scaled(number))
    purpose = f"reading {file.suffix.lower()} files"
    kept = KeptSurface.of(file, cad, (unit, number, crease_angle))
    known = kept.load()
    if known is not None:
        for text in known[1]:
            warn_caller(UnitWarning(text))
        return known[0]
    heard: list[Warning] = []
    read: Read = run_in_child(arguments, file, purpose, cad, heard=heard)
    # Unless the file was saved anew meanwhile.
    if KeptSurface.of(file, cad, (unit, number, crease_angle)) == kept:
        kept.save(read, heard)
    return read


def _load_raw(
    file: Path, suffix: str, unit: str | None, scale: Scale, number: float
) -> tuple[RawSurface, str, float]:
    if suffix == ".shl":
        return _load_shl(file, unit, scale, number)
    if isinstance(scale, str):
        raise InvalidParameter("scale", scale, f"must be a number for {suffix} files (no SCALE)")
    raw = READERS[suffix](file)
    if unit is None:
        size = box_diagonal(raw.vertices[raw.corners.ravel()])
        raise UnitMissing(file, size, METERS_PER_UNIT)
    factor = meters_per_unit(unit) * number
    return raw.scaled(factor).noting(*_scaled(number)), unit, factor


def _scaled(number: float) -> tuple[str, ...]:
    return () if number == 1.0 else (f"scaled by {number:.6g} as asked",)


def _load_shl(
    file: Path, unit: str | None, scale: Scale, number: float
) -> tuple[RawSurface, str, float]:
    found = read_shl(file)
    written = found.scale
    if scale is None:
        scale = "apply" if unit is None else "ignore"
    length = meters_per_unit(unit) if unit is not None else 1.0
    taken = f"unit '{unit}'" if unit is not None else "meters"
    if scale == "apply":
        factor = length * written
        note = f"SCALE {written:.9g} of the file applied to its numbers, as {taken} per file unit"
        if unit is not None:
            note = f"SCALE {written:.9g} of the file applied to its numbers, then taken in {taken}"
    elif scale == "ignore":
        factor = length
        note = f"SCALE {written:.9g} of the file ignored, its numbers taken in {taken}"
    else:
        factor = length * number
        note = f"scale {number:.9g} used in place of SCALE {written:.9g}, result taken in {taken}"
    version = f".shl version {found.version}"
    return found.raw.scaled(factor).noting(version, note), unit or "m", factor


def _check_scale(scale: Scale) -> float:
    """Return the number a `scale` stands for, 1 for its words."""
    if scale is None or scale in ("apply", "ignore"):
        return 1.0
    try:
        number = math.nan if isinstance(scale, (str, bool)) else float(scale)
    except (TypeError, ValueError):
        number = math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise InvalidParameter("scale", scale, 'must be "apply", "ignore" or a positive number')
    return number


# Readers, writers, cleaning and tessellation load with the first shell that needs them: importing
# the package should cost little more than importing Pinocchio.


class Shell(Queries):
    """A surface of three- and four-sided elements, open or closed, in its own frame [m].

    The surface is cleaned when it is made; `health` lists what was found and repaired. All arrays
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
    faces : False recognizes no `faces`: all curved elements are then of normals, given or estimated

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
    rounding : half the step to which the coordinates are known [m], found by their digits, 0 if
        they show none; finds_faces : whether it recognizes `faces`
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

    def __init__(
        self,
        vertices: npt.ArrayLike,
        elements: object,
        normals: npt.ArrayLike | None = None,
        crease_angle: float = CREASE_ANGLE,
        side: str = "both",
        *,
        name: str = "shell",
        clean: bool = True,
        faces: bool = True,
    ) -> None:
        check_options(crease_angle, side)
        made = clean_surface if check_flag("clean", clean) else take_surface
        surface = made(raw_surface(vertices, elements, normals))
        self._set(surface, crease_angle, side, name, finds_faces=check_flag("faces", faces))

    @classmethod
    def from_file(
        cls,
        path: StrPath,
        unit: str | None = None,
        scale: str | float | None = None,
        *,
        chord_error: float | None = None,
        bodies: Sequence[str] | None = None,
        faces: Sequence[str | int] | bool | None = None,
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
            except for .shl files, which carry meters per file unit (SCALE), and for STEP and IGES,
            which carry a unit: another one that is stated is taken instead, with a UnitWarning
        scale : of a .shl file: "apply" its SCALE (default where no unit is stated), "ignore" it
            (default otherwise), or a number to use instead; of other files a number by which the
            surface is made larger. `health` says which was used
        chord_error : of CAD: largest distance between the elements, flat or curved, and the exact
            surface [m], 1e-3 of the box diagonal unless given; `health` says what was measured
        bodies : of CAD: names of the bodies to take; all unless given
        faces : of CAD: names of the faces to take, or their numbers in the file (from 1); all
            unless given. Of a mesh, False recognizes no `Shell.faces`
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
        check_options(crease_angle, side)
        named = None if isinstance(faces, bool) else faces
        options = CadOptions(chord_error, bodies, named, sew, time_limit, memory_limit)
        surface, taken_unit, factor = load_surface(path, unit, scale, options, crease_angle)
        found = surface.health.labelled(source=str(path), unit=taken_unit, scale=factor)
        called = Path(path).stem if name is None else name
        cleaned = replace(surface, health=found)
        source, finds = str(path), faces is not False
        return cls.from_surface(cleaned, crease_angle, side, called, source, taken_unit, finds)

    @classmethod
    def from_geometry(
        cls,
        geometry: object,
        *,
        chord_error: float | None = None,
        segments: int | None = None,
        extent: float | None = None,
        side: str = "both",
        crease_angle: float = CREASE_ANGLE,
        name: str | None = None,
    ) -> Shell:
        """Turn a pinocchio.GeometryObject or a coal geometry into a shell, in its own frame.

        Meshes are taken as they are, in meters; Box, Sphere, Cylinder, Capsule, Cone, Ellipsoid and
        Convex become closed shells with exact normals; Halfspace and Plane a square sheet. The
        placement of a GeometryObject is not applied: it is where the shell is to be mounted.

        Parameters
        ----------
        geometry : the geometry
        chord_error : largest distance between the elements and a round solid [m], 1e-3 of its
            diameter unless given
        segments : elements around a full circle, instead of chord_error
        extent : side of the square that stands for a half-space [m], 10 m unless given
        side, crease_angle, name : as of Shell; the name is the object's unless given

        Raises
        ------
        InvalidParameter
            If the geometry is of another kind, or an option is out of range.
        """
        from sphshell_pin.shell.primitives import geometry_surface

        check_options(crease_angle, side)
        surface = clean_surface(geometry_surface(geometry, chord_error, segments, extent))
        own = getattr(geometry, "name", None)
        called = name if name is not None else own if isinstance(own, str) else "shell"
        return cls.from_surface(surface, crease_angle, side, called or "shell")

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

    def transformed(self, placement: pin.SE3 | float | None = None, scale: float = 1.0) -> Shell:
        """Return the shell moved by a pinocchio.SE3 and made `scale` times larger first.

        A number in place of `placement` is the scale alone.

        Raises InvalidParameter unless the scale is positive and the placement an SE3.
        """
        if isinstance(placement, (int, float, np.number)):
            return self.transformed(scale=float(placement))
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
        try:
            surface = self.surface().moved(scale, rotation, translation)
        except OverflowError:
            raise InvalidParameter("scale", scale, "makes the shell too large") from None
        return self.from_surface(surface, **self.options)

    def to_file(self, path: StrPath, unit: str = "m") -> None:
        """Write the shell in the format its suffix names: .shl, .stl, .obj, .ply, .off.

        The numbers are in `unit`; .shl files also carry it, as SCALE. Quads stay quads, except in
        .stl. Normals of the shell go to .obj, .ply and .shl files, of version 2 then, for each
        corner. No others are written: `faces` are recognized again when the file is read. A file
        that was there before is replaced only when the new one is complete.

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

    @property
    def _title(self) -> str:
        return f"Shell '{self.name}'"

    def _facts(self) -> list[Fact]:
        return [
            Fact("elements", len(self.elements)),
            Fact("vertices", len(self.vertices)),
            Fact("surface", "closed" if self.is_closed else "open"),
            Fact("size", float(self.size), "m"),
            Fact("side", self.side),
            *([Fact("faces", len(self.faces))] if "faces" in vars(self) else []),
        ]
