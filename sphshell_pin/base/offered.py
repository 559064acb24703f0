"""Functions of upper folders that lower ones offer as methods, such as `Result.plot`.

Imports go down the layers alone. Where a value offers a picture or a file of itself, the method
names the function, and its module is imported when the method is called.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any


def offered(name: str) -> Callable[..., Any]:
    """Return the function that is called `name`, as "sphshell_pin.plot:plot_result"."""
    module, _, function = name.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), function)
    return found
