"""Writes docs/commands.md from the help of the command line: `python docs/site/commands.py`."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import typer

from sphshell_pin.cli import app

PAGE = Path(__file__).parents[1] / "commands.md"
HEAD = """\
# Command line

Every command has `--help`; `--debug` before the command shows the traceback of an error.

| exit code | meaning |
|---|---|
| 0 | fine |
| 1 | an expected figure was missed, or a part of what was asked for failed |
| 2 | an error, reported in one sentence |
| 130 | interrupted; what was computed until then is kept |

This page is written by `python docs/site/commands.py`, from the help texts.
"""


def page() -> str:
    """Return the whole page."""
    group: Any = typer.main.get_command(app)
    return "\n".join([HEAD, *(_section(name, one) for name, one in group.commands.items())])


def _section(name: str, command: Any) -> str:
    text = inspect.cleandoc(command.callback.__doc__)
    paragraphs = [" ".join(one.split()) for one in text.split("\n\n")]
    examples = [one for one in paragraphs if one.startswith("Example: ")]
    told = [one for one in paragraphs if one not in examples]
    lines = [f"## {name}", "", "\n\n".join(told), ""]
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


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)
