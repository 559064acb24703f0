"""What users of other engines reported in public, tried here: each a figure beside its truth."""

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

GITHUB = "https://github.com/"
STATED = tomllib.loads(Path(__file__).with_name("cases.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Case:
    """A public report, and what is measured of it here; what it states is in cases.toml."""

    name: str
    measure: Callable[[], float]
    threads: Sequence[str]
    wanted: str
    figure: str
    truth: float
    bound: float

    @property
    def links(self) -> str:
        """The threads as links of a Markdown page."""
        pairs = (thread.split("#") for thread in self.threads)
        return ", ".join(f"[{name}#{k}]({GITHUB}{name}/issues/{k})" for name, k in pairs)


CASES: dict[str, Case] = {}


def case(measure: Callable[[], float]) -> Callable[[], float]:
    """Register a function as the case of its name."""
    name = measure.__name__
    CASES[name] = Case(name, measure, **STATED[name])
    return measure
