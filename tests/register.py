"""Registers of cases: functions that run something and judge it, each with its name.

A module of hard cases:

    \"\"\"Heading of its table.  What the cases share follows as text above the table.\"\"\"

    @case("ball on a plate")
    def at_rest() -> Verdicts:
        yield compare("at rest", "ball of 1 kg", "depth = m g / k", expected, measured, 1e-9)
"""

import importlib
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

K = TypeVar("K")


class Register(Generic[K]):
    """The cases of some modules of a package, by their names, in the order of the modules.

    `make` makes one of its name, its function and what else the decorator `case` is given; it has
    the function as `run`, and says by `slow` whether that takes more than a few seconds.
    """

    def __init__(self, package: str, modules: Sequence[str], make: Callable[..., K]) -> None:
        self.modules = [f"{package}.{name}" for name in modules]
        self._make = make
        self._known: dict[str, K] = {}

    def case(self, name: str, **facts: object):
        """Decorate the function that runs a case; ValueError where the name is taken."""

        def register(run):
            if name in self._known:
                raise ValueError(f"two cases are called {name!r}")
            self._known[name] = self._make(name, run, **facts)
            return run

        return register

    def collect(self, *, quick: bool = False, only: str | None = None) -> list[K]:
        """Import the modules and return their cases; `quick` leaves out the slow ones.

        `only`: those with this word in their module or name.
        """
        for name in self.modules:
            importlib.import_module(name)
        words = {name: f"{known.run.__module__} {name}" for name, known in self._known.items()}
        chosen = [known for name, known in self._known.items() if (only or "") in words[name]]
        chosen = [known for known in chosen if not (quick and known.slow)]
        return sorted(chosen, key=lambda known: self.modules.index(known.run.__module__))
