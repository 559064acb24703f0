"""Surface files: which reader takes which suffix."""

import os
from pathlib import Path

from sphshell_pin.base.checks import check_type
from sphshell_pin.base.regular_file import StrPath, why_no_file
from sphshell_pin.errors import InvalidParameter, ShellFileError
from sphshell_pin.shell.cad.options import CAD_SUFFIXES
from sphshell_pin.shell.readers.mesh import read_obj, read_off, read_stl
from sphshell_pin.shell.readers.ply import read_ply
from sphshell_pin.shell.readers.shl import read_shl

__all__ = ["READERS", "read_obj", "read_off", "read_ply", "read_shl", "read_stl", "reader_for"]

READERS = {".stl": read_stl, ".obj": read_obj, ".ply": read_ply, ".off": read_off}
"""Readers of formats that carry no unit; .shl carries one and has a reader of its own."""

SUFFIXES = (*READERS, ".shl", *CAD_SUFFIXES)


def reader_for(path: StrPath) -> tuple[Path, str]:
    """Return the path and its suffix in lower case, after a check that such a file can be read.

    Raises
    ------
    InvalidParameter
        Of an unknown suffix; the message lists the known ones.
    ShellFileError
        If the file is missing, empty or not a file.
    """
    check_type("path", path, (str, os.PathLike), "must be the path of a surface file")
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InvalidParameter(
            "path", str(path), f"must end in one of: {', '.join(SUFFIXES)}, not '{path.suffix}'"
        )
    if reason := why_no_file(path):
        raise ShellFileError(path, reason)
    if path.stat().st_size == 0:
        raise ShellFileError(path, "is empty")
    return path, suffix
