"""The command line: parses, calls, prints. Each module holds a group of commands."""

# Imported for their commands, in the order of the help.
# isort: off
from sphshell_pin.cli import new, running, view, render, export, compare, taxels  # noqa: F401
from sphshell_pin.cli import files, sweep, fit, report  # noqa: F401
from sphshell_pin.cli import check_robot, listing  # noqa: F401

# isort: on
from sphshell_pin.cli.app import app, main

__all__ = ["app", "main"]
