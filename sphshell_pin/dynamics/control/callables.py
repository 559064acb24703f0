"""What a user's own controller must take."""

import inspect
from collections.abc import Callable

from sphshell_pin.errors import InvalidParameter

TAKES = ("t", "q", "v", "contacts")
"""Arguments of a callable that is a controller."""


def check_callable(callback: Callable[..., object]) -> None:
    """Raise InvalidParameter unless `callback` can be called as tau(t, q, v, contacts).

    One with an argument `sensors` gets that too. A callable whose signature Python cannot know, as
    of some compiled ones, passes.
    """
    try:
        signature = inspect.signature(callback)
    except (TypeError, ValueError):
        return
    try:
        signature.bind(*TAKES, **({"sensors": None} if reads_sensors(callback) else {}))
    except TypeError as error:
        name = getattr(callback, "__name__", type(callback).__name__)
        raise InvalidParameter(
            "controller",
            callback,
            f"must take tau({', '.join(TAKES)}): {error}",
            f"'{name}{signature}'",
        ) from None


def reads_sensors(callback: Callable[..., object]) -> bool:
    """Whether a controller takes an argument called `sensors`."""
    try:
        return "sensors" in inspect.signature(callback).parameters
    except (TypeError, ValueError):
        return False
