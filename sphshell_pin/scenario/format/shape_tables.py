"""Primitive shapes that a scenario states by their sizes."""

import dataclasses
import functools
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Annotated, TypedDict, Unpack

import coal
import numpy as np
import pydantic
from pydantic_core import CoreSchema, PydanticCustomError

from sphshell_pin.base.parameters import Component, parameter, parameters_of
from sphshell_pin.errors import did_you_mean
from sphshell_pin.shell import Shell

Positive = Annotated[float, pydantic.Field(gt=0, allow_inf_nan=False)]
Vector3 = Annotated[list[float], pydantic.Field(min_length=3, max_length=3)]
Lengths3 = Annotated[list[Positive], pydantic.Field(min_length=3, max_length=3)]


def refuse_unknown_keys(table: Mapping[str, object], valid: Sequence[str]) -> None:
    """Raise an error of pydantic that lists the valid keys of a table."""
    for key, value in table.items():
        if key not in valid:
            hint = did_you_mean(str(key), valid)
            said = f"unknown key; {hint}{hint and ' '}valid keys: {', '.join(valid) or 'none'}"
            context = {"said": said, "key": key, "value": value}
            raise PydanticCustomError("unknown_key", "{said}", context)


@dataclass(frozen=True)
class OneOf:
    """Annotation of a table that states one of a `family`; its key `type` says which."""

    family: type[Component]

    def __get_pydantic_core_schema__(
        self, source: object, handler: pydantic.GetCoreSchemaHandler
    ) -> CoreSchema:
        """Build what reads and writes such tables."""
        kinds = self.family.kinds
        members = [
            Annotated[
                kind,
                pydantic.BeforeValidator(functools.partial(_without_type, kind)),
                pydantic.Tag(name),
            ]
            for name, kind in kinds.items()
        ]
        either = functools.reduce(operator.or_, members)
        known = pydantic.BeforeValidator(functools.partial(_check_kind, tuple(kinds)))
        return handler.generate_schema(
            Annotated[
                either, pydantic.Discriminator(_kind_of), known, pydantic.PlainSerializer(_to_table)
            ]
        )


def _kind_of(value: object) -> object:
    return value.get("type") if isinstance(value, Mapping) else getattr(value, "kind", None)


def _check_kind(kinds: Sequence[str], value: object) -> object:
    kind = _kind_of(value)
    if kind in kinds:
        return value
    what = "type is missing" if kind is None else f"unknown type '{kind}'"
    said = f"{what}; valid types: {', '.join(kinds)}"
    raise PydanticCustomError("unknown_type", "{said}", {"said": said})


def _without_type(kind: type[Component], value: object) -> object:
    """Take the key `type` off a table; refuse keys that no file may state."""
    if not isinstance(value, dict):
        return value
    table = {k: v for k, v in value.items() if k != "type"}
    refuse_unknown_keys(table, list(parameters_of(kind)))
    return table


def _to_table(value: Component, info: pydantic.SerializationInfo) -> dict[str, object]:
    """Return the table that states `value`, without defaults where these may be left out."""
    table: dict[str, object] = {"type": value.kind}
    for one in dataclasses.fields(value):
        given = getattr(value, one.name)
        if one.name in parameters_of(value) and not (info.exclude_unset and given == one.default):
            table[one.name] = _plain(given)
    return table


def _plain(value: object) -> object:
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return dict(value) if isinstance(value, Mapping) else value


class ShellOptions(TypedDict):
    """What a shell of a primitive takes besides its sizes."""

    chord_error: float | None
    segments: int | None
    side: str
    crease_angle: float
    name: str


class Primitive(Component):
    """Base of the shapes that a scenario states by their sizes; centered, axes along z."""

    def shell(self, **options: Unpack[ShellOptions]) -> Shell:
        """Return its surface."""
        return Shell.from_geometry(self.geometry(), **options)

    def geometry(self) -> coal.ShapeBase:
        """Return it as Coal has it: its class takes the sizes in the order of the fields."""
        shape = getattr(coal, type(self).__name__)
        return shape(*np.hstack([getattr(self, one.name) for one in fields(self)]))


@dataclass(frozen=True)
class Box(Primitive, kind="box"):
    """A box.

    Parameters
    ----------
    size : edge lengths along x, y, z
    """

    size: Lengths3 = parameter(unit="m")


@dataclass(frozen=True)
class Ball(Primitive, kind="sphere"):
    """A ball.

    Parameters
    ----------
    radius : radius
    """

    radius: float = parameter(above=0, unit="m")

    def geometry(self) -> coal.Sphere:
        """Return it as Coal has it."""
        return coal.Sphere(self.radius)


@dataclass(frozen=True)
class _Round(Primitive):
    """What all of them have.

    Parameters
    ----------
    radius : radius
    length : length along z, of a capsule without caps
    """

    radius: float = parameter(above=0, unit="m")
    length: float = parameter(above=0, unit="m")


@dataclass(frozen=True)
class Cylinder(_Round, kind="cylinder"):
    """A cylinder."""


@dataclass(frozen=True)
class Capsule(_Round, kind="capsule"):
    """A capsule."""


@dataclass(frozen=True)
class Cone(_Round, kind="cone"):
    """A cone."""


@dataclass(frozen=True)
class Ellipsoid(Primitive, kind="ellipsoid"):
    """An ellipsoid.

    Parameters
    ----------
    radii : half axes along x, y, z
    """

    radii: Lengths3 = parameter(unit="m")


@dataclass(frozen=True)
class HalfSpace(Primitive, kind="half-space"):
    """A square in the plane z = 0, facing +z.

    Parameters
    ----------
    extent : edge length
    """

    extent: float = parameter(10.0, above=0, unit="m")

    def shell(self, **options: Unpack[ShellOptions]) -> Shell:
        """Return its surface."""
        plane = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        return Shell.from_geometry(plane, extent=self.extent, **options)
