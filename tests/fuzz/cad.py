"""CAD files: OpenCASCADE crashes on damaged ones, or never ends, in a process of its own."""

import functools
import re
import tempfile
from importlib.util import find_spec
from pathlib import Path

import sphshell_pin as sp
from sphshell_pin.shell.cad import require_kernel

SUFFIXES = (".step", ".iges", ".brep") if find_spec("OCP") else ()

LIMIT = 9.0
"""Given to OpenCASCADE for a file [s]; the watch grants more."""

_TODAY = re.compile(rb"\d{4}-\d\d-\d\dT[\d:]{8}|15H\d{8}\.\d{6}")


@functools.cache
def corpus(suffix: str) -> tuple[bytes, ...]:
    """Return small whole files of a format, made by OpenCASCADE."""
    require_kernel("making files to damage")  # and keep OpenCASCADE from printing
    from tests.shell import cad_shapes as shapes

    write = {
        ".step": lambda path, shape: shapes.write_step(path, ("part", shape)),
        ".iges": lambda path, shape: shapes.write_iges(path, shape, solids=len(made) % 2),
        ".brep": shapes.write_brep,
    }[suffix]
    made: list[bytes] = []
    with tempfile.TemporaryDirectory() as folder:
        for name in ("box", "cylinder", "ring", "drilled_plate", "roof", "rounded_box"):
            path = write(Path(folder, f"part{suffix}"), getattr(shapes, name)())
            # Made at any time, a file has the same bytes.
            made.append(_TODAY.sub(lambda found: b"0" * len(found[0]), path.read_bytes()))
    return tuple(made)


def read(path: Path) -> None:
    """Read a file and use its surface."""
    shell = sp.Shell.from_file(path, "mm" if path.suffix == ".brep" else None, time_limit=LIMIT)
    shell.curvature_report()
    shell.contacts(shell.vertices[0], 0.1 * shell.size)
