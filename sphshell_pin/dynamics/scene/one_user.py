"""Methods of objects with one state: for one user at a time."""

from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from sphshell_pin import _core

P = ParamSpec("P")
R = TypeVar("R")


class HasUser(Protocol):
    """What knows whether it is in use."""

    _user: _core.OneUser


S = TypeVar("S", bound=HasUser)


def one_at_a_time(method: Callable[Concatenate[S, P], R]) -> Callable[Concatenate[S, P], R]:
    """Let one call at a time into the methods of an object that are marked with this.

    Another one meanwhile, from another thread or from a routine that the first has called, raises
    Busy. It does not wait: the second of these would wait for itself.
    """

    @wraps(method)
    def alone(self: S, /, *args: P.args, **kwargs: P.kwargs) -> R:
        with _core.Use(self._user, method.__name__):
            return method(self, *args, **kwargs)

    return alone
