"""A clean shell from a file, from arrays or from a geometry, and the record of its cleaning."""

from typing import TYPE_CHECKING

from sphshell_pin.shell.shell import Shell

if TYPE_CHECKING:
    from sphshell_pin.shell.cleaning import clean

__all__ = ["Shell", "clean"]


def __getattr__(name: str) -> object:
    """Load the cleaning when it is asked for: it is not needed to import the package."""
    if name == "clean":
        from sphshell_pin.shell import cleaning

        return cleaning.clean
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
