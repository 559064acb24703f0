"""The help of the command line as Markdown."""

from collections.abc import Iterator
from typing import Any

import typer

from sphshell_pin.base.parameters import described
from sphshell_pin.cli import app


def all_commands() -> str:
    """Return a section for each command."""
    group: Any = typer.main.get_command(app)
    return "\n".join(_section(name, one) for name, one in group.commands.items())


def _section(name: str, command: Any) -> str:
    text, _ = described(command.callback.__doc__, "Options")
    paragraphs = [" ".join(one.split()) for one in text.split("\n\n")]
    examples = [one for one in paragraphs if one.startswith("Example: ")]
    texts = [one for one in paragraphs if one not in examples]
    lines = [f"## {name}", "", "\n\n".join(texts), ""]
    for one in examples:
        lines += ["```sh", one.removeprefix("Example: "), "```", ""]
    arguments = [_names(one) for one in command.params if not one.opts[0].startswith("-")]
    options = [_names(one) for one in command.params if one.opts[0].startswith("-")]
    texts = [f"{what}: {', '.join(some)}." for what, some in _kinds(arguments, options) if some]
    return "\n".join([*lines, *texts, ""])


def _kinds(arguments: list[str], options: list[str]) -> Iterator[tuple[str, list[str]]]:
    yield ("Arguments" if len(arguments) > 1 else "Argument"), arguments
    yield "Options", options


def _names(parameter: Any) -> str:
    """Return the names of an argument or option; a required option is bold."""
    names = [*parameter.opts, *parameter.secondary_opts]
    if not names[0].startswith("-"):
        return f"`{names[0].upper()}`"
    text = "`" + "`/`".join(names) + "`"
    return f"**{text}**" if parameter.required else text
