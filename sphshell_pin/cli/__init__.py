"""The command line: parses, calls, prints. Each module holds a group of commands."""

# Imported for their commands, in the order of the help.
# isort: off
from sphshell_pin.cli import new, running, view, export, compare  # noqa: F401
from sphshell_pin.cli import files, sweep, fit, report  # noqa: F401
from sphshell_pin.cli import check_robot  # noqa: F401

# isort: on
from sphshell_pin.cli.common import app, main

__all__ = ["app", "main"]
