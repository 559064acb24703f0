"""Numbers as texts of a new scenario state them."""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt


def rounded(x: float, digits: int = 2) -> float:
    """Return `x` with so many significant digits."""
    return float(f"{x:.{digits}g}")


def mm(x: float) -> str:
    """Return a length [m] as text."""
    return f"{x * 1e3:.3g} mm"


def listed(point: Iterable[float], form: str = ".4g") -> str:
    """Return numbers in brackets."""
    return f"[{', '.join(f'{one:{form}}' for one in point)}]"


def axis_name(direction: npt.NDArray[np.float64]) -> str:
    """Return "+x" ... "-z" for a unit vector (3,) along an axis; "" for any other."""
    k = int(np.argmax(np.abs(direction)))
    return f"{'-' if direction[k] < 0 else '+'}{'xyz'[k]}" if abs(direction[k]) > 0.999 else ""
