"""What a sweep has done so far: lines of JSON beside the table, one per finished run.

A line is on the disk before the next run is counted; one that a kill cut off is removed. It ends
with a CRC-32 of what is before that, because no parser notices a digit that a disk changed. Lines
are appended to one file that stays open: a run that exchanges the folder links it into the new one.
"""

import base64
import json
import os
import zlib
from collections.abc import Mapping
from pathlib import Path

from sphshell_pin.base import regular_file
from sphshell_pin.base.atomic.file import sync_folder
from sphshell_pin.base.atomic.lock import lock_file
from sphshell_pin.errors import ResultError, SweepError
from sphshell_pin.study.sweep.job import JsonObject, Outcome

FORMAT = 5
"""Formats 3 and 4 were SQLite files, 1 and 2 had other lines; they cannot be read any more."""
SUFFIX = ".journal"

# What two sweeps can differ in, and the words for it.
_DIFFERENCES = {
    "format": "another version of this package",
    "scenario": "another scenario",
    "settings": "other settings of the scenario",
    "vary": "other values",
    "bands": "other curves (--bands)",
    "together": "values combined in another way",
    "verdicts": "other columns (--verdicts)",
    "files": "other contents of the files beside the scenario",
    "versions": "other versions of the libraries",
}
_CRC = b', "crc32": '


class Journal:
    """The journal at `path` of a sweep of `runs` runs that `head` describes.

    Only this process may write it, until `close`. A damaged line is ignored, and its run is done
    again.

    Raises
    ------
    SweepError
        The journal is that of another sweep, is no journal, or another process is writing it.
    ResultError
        It cannot be read or written.
    """

    def __init__(self, path: Path, head: Mapping[str, object], runs: int) -> None:
        self.path = path
        self.outcomes: dict[int, Outcome] = {}
        """The outcomes in the file by number of the run; the newest where there are several."""
        self.notes: list[str] = []
        """What is damaged, one sentence each."""
        try:
            self._file = os.fdopen(lock_file(path, wait=False)[0], "r+b", buffering=0)
        except BlockingIOError:
            raise SweepError(f"{path}: another sweep is writing it; give another --out") from None
        except OSError as fault:
            raise self._broken(fault) from None
        try:
            self._begin({"format": FORMAT, **head}, runs)
        except OSError as fault:
            self._file.close()
            raise self._broken(fault) from None
        except BaseException:
            self._file.close()
            raise

    def add(self, outcome: Outcome) -> None:
        """Write `outcome`; when this returns, it survives a power cut."""
        data = {
            "run": outcome.number,
            "status": outcome.status,
            "error": outcome.error,
            "figures": dict(outcome.figures),  # floats are read back exactly
            "wall_time": outcome.wall_time,
            "worker": outcome.worker,
            "curves": base64.b64encode(outcome.curves).decode(),
        }
        text = json.dumps(data).encode().removesuffix(b"}")
        self._write(text + _CRC + str(zlib.crc32(text)).encode() + b"}\n")
        self.outcomes[outcome.number] = outcome

    def close(self) -> None:
        """Let other processes write the journal; one of a head alone is removed."""
        if not self._file.closed and not self.outcomes and not self.notes:
            self.path.unlink(missing_ok=True)
        self._file.close()

    def _write(self, line: bytes) -> None:
        try:
            while line:
                line = line[self._file.write(line) :]
            os.fsync(self._file.fileno())
        except OSError as fault:
            raise self._broken(fault) from None

    def _begin(self, head: JsonObject, runs: int) -> None:
        whole = regular_file.read_bytes(self.path)
        first, *lines = whole.split(b"\n")
        start = json.dumps(head).encode() + b"\n"
        if start.startswith(whole) and whole != start:  # a new file, or its head was cut off
            self._file.seek(0)
            self._write(start)
            sync_folder(self.path.parent)
            return
        try:
            found = json.loads(first)
        except (ValueError, RecursionError):
            found = None
        if not isinstance(found, dict) or found.get("format") != FORMAT or not lines:
            raise SweepError(
                f"{self.path}: is no journal of this version of the package, or is damaged; delete "
                "the file to start the sweep again, or give another --out"
            )
        self._compare(found, json.loads(json.dumps(head)))
        # What is behind the last end of a line was cut off while it was written.
        self._file.seek(len(whole) - len(lines.pop()))
        self._file.truncate()
        for number, line in enumerate(lines, 2):
            outcome = _outcome(line)
            if outcome is None or not 0 <= outcome.number < runs:
                self.notes.append(
                    f"{self.path}, line {number}: is damaged and left out; a run that has no other "
                    "line is done again"
                )
                continue
            self.outcomes[outcome.number] = outcome

    def _compare(self, found: JsonObject, wanted: JsonObject) -> None:
        for key, difference in _DIFFERENCES.items():
            if found.get(key) != wanted.get(key):
                raise SweepError(
                    f"{self.path}: is of another sweep, with {difference}: give another --out, or "
                    "delete the file to start again"
                )

    def _broken(self, fault: OSError) -> ResultError:
        return ResultError(self.path, f"cannot be written: {fault.strerror or fault}")


def _outcome(line: bytes) -> Outcome | None:
    """Return what a line states, None if that is not what was written."""
    text, _, crc = line.rpartition(_CRC)
    if crc != str(zlib.crc32(text)).encode() + b"}":
        return None
    try:
        match json.loads(text + b"}"):
            case {
                "run": int(run),
                "status": ("done" | "failed") as status,
                "error": str(error),
                "figures": dict(figures),
                "wall_time": float(wall_time),
                "worker": str(worker),
                "curves": str(curves),
            } if all(isinstance(one, int | float) for one in figures.values()):
                data = base64.b64decode(curves)
                return Outcome(run, status, error, figures, wall_time, worker, data)
    except (ValueError, RecursionError):
        pass
    return None
