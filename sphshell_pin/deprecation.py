"""Former names that still work, and warn of what replaces them."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType


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


MOVED = {
    "dynamics.advance": "dynamics.run.advance",
    "dynamics.explain": "dynamics.scene.explain",
    "dynamics.open_run": "dynamics.run.open_run",
    "dynamics.simulation": "dynamics.run.simulation",
    "scenario.new": "scenario.drafting.new",
    "scenario.reading": "scenario.format.reading",
    "scenario.replay": "scenario.running.replay",
    "scenario.run": "scenario.running.run",
}
"""Modules of the documentation of 0.2.0 that have moved: former place and present one."""


class FormerModules(MetaPathFinder, Loader):
    """Finds a module by the place where it was, with a warning."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Return the spec of a module that has moved; None for any other."""
        moved = name.removeprefix("sphshell_pin.") in MOVED
        return ModuleSpec(name, self) if moved and name.startswith("sphshell_pin.") else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return a module whose names are those of the module at its present place."""
        now = f"sphshell_pin.{MOVED[spec.name.removeprefix('sphshell_pin.')]}"
        warn_former(spec.name, f"it is {now}")
        module = ModuleType(spec.name, f"Former name of {now}.")
        module.__dict__.update(vars(import_module(now)), __name__=spec.name, __file__=None)
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing: the module has been executed at its present place."""
