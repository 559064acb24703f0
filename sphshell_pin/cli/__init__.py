"""The command line: parses, calls, prints. Each module holds a group of commands."""

# Imported for their commands, in the order of the help.
# isort: off
from sphshell_pin.cli import new, running, view, render, export, compare, taxels  # noqa: F401
from sphshell_pin.cli import files, sweep, fit, report  # noqa: F401
from sphshell_pin.cli import check_robot, listing  # noqa: F401

# isort: on
from sphshell_pin.cli.app import app, main

# Typer keeps the line ends of all paragraphs but the first: the help would break at two widths.
for _command in app.registered_commands:
    _paragraphs = (getattr(_command.callback, "__doc__", None) or "").split("\n\n")
    _command.help = "\n\n".join(" ".join(one.split()) for one in _paragraphs)

__all__ = ["app", "main"]
