"""Scenes in other packages: CasADi, Crocoddyl, MuJoCo."""

from collections.abc import Iterator
from contextlib import contextmanager

from sphshell_pin.errors import MissingExtra


@contextmanager
def imports_of(package: str) -> Iterator[None]:
    """Import `package` inside; MissingExtra names the extra, which is called the same."""
    try:
        yield
    except ModuleNotFoundError as missing:
        if missing.name != package:
            raise
        raise MissingExtra(package, package, f"sphshell_pin.adapters.{package}") from missing
