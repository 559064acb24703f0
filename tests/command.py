"""The command, called in this process."""

from click.testing import Result
from typer.testing import CliRunner

from sphshell_pin.cli import app


def call(*arguments: object) -> Result:
    """Return what the command `sphshell-pin` prints with these arguments, and its exit code."""
    return CliRunner().invoke(app, [str(one) for one in arguments])
