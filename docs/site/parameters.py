"""A hook of MkDocs: tables of parameters, from the classes that describe them.

`<!-- parameters: ImpactLaw -->` stands for the parameters of a class, and
`<!-- kinds: ImpactLaw -->` for what a scenario file may state of its family.
"""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import sphshell_pin as sp
from sphshell_pin.parameters import parameters_of
from sphshell_pin.scenario.format import shape_tables as primitives

# Annotations of parameters that are numbers; see sphshell_pin.parameters.
NUMBERS = ("float", "Named")
MARK = re.compile(r"^<!-- (parameters|kinds): (\w+) -->$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the marks of a page; a class that is not there is an error of the build."""
    return MARK.sub(lambda found: shown(found[1], found[2]), markdown)


def shown(what: str, name: str) -> str:
    """Return what stands for a mark, as Markdown."""
    kind = getattr(sp, name, None) or getattr(primitives, name)
    if what == "parameters":
        return table(kind)
    return "| `type` | keys |\n|---|---|\n" + "".join(map(row, kind.kinds.values()))


def table(kind: Any) -> str:
    """Return the parameters of a class: name, unit, default, meaning."""
    lines = [f"| parameter of `{kind.__name__}` | unit | default | meaning |", "|---|---|---|---|"]
    about = parameters_of(kind)
    for one in dataclasses.fields(kind):
        if one.name in about:
            unit = about[one.name].general_unit or ("1" if one.type in NUMBERS else "")
            lines.append(f"| `{one.name}` | {unit} | {default_of(one)} | {about[one.name].help} |")
    return "\n".join(lines) + "\n"


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
