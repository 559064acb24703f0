"""A clean shell from a file, from arrays or from a geometry, and the record of its cleaning."""

from sphshell_pin.shell.cleaning import CleanedSurface, clean
from sphshell_pin.shell.health import ShellHealth
from sphshell_pin.shell.shell import ClosestPoints, Shell

__all__ = ["CleanedSurface", "ClosestPoints", "Shell", "ShellHealth", "clean"]
