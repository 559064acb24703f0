"""What a CAD child does: all that the package needs of OpenCASCADE.

`run_in_child` has it run in the child's process, where a crash or a hang does not affect the
caller.
"""

from pathlib import Path

from sphshell_pin.errors import InvalidShell
from sphshell_pin.shell.cad.curved_error import hold_curvature
from sphshell_pin.shell.cad.options import CadOptions
from sphshell_pin.shell.cad.surface import load_cad
from sphshell_pin.shell.cleaned import CleanedSurface
from sphshell_pin.shell.cleaning import clean_surface


def read(
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
