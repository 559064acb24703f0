"""Surfaces of CAD files kept in the cache: a file that was read once needs OpenCASCADE no more."""

from __future__ import annotations

import hashlib
import io
import itertools
import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base import regular_file
from sphshell_pin.base.cache import cache_folder, is_own, keep_newest, mark_used, write_own
from sphshell_pin.errors import UnitWarning
from sphshell_pin.shell.cad.options import PACKAGE, CadOptions
from sphshell_pin.shell.cleaned import ARRAYS, AnyArray, CleanedSurface, check_arrays
from sphshell_pin.shell.health import ShellHealth
from sphshell_pin.shell.readers.text import read_bytes

MOST_BYTES = 500_000_000
"""Size of all surfaces together; those used longest ago go."""

_ALWAYS = ("vertices", "elements", "triangles", "triangle_element", "source_element")
_DIGEST = hashlib.blake2b().digest_size

Read = tuple[CleanedSurface, str, float]
"""A surface [m], the unit taken, and meters per unit of the file."""


@dataclass(frozen=True)
class KeptSurface:
    """Where in the cache the surface of a file is kept, or would be; None: nowhere."""

    path: Path | None

    @classmethod
    def of(cls, file: Path, options: CadOptions, arguments: Sequence[object]) -> KeptSurface:
        """Return the place for `file` as it is, read with `options` and `arguments`."""
        folder = cache_folder("surfaces")
        data = read_bytes(file) if folder is not None else b""
        if folder is None or b"DOCUMENT_FILE" in data:  # it refers to other files
            return cls(None)
        asked = {**asdict(options), "time_limit": None, "memory_limit": None}
        digest = hashlib.blake2b(data, digest_size=32)
        digest.update(repr((file.name, sorted(asked.items()), arguments, _versions())).encode())
        return cls(folder / f"{digest.hexdigest()}.npz")

    def load(self) -> tuple[Read, list[str]] | None:
        """Return what was saved, with the texts of warnings; None if nothing, or not that."""
        if self.path is None or not is_own(self.path):
            return None
        try:
            whole = regular_file.read_bytes(self.path)
            content = memoryview(whole)[_DIGEST:]
            if hashlib.blake2b(content).digest() != whole[:_DIGEST]:
                return None
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            told = json.loads(arrays.pop("told").tobytes())
            surface = _surface(
                arrays, tuple(told["face_names"]), _health(told["health"]), float(told["rounding"])
            )
            found = surface, str(told["unit"]), float(told["factor"])
        except (OSError, ValueError, KeyError, TypeError, EOFError):  # InvalidShell is a ValueError
            return None
        mark_used(self.path)
        return found, [str(text) for text in told["warnings"]]

    def save(self, read: Read, heard: Sequence[Warning]) -> None:
        """Keep what was read, unless warnings were heard that are not of its unit."""
        if self.path is None or any(type(one) is not UnitWarning for one in heard):
            return
        surface, unit, factor = read
        arrays = {k: v for k in ARRAYS if (v := getattr(surface, k)) is not None}
        told = {
            "unit": unit,
            "factor": factor,
            "rounding": surface.rounding,
            "face_names": surface.face_names,
            "health": asdict(surface.health),
            "warnings": [str(one) for one in heard],
        }
        text = np.frombuffer(json.dumps(told).encode(), np.uint8)
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, told=text, **arrays)
        content = buffer.getvalue()
        try:
            write_own(self.path, hashlib.blake2b(content).digest() + content)
        except OSError:
            return  # a full disk: it is read again next time
        keep_newest(self.path.parent, MOST_BYTES)


def _surface(
    arrays: dict[str, AnyArray], names: tuple[str, ...], health: ShellHealth, rounding: float
) -> CleanedSurface:
    """Return the surface; InvalidShell, TypeError or ValueError if the arrays are of none."""
    given = {name: arrays[name] for name in ARRAYS if name in arrays}
    check_arrays(given, ARRAYS, _ALWAYS)
    limits = {
        "elements": (-1, len(given["vertices"])),
        "triangles": (0, len(given["vertices"])),
        "triangle_element": (0, len(given["elements"])),
        "element_face": (-1, len(names)),
    }
    for name, array in given.items():
        least, end = limits.get(name, (-np.inf, np.inf))
        if not (np.isfinite(array).all() and (array >= least).all() and (array < end).all()):
            raise ValueError(name)
    return CleanedSurface(**given, health=health, face_names=names, rounding=rounding)


def _health(values: dict[str, object]) -> ShellHealth:
    # JSON has lists for tuples.
    right = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
    return ShellHealth(**right)  # type: ignore[arg-type]  # TypeError if a name is another one


def _versions() -> tuple[object, ...]:
    """Return what the surface of a file depends on besides: the code that reads and cleans it."""
    folder = Path(__file__).parents[2]
    parts = folder.glob("*.py"), (folder / "base").rglob("*.py"), (folder / "shell").rglob("*.py")
    code = [*itertools.chain(*parts), Path(_core.__file__)]
    about = [
        (path.name, found.st_size, found.st_mtime_ns)
        for path in sorted(code)
        if (found := os.stat(path))
    ]
    try:
        kernel = version(PACKAGE)
    except PackageNotFoundError:
        kernel = ""
    return kernel, np.__version__, about
