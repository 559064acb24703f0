"""One description of every component: the fields of its dataclass say everything about it.

Laws, friction, integrators and controllers are frozen dataclasses whose fields are made by
`parameter`. From these follow the checks, the tables of scenario files (pydantic reads the same
dataclasses and bounds), the labels, units and ranges of parameters that are varied, and the tables
of the documentation.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_finite, check_type
from sphshell_pin.errors import InvalidParameter

_KEY = "parameter"
# A field of the object in a unit, as in "N/m^{0.exponent:g}".
_IN_UNIT = re.compile(r"\{0\.(\w+)[^}]*\}")
_ENTRY = re.compile(r"^(\w+)(.*?) : (.*(?:\n +.*)*)", re.MULTILINE)


@dataclass(frozen=True)
class Parameter:
    """What is known of a parameter but its name, type and default."""

    unit: str = ""
    """Unit; "" for a pure number. `{0.exponent:g}` stands for a field of the object."""
    label: str = ""
    """A few words, as on a slider; by default its name."""
    help: str = ""
    """Meaning, in one line."""
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None

    @property
    def bounds(self) -> dict[str, float]:
        """Bounds as pydantic names them."""
        all_ = {"gt": self.above, "ge": self.at_least, "le": self.at_most}
        return {name: value for name, value in all_.items() if value is not None}

    @property
    def general_unit(self) -> str:
        """Unit with the names of the fields that it depends on: "N/m^exponent"."""
        return _IN_UNIT.sub(r"\1", self.unit)

    def check(self, name: str, value: object) -> float:
        """Return `value` as a float; raise InvalidParameter unless it lies within the bounds."""
        number = check_finite(name, value)
        low = self.above if self.above is not None else self.at_least
        inside = (
            (self.above is None or number > self.above)
            and (self.at_least is None or number >= self.at_least)
            and (self.at_most is None or number <= self.at_most)
        )
        if inside:
            return number
        unit = f" [{self.general_unit}]" if self.unit else ""
        if self.at_most is not None:
            bracket = "[" if self.above is None else "("
            raise InvalidParameter(
                name, value, f"must lie in {bracket}{low:g}, {self.at_most:g}]{unit}"
            )
        if low:
            word = "be more than" if self.above is not None else "be at least"
            raise InvalidParameter(name, value, f"must {word} {low:g}{unit}")
        must = "must be positive" if self.above is not None else "must not be negative"
        raise InvalidParameter(name, value, must + unit)


def parameter(
    default: object = MISSING,
    *,
    unit: str = "",
    help: str = "",
    label: str = "",
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    **more: object,
) -> Any:
    """Return the field of a dataclass that is a parameter.

    The bounds hold for numbers; `more` is what pydantic takes for the field in a file
    (`min_length`). A field that is not made by this function cannot be stated in a file. Without
    `help` its meaning stands in the section "Parameters" of the docstring of a Component.
    """
    about = Parameter(unit, label, help, above, at_least, at_most)
    return field(default=default, metadata=_metadata(about) | about.bounds | more)


def _metadata(about: Parameter) -> dict[str, object]:
    """Return what a field holds; pydantic reads the description there, too, and the bounds."""
    return {_KEY: about, "description": about.help}


def described(doc: str | None, section: str) -> tuple[str, dict[str, tuple[str, str]]]:
    """Return a docstring without a section, its last one, and what is described there, by name.

    An entry is "name : its meaning", in one line or several; further words may follow the name:
    they come before the meaning.
    """
    text, _, entries = inspect.cleandoc(doc or "").partition(
        f"\n\n{section}\n{'-' * len(section)}\n"
    )
    found = {
        name: (words.strip(), " ".join(help.split()))
        for name, words, help in _ENTRY.findall(entries)
    }
    return text, found


def flat_fields(fields: Mapping[str, ArrayLike]) -> dict[str, Array]:
    """Return the fields of a compiled class as it takes them: flat arrays, in the order of rows."""
    return {name: np.ravel(np.asarray(value, np.float64)) for name, value in fields.items()}


def type_name(one: dataclasses.Field[Any]) -> str:
    """Return the annotation of a field as text, whether its module keeps annotations as text."""
    kind: object = one.type
    return kind.__name__ if isinstance(kind, type) else str(kind)


def same_parameter(kind: type, name: str, default: object = None) -> Any:
    """Return the field of a dataclass that is the parameter `name` of `kind`.

    `default` takes the place of its default, unless it is None.
    """
    (source,) = (one for one in dataclasses.fields(kind) if one.name == name)
    return field(default=source.default if default is None else default, metadata=source.metadata)


def parameters_of(kind: object) -> dict[str, Parameter]:
    """Return the parameters of a dataclass or of one of its objects, by name; {} of others."""
    if not dataclasses.is_dataclass(kind):
        return {}
    found = {f.name: f.metadata[_KEY] for f in dataclasses.fields(kind) if _KEY in f.metadata}
    return found | dict(kind.own_parameters) if isinstance(kind, Component) else found


@dataclass(frozen=True)
class Component:
    """Base of what a scene, a run or a file is composed of.

    A direct subclass is a family (`class NormalLaw(Component)`). A class that belongs to it gives
    its type name in files, `class ImpactLaw(NormalLaw, kind="impact")`. Another way to state one
    names the family that it belongs to, `class Hertz(Component, kind="hertz", of=NormalLaw)`, and
    returns what it states by `_build`; if its kind is taken, files state that kind in this way.
    """

    kind: ClassVar[str] = ""
    """Type name in files and in the compiled core."""
    kinds: ClassVar[dict[str, type[Component]]] = {}
    """What files may state of this family, by type name."""
    # Pydantic's settings for these dataclasses.
    __pydantic_config__: ClassVar[Mapping[str, object]] = {
        "extra": "forbid",
        "allow_inf_nan": False,
        "arbitrary_types_allowed": True,
    }

    def __init_subclass__(cls, *, kind: str = "", of: type[Component] | None = None) -> None:
        """Register the class under its type name."""
        super().__init_subclass__()
        for name, (_, help) in described(vars(cls).get("__doc__"), "Parameters")[1].items():
            made = vars(cls).get(name)
            if isinstance(made, dataclasses.Field) and _KEY in made.metadata:
                about = dataclasses.replace(made.metadata[_KEY], help=help)
                made.metadata = MappingProxyType({**made.metadata, **_metadata(about)})
        if Component in cls.__bases__ and of is None:
            cls.kinds = {}
        if kind:
            cls.kind = kind
            (cls if of is None else of).kinds[kind] = cls

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value that is no number or outside its bounds."""
        for one in dataclasses.fields(self):
            about, value = one.metadata.get(_KEY), getattr(self, one.name)
            if about is None or (value is None and one.default is None):
                continue
            if type_name(one) in ("float", "float | None"):
                object.__setattr__(self, one.name, about.check(one.name, value))
            elif type_name(one) == "bool":
                check_type(one.name, value, bool, "must be True or False")

    def unit_of(self, name: str) -> str:
        """Return the unit of the parameter called `name`; "" for a pure number."""
        return parameters_of(self)[name].unit.format(self)

    @property
    def own_parameters(self) -> Mapping[str, Parameter]:
        """Parameters that this object has besides those of its class."""
        return {}

    def changed(self, **values: object) -> Self:
        """Return this with other values of parameters."""
        return dataclasses.replace(self, **values)

    def _numbers(self) -> list[float]:
        """Return the parameters in their order, as the compiled core takes them."""
        values = (getattr(self, name) for name in parameters_of(self))
        return [math.nan if value is None else float(value) for value in values]

    @property
    def files(self) -> tuple[str, ...]:
        """Files that this names, as it names them: relative to the scenario."""
        return ()

    def _build(self, folder: Path = Path()) -> Any:
        """Return what this states; `folder` is where its files are. By default itself."""
        return self

    def __getstate__(self) -> dict[str, object]:
        """Everything but the C++ binding, which is made again: what pickle and copy take."""
        return {k: v for k, v in self.__dict__.items() if k != "_binding"}
