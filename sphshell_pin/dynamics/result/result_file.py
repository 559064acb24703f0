"""What a results file holds, and the check that one holds it: no array is taken on trust.

The file is a zip archive of arrays (.npy) that `Result.save` wrote. Somebody else's may hold
anything: sizes are compared before memory is taken, nothing is ever unpickled.
"""

from __future__ import annotations

import json
import math
import os
import warnings
import zipfile
from collections.abc import Collection, Mapping
from dataclasses import asdict, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from sphshell_pin.base.arrays import Announced, Kind, misfit
from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.base.checks import read_only
from sphshell_pin.base.regular_file import StrPath, open_regular
from sphshell_pin.dynamics.result import result_parts
from sphshell_pin.dynamics.result.run_stats import EventKind, RunStats
from sphshell_pin.dynamics.run.sensitivities import Sensitivities
from sphshell_pin.dynamics.scene.scene_contacts import ROW, Columns
from sphshell_pin.dynamics.sensing.sensor_log import joined_logs, split_logs
from sphshell_pin.errors import ResultError

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result.result import Result

LARGEST_HEADER = 1 << 26  # characters; a million events need less


FLOAT, INT, LONG, BYTE = (np.dtype(one) for one in ("f8", "i4", "i8", "u1"))


def _of_type(part: str, table: np.dtype[np.void]) -> dict[str, Kind]:
    """Return the columns of a structured type, m entries each."""
    fields = {name: table[name] for name in table.names or ()}
    return {f"{part}.{name}": (one.base, ("m", *one.shape)) for name, one in fields.items()}


ARRAYS: dict[str, Kind] = {
    "t": (FLOAT, ("n",)),
    "q": (FLOAT, ("n", "nq")),
    "v": (FLOAT, ("n", "nv")),
    **_of_type("contacts", ROW),
    "contacts.t": (FLOAT, ("m",)),
    "contacts.row": (LONG, ("m",)),
    **{f"energy.{one.name}": (FLOAT, ("n",)) for one in fields(result_parts.EnergyAudit)},
}
"""By name: the numbers of an array and its shape; a size of the same name is the same in all."""

OPTIONAL: dict[str, dict[str, Kind]] = {
    "sensors": {
        "sensors.sensor": (INT, ("s",)),
        "sensors.t": (FLOAT, ("s",)),
        "sensors.sampled": (FLOAT, ("s",)),
        "sensors.values": (FLOAT, ("w",)),
    },
    "patches": _of_type("patches", result_parts.PATCH),
    "sensitivities": {
        "sensitivities.q": (FLOAT, ("n", "nv", "p")),
        "sensitivities.v": (FLOAT, ("n", "nv", "p")),
        "sensitivities.force_world": (FLOAT, ("m", 3, "p")),
        "sensitivities.normal_force": (FLOAT, ("m", "p")),
        "sensitivities.depth": (FLOAT, ("m", "p")),
    },
    "torque": {"torque": (FLOAT, ("n", "nv"))},
    "states": {"states.values": (FLOAT, ("k",)), "states.sizes": (INT, ("n",))},
}
"""The same of runs that recorded more; other files have none of a group. The header names the p
columns of sensitivities."""

KEPT = "kept."
"""Begins the names of the arrays of `Origin.keep`."""

_IN_FILE = {name: name for part in (ARRAYS, *OPTIONAL.values()) for name in part}
_IN_FILE["contacts.contact_id"] = "contacts.number"
_KEPT_KINDS = (FLOAT, INT, BYTE, np.dtype(bool))


class _Fault(ValueError):
    """What of a file, or of results that are to become one, is not as it must be."""


class _Part(BaseModel):
    """A table of the header; unknown keys are ignored, as a later version may write them."""

    model_config = ConfigDict(strict=True)


class _Origin(_Part):
    scenario: str
    settings: dict[str, object]
    path: str = ""
    kept: dict[str, object] | None = None

    def found_from(self, home: Path) -> str:
        """Return the scenario's name, or its path as seen from a file in the folder `home`."""
        if not self.path:
            return self.scenario
        near = os.path.normpath(home.absolute() / self.scenario)
        return near if os.path.exists(near) else self.path


class Header(_Part):
    """What the file says in JSON."""

    format: Literal[1]
    pairs: list[str]
    stats: RunStats
    events: list[tuple[float, str, EventKind]]
    origin: _Origin | None = None
    sensors: dict[str, list[str]] = {}
    sensitivities: list[str] = []


def save_result(result: Result, path: Path, home: StrPath | None) -> Path:
    """See Result.save."""
    arrays: Columns = {"t": result.t, "q": result.q, "v": result.v}
    for part in ("contacts", "energy"):
        value = getattr(result, part)
        arrays |= {f"{part}.{f.name}": getattr(value, f.name) for f in fields(value)}
    origin = None
    if result.origin is not None:
        home = Path(path.parent if home is None else home)
        origin = _origin_in_file(result.origin, home)
        if result.origin.keep is not None:
            kept = result.origin.keep()
            origin["kept"] = kept.contents
            arrays |= {KEPT + name: array for name, array in kept.arrays.items()}
    header = {
        "pairs": result.pairs,
        "stats": asdict(result.stats),
        "events": [[e.t, e.pair, e.kind] for e in result.events],
        "origin": origin,
    }
    if result.sensors:
        header["sensors"] = {name: log.columns for name, log in result.sensors.items()}
        arrays |= dict(zip(OPTIONAL["sensors"], joined_logs(result.sensors), strict=True))
    if result.patch_rows is not None:
        arrays |= {
            f"patches.{name}": result.patch_rows[name] for name in result_parts.PATCH.names or ()
        }
    if result.torque is not None:
        arrays["torque"] = result.torque
    if result.states is not None:
        arrays["states.values"] = np.concatenate([np.zeros(0), *result.states])
        arrays["states.sizes"] = np.array([len(one) for one in result.states], INT)
    rows = result.sensitivities
    if rows is not None:
        header["sensitivities"] = rows.parameters
        for name in OPTIONAL["sensitivities"]:
            arrays[name] = getattr(rows, name.removeprefix("sensitivities."))
    _write(path, header, arrays)
    return path


def _origin_in_file(origin: result_parts.Origin, home: Path) -> dict[str, object]:
    """Return what a file in the folder `home` holds of the scenario that ran."""
    scenario, settings = origin.scenario, origin.settings
    if Path(scenario).suffix != ".toml":
        return {"scenario": scenario, "settings": settings}
    # Results and scenario may move together, or the results alone: both paths are written.
    path = os.path.abspath(scenario)
    near = os.path.relpath(path, home.absolute())
    return {"scenario": near, "settings": settings, "path": path}


def _write(path: Path, header: Mapping[str, object], arrays: Columns) -> None:
    """Write a compressed .npz file, whole or not at all; ResultError where that fails."""
    try:
        text = json.dumps({"format": 1, **header})
        whole = {"header": np.array(text)} | {name: np.asarray(a) for name, a in arrays.items()}
        masked = [name for name, a in arrays.items() if np.ma.isMaskedArray(a)]
        if masked:
            raise _Fault(f"'{masked[0]}' is a masked array: fill it first")
        # What load refuses is not written.
        _check_kinds({name: (a.dtype, a.shape) for name, a in whole.items()}, _wanted(arrays))
        _checked(text, {name: whole[name] for name in arrays})
    except (_Fault, TypeError) as fault:  # the latter: json's
        raise ResultError(path, f"cannot write the results: {fault}") from None
    try:
        with atomic_file(path) as stream:
            named = {_IN_FILE.get(name, name): array for name, array in whole.items()}
            np.savez_compressed(stream, allow_pickle=False, **named)
    except OSError as error:
        raise ResultError(path, f"cannot write the results: {error.strerror}") from error


def load_result(kind: type[Result], path: StrPath, max_size: float) -> Result:
    """See Result.load; `kind` is Result, of which this module knows nothing else."""
    header, arrays = _read_file(path, max_size)

    def part(name: str) -> Columns:
        """Return the arrays of one part, by the names of its fields."""
        return {k.removeprefix(name): a for k, a in arrays.items() if k.startswith(name)}

    patches = None
    if columns := part("patches."):
        patches = np.empty(len(arrays["contacts.row"]), result_parts.PATCH)
        for name, column in columns.items():
            patches[name] = column
        read_only(patches)
    sensitivities = None
    if columns := part("sensitivities."):
        sensitivities = Sensitivities(tuple(header.sensitivities), **columns)
    origin = None
    if header.origin is not None:
        keep = None
        if header.origin.kept is not None:
            keep = partial(result_parts.Kept, header.origin.kept, part(KEPT))
        scenario = header.origin.found_from(Path(path).parent)
        origin = result_parts.Origin(scenario, header.origin.settings, keep)
    return kind(
        t=arrays["t"],
        q=arrays["q"],
        v=arrays["v"],
        pairs=tuple(header.pairs),
        contacts=result_parts.ContactLog(**part("contacts.")),
        events=tuple(result_parts.Event(*e) for e in header.events),
        energy=result_parts.EnergyAudit(**part("energy.")),
        stats=header.stats,
        origin=origin,
        sensors=split_logs(
            {name: tuple(columns) for name, columns in header.sensors.items()},
            *(arrays[name] for name in OPTIONAL["sensors"]),
        )
        if header.sensors
        else {},
        patch_rows=patches,
        sensitivities=sensitivities,
        torque=arrays.get("torque"),
        states=result_parts.split_states(arrays.get("states.values"), arrays.get("states.sizes")),
    )


def _read_file(path: StrPath, max_size: float) -> tuple[Header, Columns]:
    """Return the header and the ARRAYS of the results at `path`.

    Raises
    ------
    ResultError
        The file cannot be read, is none that Result.save wrote, needs more than `max_size` [B] of
        memory, or one of its arrays or a part of its header is not as it must be.
    """
    try:
        with open_regular(path) as file, zipfile.ZipFile(file) as archive:
            return _read(path, archive, max_size)
    except ResultError:
        raise
    except _Fault as fault:
        raise ResultError(path, f"is not a file that Result.save wrote: {fault}") from None
    except OSError as error:
        raise ResultError(path, f"cannot read the results: {error.strerror or error}") from error
    except Exception as error:  # whatever a damaged archive makes zipfile and numpy raise
        why = " ".join(str(error).split()) or type(error).__name__
        raise ResultError(path, f"is not a file that Result.save wrote ({why})") from error


def _read(path: StrPath, archive: zipfile.ZipFile, max_size: float) -> tuple[Header, Columns]:
    files = {one.filename: one for one in archive.infolist()}
    arrays_in = _wanted({name for name, part in _IN_FILE.items() if f"{part}.npy" in files})
    parts = {"header": "header.npy"} | {name: f"{_IN_FILE[name]}.npy" for name in arrays_in}
    for part in files:
        if part.startswith(KEPT) and part.endswith(".npy"):
            parts[part.removesuffix(".npy")] = part
    announced = {
        name: _announced(archive, files[part], name)
        for name, part in parts.items()
        if part in files
    }
    _check_kinds(announced, arrays_in)
    size = sum(files[part].file_size for part in parts.values())
    if size > max_size:
        raise ResultError(
            path,
            f"needs {size:.3g} bytes of memory, more than max_size = {max_size:.3g}: give a "
            "larger max_size to Result.load if you trust the file",
        )
    arrays = {name: _array(archive, files[part]) for name, part in parts.items()}
    return _checked(str(arrays.pop("header")), arrays), arrays


def _wanted(names: Collection[str]) -> Mapping[str, Kind]:
    """Return the arrays that a file must have that has those called `names`."""
    parts = [part for part in OPTIONAL.values() if not part.keys().isdisjoint(names)]
    return {name: kind for part in (ARRAYS, *parts) for name, kind in part.items()}


def _check_kinds(announced: Mapping[str, Announced], wanted: Mapping[str, Kind]) -> None:
    """Raise _Fault unless all arrays are there, of their type and shape."""
    for name in ("header", *wanted):
        if name not in announced:
            raise _Fault(f"it has no array '{name}'")
    text, shape = announced["header"]
    if text.kind != "U" or shape != () or text.itemsize > 4 * LARGEST_HEADER:
        raise _Fault(f"'header' is no text but {text} {shape}")
    if fault := misfit(announced, wanted):
        raise _Fault(fault)
    for name, (kind, _) in announced.items():
        if name.startswith(KEPT) and kind not in _KEPT_KINDS:
            raise _Fault(f"'{name}' holds {kind}")


def _checked(text: str, arrays: Columns) -> Header:
    """Return the header in `text`; _Fault where it or a value of the `arrays` is wrong."""
    header = _header(text)
    _check_values(arrays, len(header.pairs))
    if header.sensors:
        _check_sensors(arrays, header.sensors)
    _check_sensitivities(arrays, header.sensitivities)
    return header


def _announced(archive: zipfile.ZipFile, file: zipfile.ZipInfo, name: str) -> Announced:
    """Return type and shape that an array announces; its bytes must be as many."""
    with archive.open(file) as stream, warnings.catch_warnings():
        warnings.simplefilter("error")  # numpy warns of headers that it would repair
        version = np.lib.format.read_magic(stream)
        if version != (1, 0):
            raise _Fault(f"'{name}' is an array of format {version}")
        shape, _, kind = np.lib.format.read_array_header_1_0(stream)
        if kind.hasobject:
            raise _Fault(f"'{name}' holds Python objects")
        if any(type(n) is not int or n < 0 for n in shape):
            raise _Fault(f"'{name}' has the shape {shape}")
        size = math.prod(shape) * kind.itemsize
        if size != file.file_size - stream.tell():
            raise _Fault(
                f"'{name}' announces {size} bytes and has {file.file_size - stream.tell()}"
            )
    return kind, shape


def _array(archive: zipfile.ZipFile, file: zipfile.ZipInfo) -> NDArray[np.generic]:
    with archive.open(file) as stream:
        array: NDArray[np.generic] = np.lib.format.read_array(stream, allow_pickle=False)
        stream.read(1)  # at its end, the sum of the bytes is checked
    array.setflags(write=False)
    return array


def _header(text: str) -> Header:
    try:
        header = Header.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(["header", *map(str, first["loc"])])
        raise _Fault(f"{where}: {first['msg']}") from None
    known, joints = set(header.pairs), set(header.stats.joints)
    if len(known) < len(header.pairs) or not known >= set(header.stats.pairs):
        raise _Fault(f"header.pairs does not list each pair once: {header.pairs}")
    if unknown := {name for _, name, _ in header.events} - joints - known:
        raise _Fault(f"header.events names '{min(unknown)}', neither a pair nor a joint")
    return header


def _check_values(arrays: Columns, pairs: int) -> None:
    for name, least, most in (
        ("contacts.row", 0, len(arrays["t"]) - 1),
        ("contacts.pair", 0, pairs - 1),
        ("contacts.element", -1, np.iinfo(INT).max),
        ("contacts.feature", 0, 3),
    ):
        wrong = np.flatnonzero((arrays[name] < least) | (arrays[name] > most))
        if wrong.size:
            value = arrays[name][wrong[0]]
            raise _Fault(f"'{name}'[{wrong[0]}] is {value}, not from {least} to {most}")
    for name in ("t", "contacts.row"):
        # Also true of numbers that are not finite.
        falls = np.flatnonzero(~(np.diff(arrays[name]) >= 0))
        if falls.size or not np.isfinite(arrays[name]).all():
            raise _Fault(f"'{name}' does not rise at row {falls[0] if falls.size else 0}")


def _check_sensors(arrays: Columns, sensors: Mapping[str, list[str]]) -> None:
    if "sensors.t" not in arrays:
        raise _Fault("it has no array 'sensors.t'")
    which = arrays["sensors.sensor"]
    if which.size and not (which.min() >= 0 and which.max() < len(sensors)):
        raise _Fault(f"'sensors.sensor' is not from 0 to {len(sensors) - 1}")
    widths = np.array([len(columns) for columns in sensors.values()])
    wanted = int(widths[which].sum())
    if wanted != arrays["sensors.values"].size:
        found = arrays["sensors.values"].size
        raise _Fault(f"'sensors.values' has {found} values, its readings {wanted}")


def _check_sensitivities(arrays: Columns, names: list[str]) -> None:
    rows = arrays.get("sensitivities.q")
    if rows is None and names:
        raise _Fault("it has no array 'sensitivities.q'")
    columns = 0 if rows is None else rows.shape[-1]
    if columns != len(names) or len(set(names)) < len(names):
        raise _Fault(f"header.sensitivities does not name each of {columns} columns once: {names}")
