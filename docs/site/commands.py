"""The help of the command line as Markdown."""

from __future__ import annotations

import inspect
import re
from typing import Any

import typer

from sphshell_pin.cli import app


def all_commands() -> str:
    """Return a section for each command."""
    group: Any = typer.main.get_command(app)
    return "\n".join(_section(name, one) for name, one in group.commands.items())


def _section(name: str, command: Any) -> str:
    text = inspect.cleandoc(command.callback.__doc__)
    paragraphs = [" ".join(one.split()) for one in text.split("\n\n")]
    examples = [one for one in paragraphs if one.startswith("Example: ")]
    texts = [one for one in paragraphs if one not in examples]
    lines = [f"## {name}", "", "\n\n".join(texts), ""]
    for one in examples:
        lines += ["```sh", one.removeprefix("Example: "), "```", ""]
    rows = [_row(one) for one in command.params]
    if rows:
        lines += ["| | meaning | default |", "|---|---|---|", *rows, ""]
    return "\n".join(lines)


def _row(parameter: Any) -> str:
    names = [*parameter.opts, *parameter.secondary_opts]
    if not names[0].startswith("-"):
        names = [names[0].upper()]
    elif parameter.metavar:
        names = [f"{one} {parameter.metavar}" for one in names]
    default = parameter.default
    shown = "" if default is None or isinstance(default, bool) else f"`{default}`"
    if parameter.required:
        shown = "required"
    meaning = re.sub(r"\\(?=\[)", "", parameter.help or "")
    meaning = meaning if meaning.endswith("...") else meaning.removesuffix(".")
    return f"| {', '.join(f'`{one}`' for one in names)} | {meaning} | {shown} |"
