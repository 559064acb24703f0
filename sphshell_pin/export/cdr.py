"""Messages as bytes: CDR of the Object Management Group, version 1, as ROS 2 has it on the wire.

Little-endian; a number of n bytes begins at a multiple of n, counted behind the header of 4 bytes;
a string has its length with the closing zero byte in front, an array its number of elements.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.export.messages import DEFINITIONS

Message = Mapping[str, object]
"""Fields by their names; those that are left out are zero or empty.

A message within another one that has equal numbers only, such as a point, may be a sequence of
these, and an array of such messages an array (n, k).
"""

_CODES = {"bool": "?", "uint8": "B", "int32": "i", "uint32": "I", "float32": "f", "float64": "d"}
_HEADER = b"\x00\x01\x00\x00"  # CDR, little-endian, no options


def encode(kind: str, message: Message) -> bytes:
    """Return `message` of the type `kind` (package/Name) as CDR.

    Raises KeyError for a field that the type does not have.
    """
    out = bytearray()
    _write(out, kind, message)
    return _HEADER + bytes(out)


@functools.cache
def _fields(kind: str) -> dict[str, str]:
    """Return the types of the fields of `kind` by their names; constants are none."""
    lines = [line.split(" ") for line in DEFINITIONS[kind].splitlines() if "=" not in line]
    return {name: of for of, name in lines}


@functools.cache
def _flat(kind: str) -> tuple[str, int] | None:
    """Return the type of the numbers that `kind` is made of, and their count, if all are equal."""
    types = list(_fields(kind).values())
    same = len(set(types)) == 1 and types[0] in _CODES
    return (types[0], len(types)) if same else None


def _write(out: bytearray, kind: str, value: object) -> None:
    if not isinstance(value, Mapping):
        flat = _flat(kind)
        if flat is None:
            raise KeyError(f"{kind} is to be given by its fields")
        _write_numbers(out, flat[0], value, flat[1])
        return
    fields = _fields(kind)
    if not value.keys() <= fields.keys():
        raise KeyError(f"{kind} has no field {sorted(value.keys() - fields.keys())}")
    for name, of in fields.items():
        if of.endswith("[]"):
            _write_array(out, of.removesuffix("[]"), value.get(name, ()))
        elif of == "string":
            _write_string(out, str(value.get(name, "")))
        elif of in _CODES:
            _write_numbers(out, of, (value.get(name, 0),), 1)
        else:
            _write(out, of, value.get(name, {}))


def _write_array(out: bytearray, of: str, values: object) -> None:
    assert isinstance(values, Sequence | np.ndarray)
    _write_numbers(out, "uint32", (len(values),), 1)
    if not len(values):  # nothing to align
        return
    flat = (of, 1) if of in _CODES else None if of == "string" else _flat(of)
    if flat is not None and isinstance(values, np.ndarray):
        array: NDArray[np.generic] = np.ascontiguousarray(values, dtype="<" + _CODES[flat[0]])
        if array.size != flat[1] * len(values):
            raise KeyError(f"{of}[] has rows of {flat[1]} numbers")
        _align(out, array.itemsize)
        out += array.tobytes()
    elif of in _CODES:
        _write_numbers(out, of, values, len(values))
    else:
        for one in values:
            if of == "string":
                _write_string(out, one)
            else:
                _write(out, of, one)


def _write_string(out: bytearray, text: str) -> None:
    data = text.encode() + b"\0"
    _write_numbers(out, "uint32", (len(data),), 1)
    out += data


def _write_numbers(out: bytearray, of: str, values: object, count: int) -> None:
    packing = _packing(of, count)
    _align(out, packing.size // count)
    out += packing.pack(*values)  # type: ignore[misc]  # numbers


@functools.cache
def _packing(of: str, count: int) -> struct.Struct:
    return struct.Struct(f"<{count}{_CODES[of]}")


def _align(out: bytearray, size: int) -> None:
    out += bytes(-len(out) % size)
