"""Names of numbers: the same for files, sliders, sweeps, fits, `vary` and derivatives.

A name is the path of fields that leads to a number: "tip.law.young" is the field `young` of the law
of the contact "tip". In files it stands behind the name of its table, "contact.tip.law.young"; a
scene takes that spelling, too.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from sphshell_pin.base.parameters import Component, parameters_of, type_name
from sphshell_pin.errors import InvalidParameter, NameNotFound

AXES = ("x", "y", "z")
TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
START = ("q0", "v0")

# What stands before a name in files, and what stands there in a scene.
_TABLES = {"contact.": "", "source.": "", "sensor.": "sensors."}


@dataclass(frozen=True)
class NamedNumber:
    """What a name leads to: the fields `path` of number `at` of the pairs, or of the sensors."""

    at: int
    path: tuple[str, ...]
    shape: tuple[int, ...] | None = ()
    """Shape of a value; None where it is an object (a law), or an integer or None (a seed)."""
    ends: tuple[str, ...] | None = ("",)
    """What its columns in derivatives are called behind the name; None if it has none."""


# What the names of a scene lead to.
Names = Mapping[str, NamedNumber]


def names_of_pairs(pairs: Iterable[Any]) -> dict[str, NamedNumber]:
    """Return what can be said of the pairs of a scene, by name: their numbers, laws, placements."""
    return {
        f"{pair.name}.{name}": one
        for at, pair in enumerate(pairs)
        for name, one in _of_pair(at, pair)
    }


def names_of_sensors(sensors: Iterable[Any]) -> dict[str, NamedNumber]:
    """Return the numbers of sensors, by name."""
    return {
        f"sensors.{sensor.name}.{field.name}": NamedNumber(at, (field.name,), None, None)
        for at, sensor in enumerate(sensors)
        for field in fields(sensor)
        if field.name in parameters_of(sensor)
        and type_name(field) in ("float", "float | None", "int")
    }


def names_of_start(nv: int) -> dict[str, NamedNumber]:
    """Return the two halves of a start: q0, by its tangent space, and v0, of nv numbers each."""
    ends = tuple(f".{k}" for k in range(nv))
    return {name: NamedNumber(at, (name,), (nv,), ends) for at, name in enumerate(START)}


def _of_pair(at: int, pair: Any) -> Iterator[tuple[str, NamedNumber]]:
    for part, path in pair.parts.items():
        if part == "placement":
            yield part, NamedNumber(at, path, None, tuple(f".{one}" for one in TWIST))
        elif part in ("law", "friction"):
            yield part, NamedNumber(at, path, None, None)
            whole = getattr(pair, part)
            for name in parameters_of(whole):
                if isinstance(getattr(whole, name), float):
                    yield f"{part}.{name}", NamedNumber(at, (*path, name))
        else:
            ends = tuple(f".{one}" for one in AXES)
            yield f"{part}.radius", NamedNumber(at, (*path, "radius"))
            yield f"{part}.offset", NamedNumber(at, (*path, "offset"), (3,), ends)


def find_name(name: str, known: Names, kind: str = "parameter") -> str:
    """Return which of the `known` names is meant: itself, or its spelling in files.

    Raises NameNotFound for another one, which says that there is no such `kind`.
    """
    for one in _spellings(name):
        if one in known:
            return one
    raise NameNotFound(kind, name, "the scene", known)


def _spellings(name: str) -> list[str]:
    inner = (now + name.removeprefix(t) for t, now in _TABLES.items() if name.startswith(t))
    return [name, *inner]


def columns_of(names: object, known: Names, argument: str = "parameters") -> tuple[str, ...]:
    """Return the columns that the derivatives by `names` have, in their order.

    A name of several numbers gives a column for each, "tip.placement" six; one of them can be named
    alone, "tip.sphere.offset.z", or as files do, "tip.sphere.offset.2".

    Raises InvalidParameter for what are no names and for one given twice, NameNotFound for another.
    """
    if isinstance(names, str | bytes) or not isinstance(names, Iterable):
        raise InvalidParameter(argument, names, "must be names, as ['PAIR.law.stiffness']")
    differentiable = {name: one for name, one in known.items() if one.ends is not None}
    columns = {name: [name + end for end in one.ends or ()] for name, one in differentiable.items()}
    # One of several, by the name of its column or by its place.
    single = {
        spelled: [column]
        for name, several in columns.items()
        for k, column in enumerate(several)
        for spelled in (column, f"{name}.{k}")[: len(several)]
    }
    found: list[str] = []
    for name in map(str, names):
        one = next((single[one] for one in _spellings(name) if one in single), None)
        for column in one or columns[find_name(name, differentiable)]:
            if column in found:
                raise InvalidParameter(argument, column, "must not be named twice")
            found.append(column)
    return tuple(found)


def every_column(known: Names) -> dict[str, tuple[NamedNumber, int]]:
    """Return all columns of derivatives: of which number they are, and the place in it."""
    return {
        name + end: (one, k) for name, one in known.items() for k, end in enumerate(one.ends or ())
    }


def with_value(whole: Any, path: tuple[str, ...], value: object) -> Any:
    """Return `whole` with `value` at the end of the fields `path`.

    Raises InvalidParameter for a field that is not there, and for a value that it cannot have.
    """
    first, *rest = path
    if not hasattr(whole, first):
        raise InvalidParameter(first, value, f"is not a number of {whole!r}")
    inner = with_value(getattr(whole, first), tuple(rest), value) if rest else value
    new = {first: inner}
    return whole.changed(**new) if isinstance(whole, Component) else replace(whole, **new)
