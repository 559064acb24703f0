"""Tables of parameters, from the classes that describe them, as Markdown."""

import dataclasses
from typing import Any

import sphshell_pin as sp
from sphshell_pin.base.parameters import parameters_of, type_name
from sphshell_pin.scenario.format import shape_tables as primitives


def kinds(name: str) -> str:
    """Return what a scenario file may state of the family of a class."""
    family = _class(name).kinds
    return "| `type` | keys |\n|---|---|\n" + "".join(map(row, family.values()))


def parameters(name: str) -> str:
    """Return the parameters of a class: name, unit, default, meaning."""
    kind = _class(name)
    lines = [f"| parameter of `{kind.__name__}` | unit | default | meaning |", "|---|---|---|---|"]
    about = parameters_of(kind)
    for one in dataclasses.fields(kind):
        if one.name in about:
            unit = about[one.name].general_unit or ("1" if type_name(one) == "float" else "")
            lines.append(f"| `{one.name}` | {unit} | {default_of(one)} | {about[one.name].help} |")
    return "\n".join(lines) + "\n"


def _class(name: str) -> Any:
    return getattr(sp, name, None) or getattr(primitives, name)


def row(kind: Any) -> str:
    """Return the keys of a type; those that must be given are bold."""
    keys, about = [], parameters_of(kind)
    for one in dataclasses.fields(kind):
        if one.name in about:
            mark = "**" if one.default is dataclasses.MISSING else ""
            default, unit = default_of(one), about[one.name].general_unit
            tail = (f" = {default}" if default else "") + (f" [{unit}]" if unit else "")
            keys.append(f"{mark}`{one.name}`{mark}{tail}")
    return f"| `{kind.kind}` | {', '.join(keys)} |\n"


def default_of(one: dataclasses.Field[Any]) -> str:
    """Return a default as a file states it; "" where there is none."""
    default = one.default
    if default is dataclasses.MISSING or default is None:
        return ""
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, tuple):
        # In code: Markdown takes [m] behind brackets for a link.
        return f"`[{', '.join(f'{number:g}' for number in default)}]`"
    return f"{default:g}" if isinstance(default, int | float) else f'"{default}"'
