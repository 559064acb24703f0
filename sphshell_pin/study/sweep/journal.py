"""What a sweep has done so far, one line of JSON each run, kept beside the table as it comes."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, Any

from sphshell_pin.errors import ResultError, SweepError
from sphshell_pin.study.sweep.job import Outcome

FORMAT = 1
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


class Journal:
    """The journal at `path` of the sweep that `head` describes; this process alone may write it.

    A last line that was torn when the machine or the process went down is dropped.

    Raises
    ------
    SweepError
        The journal is that of another sweep, is damaged, or another process writes it now.
    ResultError
        It cannot be read or written.
    """

    def __init__(self, path: Path, head: Mapping[str, Any]) -> None:
        self.path = path
        self.outcomes: dict[int, Outcome] = {}
        """What was read from it, by the number of the run; the newest where there are several."""
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
        first = _line({"format": FORMAT, **head})
        # All lines end in a newline: what follows the last one was torn.
        entries, sound = self._parse(lines[:-1])
        if not entries and not first.startswith(lines[-1]):
            raise self._foreign(1)
        self._file.truncate(sound)
        if not entries:
            self._empty = True
            self._file.write(first)
            self._flush()
            _flush_folder(self.path.parent)
            return
        self._compare(entries[0], {"format": FORMAT, **head})
        for entry in entries[1:]:
            number = entry.pop("run")
            self.outcomes[number] = Outcome(number, **entry)
        self._empty = not self.outcomes

    def _parse(self, lines: list[bytes]) -> tuple[list[dict[str, Any]], int]:
        """Return the entries, and how many bytes of the file are sound."""
        entries: list[dict[str, Any]] = []
        sound = 0
        for i, line in enumerate(lines):
            try:
                entry = json.loads(line)
                if not isinstance(entry, dict) or (i > 0 and set(entry) != _OF_RUN):
                    raise ValueError
            except ValueError:
                if 0 < i == len(lines) - 1:
                    break  # torn as well: its end reached the disk before its middle
                raise self._foreign(i + 1) from None
            entries.append(entry)
            sound += len(line) + 1
        return entries, sound

    def _compare(self, found: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
        # As JSON has it: tuples are lists there.
        wanted = json.loads(json.dumps(wanted))
        for key, difference in _DIFFERENCES.items():
            if found.get(key) != wanted[key]:
                raise SweepError(
                    f"{self.path}: is of another sweep, with {difference}: give another --out, or "
                    "delete the file to begin anew"
                )

    def _foreign(self, line: int) -> SweepError:
        return SweepError(
            f"{self.path}, line {line}: is no entry of a sweep's journal; delete the file to begin "
            "anew, or give another --out"
        )

    def _flush(self) -> None:
        self._file.flush()
        os.fsync(self._file.fileno())

    def _broken(self, fault: OSError) -> ResultError:
        return ResultError(self.path, f"cannot be written: {fault.strerror or fault}")


def _line(entry: Mapping[str, Any]) -> bytes:
    # Python writes floats so that they are read back exactly.
    return json.dumps(entry).encode() + b"\n"


def _flush_folder(folder: Path) -> None:
    """Make the name of a new file outlast a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
