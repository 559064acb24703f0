"""What users of other engines reported in public, tried here: each a figure beside its truth."""

from collections.abc import Callable
from dataclasses import dataclass

GITHUB = "https://github.com/"


@dataclass(frozen=True)
class Case:
    """A public report, and what is measured of it here."""

    name: str
    threads: tuple[str, ...]
    """Repository and number on GitHub: "owner/repository#12"."""
    wanted: str
    figure: str
    truth: float
    bound: float
    """Of the difference from the truth."""
    measure: Callable[[], float]

    @property
    def links(self) -> str:
        """The threads as links of a Markdown page."""
        pairs = (thread.split("#") for thread in self.threads)
        return ", ".join(f"[{name}#{k}]({GITHUB}{name}/issues/{k})" for name, k in pairs)


CASES: dict[str, Case] = {}


def case(
    *threads: str, wanted: str, figure: str, truth: float, bound: float
) -> Callable[[Callable[[], float]], Callable[[], float]]:
    """Register the function below as the case of its name."""

    def add(measure: Callable[[], float]) -> Callable[[], float]:
        name = measure.__name__
        CASES[name] = Case(name, threads, wanted, figure, truth, bound, measure)
        return measure

    return add
