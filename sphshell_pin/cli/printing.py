"""Standard streams on which printing never fails a command: closed, full or of another encoding."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


class _LossyFile(io.FileIO):
    """A file that takes what it cannot write, and keeps the first reason."""

    fault: OSError | None = None

    def write(self, data: ReadableBuffer, /) -> int:
        """Write bytes; return how many are done with."""
        if self.fault is None:
            try:
                return super().write(data)
            except OSError as fault:
                self.fault = fault
        return memoryview(data).nbytes


@contextlib.contextmanager
def lossy_streams() -> Iterator[None]:
    """Let `sys.stdout` and `sys.stderr` lose what they cannot write, and say so at the end.

    Characters that the encoding lacks are written as escapes. A reader that closed the pipe, as
    `head` does, is told nothing. Descriptors that were closed lead to the null device: else the
    next file that is opened would be the standard output.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest one that is free
    raw = {}
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        usual = getattr(sys, name)
        raw[name] = file = _LossyFile(descriptor, "w", closefd=False)
        stream = io.TextIOWrapper(
            io.BufferedWriter(file),
            encoding=getattr(usual, "encoding", None) or "utf-8",
            errors="backslashreplace",
            line_buffering=name == "stderr" or file.isatty(),
        )
        setattr(sys, name, stream)
    try:
        yield
    finally:
        sys.stdout.flush()
        fault = raw["stdout"].fault
        if fault is not None and fault.errno != errno.EPIPE:
            text = f"warning: not all of the output could be printed: {fault.strerror}\n"
            sys.stderr.write(text)
        sys.stderr.flush()
