"""The command, called in this process."""

from click.testing import Result
from typer.testing import CliRunner

from sphshell_pin.cli import app


def call(*arguments: object) -> Result:
    """Return what the command `sphshell-pin` prints with these arguments, and its exit code."""
    return CliRunner().invoke(app, [str(one) for one in arguments])


def succeed(*arguments: object) -> Result:
    """Return what a command prints that ends with exit code 0."""
    told = call(*arguments)
    assert told.exit_code == 0, told.output
    return told


def refused(*arguments: object) -> str:
    """Return the one sentence on stderr of a command that fails with exit code 2."""
    told = call(*arguments)
    assert (told.exit_code, told.stdout) == (2, ""), told.output
    assert told.stderr.count("\n") == 1
    assert "Traceback" not in told.output
    return told.stderr
