"""The optional packages that a sweep needs."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from sphshell_pin.errors import MissingExtra


def need(module: str) -> Any:
    """Return the optional `module`.

    Raises
    ------
    MissingExtra
        It is not installed.
    """
    try:
        return import_module(module)
    except ImportError as missing:
        raise MissingExtra(module.partition(".")[0], "sweep", "a sweep") from missing
