"""Tables of a scenario file whose key `type` says which class of a family they state."""

import dataclasses
import functools
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    PlainSerializer,
    SerializationInfo,
    Tag,
)
from pydantic_core import CoreSchema, PydanticCustomError

from sphshell_pin.base.parameters import Component, parameters_of
from sphshell_pin.errors import did_you_mean

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Vector3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Lengths3 = Annotated[list[Positive], Field(min_length=3, max_length=3)]


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
        self, source: object, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Build what reads and writes such tables."""
        kinds = self.family.kinds
        members = [
            Annotated[kind, BeforeValidator(functools.partial(_without_type, kind)), Tag(name)]
            for name, kind in kinds.items()
        ]
        either = functools.reduce(operator.or_, members)
        known = BeforeValidator(functools.partial(_check_kind, tuple(kinds)))
        return handler.generate_schema(
            Annotated[either, Discriminator(_kind_of), known, PlainSerializer(_to_table)]
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


def _to_table(value: Component, info: SerializationInfo) -> dict[str, object]:
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
