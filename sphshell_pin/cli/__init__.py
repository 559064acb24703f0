"""The command line: parses, calls, prints. Each module holds a group of commands."""

# Imported for their commands, in the order of the help.
from sphshell_pin.cli import new, running, view, files, sweep, report, check_robot, listing  # noqa: F401, I001
from sphshell_pin.cli.app import app, main

__all__ = ["app", "main"]
