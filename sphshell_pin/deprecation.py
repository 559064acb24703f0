"""Former names that still work, and warn of what replaces them."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass


def warn_former(former: str, now: str, *, stacklevel: int = 3) -> None:
    """Warn that `former` is deprecated in favor of `now`; the caller's caller is named."""
    warnings.warn(f"{former} is deprecated: {now}", DeprecationWarning, stacklevel=stacklevel)


def renamed(former: str, now: str) -> property:
    """Return a property that gives the attribute `now` under its `former` name, with a warning."""

    def read(self: object) -> object:
        warn_former(f"{type(self).__name__}.{former}", f"it is called {now}")
        return getattr(self, now)

    return property(read, doc=f"Former name of `{now}`.")


def former_names(module: str, names: Mapping[str, str]) -> Callable[[str], object]:
    """Return the `__getattr__` of `module` for `names` that it had, with what they are called."""

    def read(name: str) -> object:
        if name not in names:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        warn_former(f"{module}.{name}", f"it is called {names[name]}")
        return getattr(sys.modules[module], names[name])

    return read


class FormerDict(Mapping[str, object]):
    """Base of a dataclass that was a dict: its fields are also found by ["name"], with a warning.

    All that Mapping offers works: get, keys, items, `in`, dict(...).
    """

    __slots__ = ()

    def __getitem__(self, name: str) -> object:
        """Return the field `name`."""
        if name not in self._names():
            raise KeyError(name)
        kind = type(self).__name__
        warn_former(f'{kind}["{name}"]', f"it is the attribute .{name}")
        return getattr(self, name)

    def __iter__(self) -> Iterator[str]:
        """Go through the names of the fields."""
        return iter(self._names())

    def __len__(self) -> int:
        """Return the number of fields."""
        return len(self._names())

    def _names(self) -> list[str]:
        return [one.name for one in fields(self)] if is_dataclass(self) else []
