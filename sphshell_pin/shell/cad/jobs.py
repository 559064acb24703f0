"""What a CAD child does: all that the package needs of OpenCASCADE.

`run_in_child` has them run in the child's process, where a crash or a hang does not affect the
caller.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from sphshell_pin.base.arrays import Array, Ints
from sphshell_pin.errors import InvalidShell
from sphshell_pin.shell.cad.curved_error import hold_curvature
from sphshell_pin.shell.cad.exact import TrimmedFaces
from sphshell_pin.shell.cad.messages import Parent
from sphshell_pin.shell.cad.options import CadOptions
from sphshell_pin.shell.cad.surface import load_cad
from sphshell_pin.shell.cleaned import CleanedSurface
from sphshell_pin.shell.cleaning import clean_surface
from sphshell_pin.shell.converting import Conversion, exchange

BETWEEN = 100
"""Contacts after which the audit reports that it continues."""


def read(
    parent: Parent,
    path: Path,
    unit: str | None,
    options: CadOptions,
    scale: float,
    crease_angle: float,
    notes: tuple[str, ...],
) -> tuple[CleanedSurface, str, float]:
    """Read, tessellate and clean a CAD file.

    Returns the surface [m], the unit taken, and meters per unit of the file, `scale` included.
    """
    cad = load_cad(path, unit, options)
    raw = cad.polygons().noting(*cad.notes()).scaled(scale).noting(*notes)
    try:
        surface = clean_surface(raw)
    except InvalidShell as error:
        raise InvalidShell(f"{path}: {error}") from error
    if crease_angle > 0.0:
        surface = hold_curvature(surface, cad, scale * cad.model.meters, crease_angle)
    return surface, cad.unit, cad.factor * scale


def stationary_points(
    parent: Parent,
    path: Path,
    unit: str | None,
    options: CadOptions,
    scales: tuple[float, ...],
    centers: Array,
    contacts: Array,
) -> tuple[Array, Array, Ints]:
    """Find the stationary point on the trimmed faces next to each of k contacts.

    scales : by which the faces were made larger, one after the other
    centers, contacts : (k, 3) in the shell's frame [m]

    Returns the points (k, 3) [m], the unit normals (k, 3) of the surface there, and (k,) 0 where
    there is none, 1 for a point of an edge or a vertex, which has no normal, 2 for one of a face.
    """
    cad = load_cad(path, unit, options)
    meters = cad.model.meters
    for scale in scales:
        meters *= scale
    faces = TrimmedFaces(cad)
    points, normals = np.zeros(centers.shape), np.zeros(centers.shape)
    kinds = np.zeros(len(centers), np.int32)
    for k, (center, contact) in enumerate(zip(centers, contacts, strict=True)):
        if k % BETWEEN == 0:
            parent.alive()
        found = faces.stationary_point(center / meters, contact / meters)
        if found is None:
            continue
        points[k], kinds[k] = meters * found.point, 1
        if found.normal is not None:
            normals[k], kinds[k] = found.normal, 2
    return points, normals, kinds


def convert(
    parent: Parent,
    source: Path,
    target: Path,
    unit_in: str | None,
    unit_out: str | None,
    options: CadOptions,
) -> Conversion:
    """Have the surface of one file written to another, and measure; see `converting.exchange`."""
    return exchange(source, target, unit_in, unit_out, options, parent.write)


JOBS: dict[str, Callable[..., object]] = {
    one.__name__: one for one in (read, stationary_points, convert)
}
