"""Whether a CAD file begins and ends as its format has it."""

import os
import re
from pathlib import Path

from sphshell_pin.base.regular_file import open_regular
from sphshell_pin.errors import ShellFileError
from sphshell_pin.shell.cad.options import BREP_SUFFIXES, STEP_SUFFIXES

LOOKED_AT = 4096
"""Bytes at either end of a file."""


def check_frame(path: Path) -> str:
    """Return the format of a file, STEP, IGES or BREP; half a file may read as a whole.

    Raises
    ------
    ShellFileError
        If it cannot be read, or does not begin or end as the format has it.
    """
    suffix = path.suffix.lower()
    kind = "STEP" if suffix in STEP_SUFFIXES else "BREP" if suffix in BREP_SUFFIXES else "IGES"
    try:
        with open_regular(path) as file:
            data = file.read(LOOKED_AT)
            file.seek(max(0, file.seek(0, os.SEEK_END) - LOOKED_AT))
            tail = file.read(LOOKED_AT).rstrip(b"\0\x1a \r\n\t")
    except OSError as error:
        raise ShellFileError(path, f"cannot be read ({error.strerror})") from error
    head = data.lstrip(b"\xef\xbb\xbf \r\n\t")
    if kind == "STEP":
        begins = head.startswith(b"ISO-10303-21")
        ends = re.search(rb"END-ISO-10303-21\s*;$", tail) is not None
        missing = "END-ISO-10303-21"
    elif kind == "IGES":
        begins = re.match(rb"[^\r\n]{72}[SFC]", data) is not None
        ends = re.search(rb"(^|[\r\n])[^\r\n]{72}T *\d+$", tail) is not None
        missing = "the T line"
    else:
        begins = head.startswith((b"DBRep_DrawableShape", b"CASCADE Topology"))
        ends = re.search(rb"[\r\n][-+ie]\d+ \d+$", tail) is not None
        missing = "the line of the whole shape"
    if not begins:
        raise ShellFileError(path, f"is no {kind} file: it does not begin as one")
    if not ends:
        raise ShellFileError(path, f"is truncated: {missing} at its end is missing")
    return kind
