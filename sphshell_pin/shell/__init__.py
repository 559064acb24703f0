"""A clean shell from a file, from arrays or from a geometry, and the record of its cleaning."""

from typing import TYPE_CHECKING

from sphshell_pin.shell.cleaned import CleanedSurface
from sphshell_pin.shell.faces import Face
from sphshell_pin.shell.health import ShellHealth
from sphshell_pin.shell.queries import ClosestPoints
from sphshell_pin.shell.shell import Shell

if TYPE_CHECKING:
    from sphshell_pin.shell.cleaning import clean

__all__ = ["CleanedSurface", "ClosestPoints", "Face", "Shell", "ShellHealth", "clean"]


def __getattr__(name: str) -> object:
    """Load the cleaning when it is asked for: it is not needed to import the package."""
    if name == "clean":
        from sphshell_pin.shell import cleaning

        return cleaning.clean
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
