"""What a measurement found: how much, and where."""

import math
from dataclasses import dataclass

from numpy.typing import ArrayLike

Optional = ArrayLike | None
"""A velocity or torques; None stands for zero."""


@dataclass(frozen=True)
class Finding:
    """The worst of what was compared: its `error`, and `where` it was, in words."""

    error: float
    where: str

    def require(self, what: str, tolerance: float) -> float:
        """Return the error; raise AssertionError unless it is at most `tolerance`."""
        if self.error <= tolerance:
            return self.error
        raise AssertionError(f"{what}: {self.error:.3g} (at most {tolerance:.3g}), {self.where}")


def worst(findings: list[Finding], nothing: str) -> Finding:
    """Return the largest of `findings`, one that is no number first; `nothing` if there is none."""
    if not findings:
        return Finding(0.0, nothing)
    return max(findings, key=lambda one: math.inf if math.isnan(one.error) else one.error)
