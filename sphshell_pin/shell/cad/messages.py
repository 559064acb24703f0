"""Messages between a process and its CAD child: one .npz archive with arrays and JSON.

Nothing is pickled: a child in which OpenCASCADE has gone wrong may send anything, and reading that
must neither execute it nor take it for a surface. The archive has a checksum of every part.
"""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sphshell_pin.shell.cad.options import CadOptions
from sphshell_pin.shell.cleaning import CleanedSurface
from sphshell_pin.shell.health import ShellHealth

ALIVE = b"alive"
"""What a child sends in the middle of a long job: the limit of time begins anew."""

_RECORDS: dict[str, Any] = {one.__name__: one for one in (CadOptions, CleanedSurface, ShellHealth)}


def pack(value: Any) -> bytes:
    """Return a message of None, numbers, texts, paths, arrays, records, and tuples of these."""
    arrays: dict[str, Any] = {}
    text = json.dumps(_plain(value, arrays))
    buffer = io.BytesIO()
    np.savez(buffer, text=np.frombuffer(text.encode(), np.uint8), **arrays)
    return buffer.getvalue()


def unpack(message: bytes) -> Any:
    """Return the value of a message; lists come back as tuples.

    Raises
    ------
    ValueError
        If the message is damaged.
    """
    try:
        with np.load(io.BytesIO(message), allow_pickle=False) as archive:
            parts = dict(archive)
        return _value(json.loads(parts["text"].tobytes()), parts)
    except (ValueError, KeyError, TypeError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"a message of the CAD child is damaged ({error})") from error


def _plain(value: Any, arrays: dict[str, Any]) -> Any:
    """Return what JSON can hold of a value, and put its arrays among the others."""
    if isinstance(value, np.ndarray):
        name = f"array_{len(arrays)}"
        arrays[name] = value
        return {"array": name}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return {"path": str(value)}
    if isinstance(value, (tuple, list)):
        return [_plain(one, arrays) for one in value]
    kind = type(value).__name__
    if kind in _RECORDS:
        held = {one.name: _plain(getattr(value, one.name), arrays) for one in fields(value)}
        return {kind: held}
    if isinstance(value, (str, int, float, type(None))):
        return value
    raise TypeError(f"{kind} cannot be sent to or from the CAD child")


def _value(plain: Any, arrays: dict[str, Any]) -> Any:
    if isinstance(plain, list):
        return tuple(_value(one, arrays) for one in plain)
    if not isinstance(plain, dict):
        return plain
    ((kind, held),) = plain.items()
    if kind == "array":
        return arrays[held]
    if kind == "path":
        return Path(held)
    return _RECORDS[kind](**{name: _value(one, arrays) for name, one in held.items()})
