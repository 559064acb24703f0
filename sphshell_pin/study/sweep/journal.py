"""What a sweep has done so far: an SQLite file beside the table, one row per finished run.

SQLite's transactions keep each row through a kill or a power cut. A row also holds a CRC-32 of its
other columns, because SQLite does not detect bits that a disk changed.
"""

from __future__ import annotations

import contextlib
import json
import os
import sqlite3
import zlib
from collections.abc import Mapping
from pathlib import Path

from sphshell_pin.atomic.lock import lock_file, lock_folder
from sphshell_pin.errors import ResultError, SweepError
from sphshell_pin.study.sweep.job import DONE, FAILED, JsonObject, Outcome

FORMAT = 4
"""Format 3 had no curves, 1 and 2 were lines of JSON; they cannot be read any more."""
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
_TABLES = """
CREATE TABLE sweep (description TEXT NOT NULL);
CREATE TABLE runs (run INTEGER, status TEXT, error TEXT, figures TEXT, wall_time REAL, worker TEXT,
                   curves BLOB, crc32 INTEGER);
"""


class Journal:
    """The journal at `path` of a sweep of `runs` runs that `head` describes.

    Only this process may write it, until `close`. A damaged row is ignored, and its run is done
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
        self._locks = contextlib.ExitStack()
        try:
            # A run into this folder does not exchange it: SQLite needs its files where they are.
            self._locks.callback(os.close, lock_folder(path.parent, alone=False)[0])
            self._locks.callback(os.close, lock_file(path, wait=False)[0])
            self._file = sqlite3.connect(path)
        except BlockingIOError:
            self._locks.close()
            raise SweepError(f"{path}: another sweep is writing it; give another --out") from None
        except (OSError, sqlite3.Error) as fault:
            self._locks.close()
            raise self._broken(getattr(fault, "strerror", fault)) from None
        try:
            self._begin(json.dumps({"format": FORMAT, **head}), runs)
        except sqlite3.OperationalError as fault:
            self.close()
            raise self._broken(fault) from None
        except (sqlite3.DatabaseError, ValueError, TypeError, AttributeError, RecursionError):
            self.close()
            raise SweepError(
                f"{path}: is no journal of this version of the package, or is damaged; delete the "
                "file to start the sweep again, or give another --out"
            ) from None
        except BaseException:
            self.close()
            raise

    def add(self, outcome: Outcome) -> None:
        """Write `outcome`; when this returns, it survives a power cut."""
        row = (
            outcome.number,
            outcome.status,
            outcome.error,
            json.dumps(dict(outcome.figures)),  # writes floats so that they are read back exactly
            outcome.wall_time,
            outcome.worker,
            outcome.curves,
        )
        try:
            with self._file:
                self._file.execute("INSERT INTO runs VALUES (?,?,?,?,?,?,?,?)", (*row, _crc(row)))
        except sqlite3.Error as fault:
            raise self._broken(fault) from None
        self.outcomes[outcome.number] = outcome

    def close(self) -> None:
        """Let other processes write the journal; one without any run is removed."""
        try:
            # Not counted: a view in a damaged file may have no end.
            empty = self._file.execute("SELECT 1 FROM runs LIMIT 1").fetchone() is None
        # Of a damaged file, even the error's text; or it was closed before.
        except (sqlite3.Error, UnicodeDecodeError):
            empty = False
        self._file.close()
        if empty:
            self.path.unlink(missing_ok=True)
        # Closed last: a close of any descriptor of the file would drop SQLite's own locks.
        self._locks.close()

    def _begin(self, head: str, runs: int) -> None:
        self._file.execute("PRAGMA synchronous = FULL")
        kinds = dict(self._file.execute("SELECT name, type FROM sqlite_master").fetchall())
        if kinds and kinds != {"sweep": "table", "runs": "table"}:
            raise ValueError("other tables, or views, which may have no end")
        if not kinds:
            with self._file:
                self._file.executescript(f"BEGIN; {_TABLES} COMMIT;")
        found = self._file.execute("SELECT description FROM sweep").fetchone()
        if found is None:
            with self._file:
                self._file.execute("INSERT INTO sweep VALUES (?)", (head,))
            return
        self._compare(json.loads(found[0]), json.loads(head))
        for rowid, *row, crc in self._file.execute("SELECT rowid, * FROM runs ORDER BY rowid"):
            outcome = _outcome(row) if crc == _crc(tuple(row)) else None
            if outcome is None or not 0 <= outcome.number < runs:
                self.notes.append(
                    f"{self.path}, row {rowid}: is damaged and left out; a run that has no other "
                    "row is done again"
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

    def _broken(self, fault: object) -> ResultError:
        return ResultError(self.path, f"cannot be written: {fault}")


def _outcome(row: list[object]) -> Outcome | None:
    """Return what a row states, None if that cannot be the outcome of a run."""
    number, status, error, figures, wall_time, worker, curves = row
    try:
        found = json.loads(figures) if isinstance(figures, str) else None
    except (ValueError, RecursionError):
        return None
    match number, error, found, wall_time, worker, curves:
        case int(), str(), dict(), float(), str(), bytes() if status in (DONE, FAILED) and all(
            isinstance(x, int | float) for x in found.values()
        ):
            return Outcome(number, status, error, found, wall_time, worker, curves)
    return None


def _crc(row: tuple[object, ...]) -> int:
    return zlib.crc32(repr(row).encode())
