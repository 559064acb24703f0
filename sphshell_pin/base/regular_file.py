"""Files opened for reading: regular ones alone, and no more of them than stated.

A pipe makes its reader wait for ever, and a device may never end.
"""

import errno
import io
import os
import stat
from os import PathLike

StrPath = str | PathLike[str]
"""What names a file."""

MOST = 4e9
"""Most of a file, unless stated [bytes]."""

MOST_TEXT = 100e6
"""Most of a scenario, a robot's description or a package.xml [bytes]."""

SMALL = 1 << 16
"""Files of the system state no size [bytes]."""

_SPECIAL = "is a pipe, a socket or a device, not a file"


def why_no_file(path: StrPath) -> str:
    """Return what keeps `path` from being a regular file, as the end of a sentence, or ""."""
    try:
        mode = os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError, ValueError):  # a name with a null character
        return "no such file"
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    if stat.S_ISDIR(mode):
        return "is a folder, not a file"
    return "" if stat.S_ISREG(mode) else _SPECIAL


def open_regular(path: StrPath, most: float = MOST) -> io.BufferedReader:
    """Open a regular file of at most `most` bytes for reading.

    Raises OSError, whose `strerror` says what the file is instead.
    """
    flags = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC
    file: io.BufferedReader = io.BufferedReader(
        io.FileIO(path, opener=lambda name, _: os.open(name, flags))
    )
    try:
        about = os.fstat(file.fileno())
        if not stat.S_ISREG(about.st_mode):
            raise OSError(errno.EINVAL, _SPECIAL)
        if about.st_size > most:
            size = f"{about.st_size / 1e9:.3g} GB, more than {most / 1e9:.3g} GB"
            raise OSError(errno.EFBIG, f"it holds {size}")
        if not file.peek(1):  # empty, or one of the system's files, for which a reader would wait
            os.read(file.fileno(), 1)
    except OSError as error:
        error.filename = str(path)
        file.close()
        raise
    return file


def read_bytes(path: StrPath, most: float = MOST) -> bytes:
    """Return the content of a file, see `open_regular`."""
    with open_regular(path, most) as file:
        return file.read(max(os.fstat(file.fileno()).st_size, SMALL))  # no more: it may grow


def read_text(path: StrPath, most: float = MOST) -> str:
    """Return the text of a file in UTF-8, without its byte-order mark, lines ended as Python's."""
    with io.TextIOWrapper(io.BytesIO(read_bytes(path, most)), encoding="utf-8-sig") as text:
        return text.read()
