"""From one surface file to another, and how far apart they are."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sphshell_pin.base.atomic import atomic_path
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.errors import InvalidParameter, ShellFileError
from sphshell_pin.shell.readers import reader_for
from sphshell_pin.shell.shell import Shell
from sphshell_pin.shell.writers import WRITERS, encoded
from sphshell_pin.units import METERS_PER_UNIT

NO_NORMALS = (
    "{} files hold no normals, which are lost, nor on which faces the elements lie: planes, "
    "cylinders, cones, spheres and tori are recognized again when it is read, other normals "
    "estimated; .obj, .ply and .shl files keep them"
)


@dataclass(frozen=True)
class Conversion:
    """Two files, and how far apart they are.

    Attributes
    ----------
    source, target : the elements that were read, and those that were written and read back
    largest : distance of a vertex of either from the other [m]
    notes : of the reader of the source, which states the chord error of CAD, and what the format of
        the target does not hold
    """

    source: Shell
    target: Shell
    largest: float
    notes: tuple[str, ...]


def convert(
    source: StrPath,
    target: StrPath,
    unit_in: str | None = None,
    unit_out: str | None = None,
    *,
    chord_error: float | None = None,
    bodies: Sequence[str] | None = None,
    faces: Sequence[str | int] | None = None,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> Conversion:
    """Write the elements of a surface file in the mesh format that the suffix of another names.

    CAD becomes a mesh within `chord_error`. The new file is read back and compared before it
    replaces one that was there.

    Parameters
    ----------
    source, target : the files
    unit_in : unit of length of the source, as for `Shell.from_file`
    unit_out : that of the target; the source's unless given, mm if that has no name of its own
    chord_error, bodies, faces, time_limit, memory_limit : of CAD, as for `Shell.from_file`

    Raises
    ------
    SphshellError
        As `Shell.from_file` and `Shell.to_file` do; and if what was written cannot be read back.
    """
    file, _ = reader_for(source)
    goal = Path(target)
    suffix = goal.suffix.lower()
    if suffix not in WRITERS:
        raise InvalidParameter("target", str(goal), f"must end in one of: {', '.join(WRITERS)}")
    if goal.exists() and goal.resolve() == file.resolve():
        raise InvalidParameter("target", str(goal), "must be another file than the source")
    first = Shell.from_file(
        file,
        unit_in,
        chord_error=chord_error,
        bodies=bodies,
        faces=faces,
        time_limit=time_limit,
        memory_limit=memory_limit,
        crease_angle=0.0,
    )
    unit = unit_out or (first.unit if first.unit in METERS_PER_UNIT else None) or "mm"
    try:
        with atomic_path(goal, goal.suffix) as written:
            written.write_bytes(encoded(goal, first, unit))
            stated = None if suffix == ".shl" else unit
            second = Shell.from_file(written, stated, crease_angle=0.0, name=goal.stem)
    except OSError as error:
        raise ShellFileError(goal, f"cannot be written ({error.strerror})") from error
    apart = (
        np.abs(one.closest_points(other.vertices, method="facets").distances).max()
        for one, other in ((first, second), (second, first))
    )
    lost = suffix in (".stl", ".off") and first.normals is not None
    notes = first.health.notes + ((NO_NORMALS.format(suffix),) if lost else ())
    return Conversion(first, second, float(max(apart)), notes)
