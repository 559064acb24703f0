"""What a sweep has done so far, one line of JSON each run, kept beside the table as it comes.

Each line ends with the CRC-32 of what is before it, so that no damage goes into the table.
"""

from __future__ import annotations

import fcntl
import json
import os
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, Any

from sphshell_pin.errors import ResultError, SweepError
from sphshell_pin.study.sweep.job import DONE, FAILED, Outcome

FORMAT = 2
SUFFIX = ".journal"

# What may tell two sweeps apart, as a sentence puts it.
_DIFFERENCES = {
    "format": "another version of this package",
    "scenario": "another scenario",
    "settings": "other settings of the scenario",
    "vary": "other values",
    "together": "values combined in another way",
    "verdicts": "other columns (--verdicts)",
    "files": "other contents of the files beside the scenario",
    "versions": "other versions of the libraries",
}

# What a line tells of a run.
_OF_RUN = {"run", "status", "error", "figures", "wall_time", "worker"}

WITHOUT_SUMS = 1
"""The format of journals whose lines have no checksum yet: they can be read."""

_SUM = b', "crc32": "'
_SUMMED = len(_SUM) + len('01234567"}')


class Journal:
    """The journal at `path` of a sweep of `runs` runs that `head` describes.

    This process alone may write it. A last line that was torn when the machine or the process went
    down is dropped; another line that is damaged is left alone, and its run is to be done again.

    Raises
    ------
    SweepError
        The journal is that of another sweep, its first line is damaged, or another process writes
        it now.
    ResultError
        It cannot be read or written.
    """

    def __init__(self, path: Path, head: Mapping[str, Any], runs: int) -> None:
        self.path = path
        self.outcomes: dict[int, Outcome] = {}
        """What was read from it, by the number of the run; the newest where there are several."""
        self.notes: list[str] = []
        """What is damaged, one sentence each."""
        self._runs = runs
        self._empty = False
        try:
            # Closed with this object: the lock lasts as long as the file is open.
            self._file: IO[bytes] = open(path, "a+b")  # noqa: SIM115
        except OSError as fault:
            raise self._broken(fault) from None
        try:
            self._begin(dict(head))
        except OSError as fault:
            self.close()
            raise self._broken(fault) from None
        except BaseException:
            self.close()
            raise

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Write `outcomes`; when this returns they outlast a power cut."""
        try:
            for one in outcomes:
                entry = {
                    "run": one.number,
                    "status": one.status,
                    "error": one.error,
                    "figures": dict(one.figures),
                    "wall_time": one.wall_time,
                    "worker": one.worker,
                }
                self._file.write(_line(entry))
            self._flush()
            self._empty = False
        except OSError as fault:
            raise self._broken(fault) from None

    def close(self) -> None:
        """Let others write the journal; one that tells of no run is removed."""
        if self._empty and not self._file.closed:
            self.path.unlink(missing_ok=True)
        self._file.close()

    def _begin(self, head: dict[str, Any]) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise SweepError(
                f"{self.path}: another sweep is writing it; give another --out"
            ) from None
        self._file.seek(0)
        lines = self._file.read().split(b"\n")
        head = {"format": FORMAT, **head}
        first = _line(head)
        # All lines end in a newline: what follows the last one was torn.
        torn = lines.pop()
        if not lines:
            if not first.startswith(torn):
                raise self._foreign()
            self._file.truncate(0)
            self._empty = True
            self._file.write(first)
            self._flush()
            _flush_folder(self.path.parent)
            return
        found = _entry(lines[0], bare=True)
        if found is None:
            raise self._foreign()
        self._compare(found, head)
        bare = found.get("format") == WITHOUT_SUMS
        for i, line in enumerate(lines[1:], start=2):
            outcome = _outcome(_entry(line, bare=bare), self._runs)
            if outcome is not None:
                self.outcomes[outcome.number] = outcome
            elif i == len(lines):
                torn = line + b"\n" + torn  # its end reached the disk before its middle
            else:
                self.notes.append(
                    f"{self.path}, line {i}: is damaged and left out; a run that is on no other "
                    "line is done again"
                )
        self._file.truncate(self._file.tell() - len(torn))
        self._empty = not self.outcomes and not self.notes

    def _compare(self, found: Mapping[str, Any], head: Mapping[str, Any]) -> None:
        # As JSON has it: tuples are lists there.
        wanted: dict[str, Any] = json.loads(json.dumps(head))
        if found.get("format") == WITHOUT_SUMS:
            wanted["format"] = WITHOUT_SUMS
        for key, difference in _DIFFERENCES.items():
            if found.get(key) != wanted[key]:
                raise SweepError(
                    f"{self.path}: is of another sweep, with {difference}: give another --out, or "
                    "delete the file to begin anew"
                )

    def _foreign(self) -> SweepError:
        return SweepError(
            f"{self.path}, line 1: does not begin a sweep's journal, or is damaged; delete the "
            "file to begin anew, or give another --out"
        )

    def _flush(self) -> None:
        self._file.flush()
        os.fsync(self._file.fileno())

    def _broken(self, fault: OSError) -> ResultError:
        return ResultError(self.path, f"cannot be written: {fault.strerror or fault}")


def _line(entry: Mapping[str, Any]) -> bytes:
    # Python writes floats so that they are read back exactly.
    text = json.dumps(entry).encode()[:-1]
    return text + _SUM + b'%08x"}\n' % zlib.crc32(text)


def _entry(line: bytes, *, bare: bool) -> dict[str, Any] | None:
    """Return what `line` says, None if it is damaged; if `bare`, it may lack its checksum."""
    text, end = line[:-_SUMMED], line[-_SUMMED:]
    if end.startswith(_SUM):
        if end != _SUM + b'%08x"}' % zlib.crc32(text):
            return None
        line = text + b"}"
    elif not bare:
        return None
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return entry if isinstance(entry, dict) else None


def _outcome(entry: dict[str, Any] | None, runs: int) -> Outcome | None:
    """Return the outcome that `entry` tells, None if it tells none of a sweep of `runs` runs."""
    if entry is None or set(entry) != _OF_RUN:
        return None
    match entry:
        case {
            "run": int(number),
            "status": str(status),
            "error": str(error),
            "figures": dict(figures),
            "wall_time": float(wall_time),
            "worker": str(worker),
        } if (
            not isinstance(number, bool)
            and 0 <= number < runs
            and status in (DONE, FAILED)
            and all(isinstance(value, float) for value in figures.values())
        ):
            return Outcome(number, status, error, figures, wall_time, worker)
    return None


def _flush_folder(folder: Path) -> None:
    """Make the name of a new file outlast a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
