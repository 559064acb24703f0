"""From one surface file to another, and how far apart they are."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.atomic import atomic_path
from sphshell_pin.errors import InvalidParameter, ShellFileError
from sphshell_pin.shell.cad import CAD_SUFFIXES, CadOptions
from sphshell_pin.shell.cad.options import BREP_SUFFIXES
from sphshell_pin.shell.cad.process import run_in_child
from sphshell_pin.shell.raw import random_places
from sphshell_pin.shell.readers import SUFFIXES, reader_for
from sphshell_pin.shell.shell import Shell
from sphshell_pin.shell.writers import encoded
from sphshell_pin.units import METERS_PER_UNIT, meters_per_unit

SAMPLES = 5000
"""Points taken of each surface to measure how far it is from the other."""

NO_NORMALS = (
    "{} files hold no normals, which are lost, nor on which faces the elements lie: planes, "
    "cylinders, cones, spheres and tori are recognized again when it is read, other normals "
    "estimated; .obj, .ply and .shl files keep them"
)


@dataclass(frozen=True)
class Held:
    """What a file holds.

    `path`, its length `unit`, `count` of `kind` (elements or CAD faces), `size` of the box diagonal
    [m], `area` [m^2]; of CAD, both of a tessellation.
    """

    path: Path
    unit: str
    count: int
    kind: str
    size: float
    area: float


@dataclass(frozen=True)
class Conversion:
    """Two files, and the distances between what they hold.

    Attributes
    ----------
    source, target : what was read, and what was written and read back
    forth : distances (n,) of points of the source from the surface of the target [m]
    back : distances (n,) of points of the target from the surface of the source [m]
    notes : of the reader of the source, and what the format of the target does not hold
    """

    source: Held
    target: Held
    forth: Array
    back: Array
    notes: tuple[str, ...]

    @property
    def largest(self) -> float:
        """The largest of all distances [m]."""
        return float(max(self.forth.max(), self.back.max()))

    @property
    def rms(self) -> float:
        """Their root mean square [m]."""
        return float(np.sqrt(np.mean(np.concatenate([self.forth, self.back]) ** 2)))


def convert(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    unit_in: str | None = None,
    unit_out: str | None = None,
    *,
    chord_error: float | None = None,
    bodies: Sequence[str] | None = None,
    faces: Sequence[str | int] | None = None,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> Conversion:
    """Write the surface of one file in the format the suffix of another names.

    Meshes (.stl, .obj, .ply, .off, .shl) hold elements, CAD files (.step, .iges, .brep) exact
    surfaces: CAD becomes a mesh within `chord_error`, CAD to CAD keeps the exact surfaces, and a
    mesh becomes planar CAD faces, one for each element. The new file is read back and compared
    before it replaces one that was there.

    Parameters
    ----------
    source, target : the files
    unit_in : unit of length of the source, as for `Shell.from_file`
    unit_out : that of the target; the source's unless given, mm if that has no name of its own
    chord_error, bodies, faces : of a CAD source, as for `Shell.from_file`
    time_limit, memory_limit : of CAD on either side, as for `Shell.from_file`

    Raises
    ------
    SphshellError
        As `Shell.from_file` and `Shell.to_file` do; of a mesh of too many elements for CAD; and if
        what was written cannot be read back.
    """
    file, suffix = reader_for(source)
    goal = Path(target)
    if goal.suffix.lower() not in SUFFIXES:
        raise InvalidParameter("target", str(goal), f"must end in one of: {', '.join(SUFFIXES)}")
    if goal.exists() and goal.resolve() == file.resolve():
        raise InvalidParameter("target", str(goal), "must be another file than the source")
    if not goal.parent.is_dir():
        raise ShellFileError(goal, "cannot be written: there is no such folder")
    if unit_out is not None:
        meters_per_unit(unit_out)
    options = CadOptions(chord_error, bodies, faces)
    limits = CadOptions(time_limit=time_limit, memory_limit=memory_limit)
    with_cad = bool({suffix, goal.suffix.lower()} & set(CAD_SUFFIXES))
    if suffix not in CAD_SUFFIXES:
        options.check_unused(suffix)
    if not with_cad:
        limits.check_unused(suffix)
    try:
        with atomic_path(goal, goal.suffix) as written:
            arguments = (file, written, unit_in, unit_out, options)
            if with_cad:
                purpose = f"converting {suffix} to {goal.suffix.lower()} files"
                done: Conversion = run_in_child(
                    "convert", arguments, file, purpose, limits, written
                )
            else:
                done = exchange(*arguments, written.write_bytes)
            return replace(done, target=replace(done.target, path=goal))
    except OSError as error:
        raise ShellFileError(goal, f"cannot be written ({error.strerror})") from error


def exchange(
    source: Path,
    target: Path,
    unit_in: str | None,
    unit_out: str | None,
    options: CadOptions,
    write: Callable[[bytes], object],
) -> Conversion:
    """Give what the `target` holds to `write`, read that back and compare it with the source."""
    first = _surface(source, unit_in, options)
    unit = unit_out or (first.held.unit if first.held.unit in METERS_PER_UNIT else "mm")
    write(_content(target, unit, first, options))
    suffix = target.suffix.lower()
    carried = suffix == ".shl" or suffix in CAD_SUFFIXES
    stated = unit if suffix in BREP_SUFFIXES or not carried else None
    second = _surface(target, stated, CadOptions())
    lost = (NO_NORMALS.format(suffix),) if suffix in (".stl", ".off") and first.has_normals else ()
    rng = np.random.default_rng(0)
    return Conversion(
        first.held,
        replace(second.held, unit=unit),
        second.distances(first.samples(SAMPLES, rng)),
        first.distances(second.samples(SAMPLES, rng)),
        (*first.notes, *lost),
    )


def _surface(path: Path, unit: str | None, options: CadOptions) -> _Mesh | _Faces:
    if path.suffix.lower() in CAD_SUFFIXES:
        return _Faces(path, unit, options)
    return _Mesh(path, unit)


def _content(path: Path, unit: str, source: _Mesh | _Faces, options: CadOptions) -> bytes:
    if path.suffix.lower() not in CAD_SUFFIXES:
        return encoded(path, source.shell(), unit)
    from sphshell_pin.shell.cad.model import MILLIMETER
    from sphshell_pin.shell.cad.writing import cad_content, faceted, parts_of

    if isinstance(source, _Faces):
        model = source.model
        return cad_content(path, parts_of(model, options.faces is None), model.meters, unit)
    shell = source.shell()
    return cad_content(path, [(shell.name, faceted(shell))], MILLIMETER, unit)


class _Mesh:
    """The flat elements of a file."""

    def __init__(self, path: Path, unit: str | None) -> None:
        self._shell = shell = Shell.from_file(path, unit, crease_angle=0.0)
        self.held = Held(
            path, shell.unit or "m", shell.num_elements, "elements", shell.size, shell.health.area
        )
        self.notes, self.has_normals = shell.health.notes, shell.normals is not None

    def shell(self) -> Shell:
        """Return the elements as they are."""
        return self._shell

    def distances(self, points: Array) -> Array:
        """Distances (n,) of points (n, 3) [m]."""
        return np.abs(self._shell.closest_points(points, method="facets").distances)

    def samples(self, count: int, rng: np.random.Generator) -> Array:
        """Random points (count, 3), spread by area [m]."""
        return random_places(self._shell.vertices[self._shell.triangles], count, rng)[1]


class _Faces:
    """The exact faces of a CAD file."""

    def __init__(self, path: Path, unit: str | None, options: CadOptions) -> None:
        from sphshell_pin.shell.cad.exact import TrimmedFaces
        from sphshell_pin.shell.cad.surface import load_cad

        cad = load_cad(path, unit, options)
        self._faces, self._meters, self._raw = TrimmedFaces(cad), cad.model.meters, cad.polygons()
        self.model, self.notes, self.has_normals = cad.whole, cad.notes(), True
        size, area = self._faces.extent
        self.held = Held(
            path,
            cad.unit,
            len(self.model.faces),
            "CAD faces",
            size * self._meters,
            area * self._meters**2,
        )

    def shell(self) -> Shell:
        """Return the tessellation, with exact normals, cleaned."""
        elements = self._raw.corners.reshape(-1, 3)
        normals = None if self._raw.normals is None else self._raw.normals.reshape(-1, 3, 3)
        return Shell(self._raw.vertices, elements, normals, name=self.held.path.stem)

    def distances(self, points: Array) -> Array:
        return self._faces.distances(points / self._meters) * self._meters

    def samples(self, count: int, rng: np.random.Generator) -> Array:
        return self._faces.samples(count, rng) * self._meters
