"""To how much the coordinates of a file are known: single precision, few digits, a grid."""

import numpy as np

from sphshell_pin.base.arrays import Array

SAMPLE = 1000
"""Vertices that are looked at."""

FEWEST = 12
"""Distinct numbers that it takes as evidence of digits or of a grid."""

LARGEST_STEP = 1e-4
"""Share of the box diagonal: what lies on a coarser grid was made so, as voxels are."""

MOST_DIGITS = 9
SINGLE_PRECISION = 6e-8

SCALES = (1.0, 1e-3, 1e-2, 0.0254)
"""Meters per unit in which arrays may have been rounded, before they were scaled."""


def rounding(numbers: Array, scales: tuple[float, ...] = (1.0,)) -> float:
    """Return half the step to which coordinates (n, 3) are known, 0 where they show none.

    They are also tried divided by each of `scales`; the result is in the unit of `numbers`.
    """
    largest = float(max(-numbers.min(initial=0.0), numbers.max(initial=0.0)))
    if not 0.0 < largest < np.inf:
        return 0.0
    some = numbers[:: max(1, len(numbers) // SAMPLE)]
    size = float(np.linalg.norm(np.ptp(some, axis=0)))
    values = np.unique(np.abs(some))
    values = values[values > 1e-12 * largest]
    found = [0.0]
    for scale in scales:
        own = values / scale
        # Scaling there and back is off by a few units in the last place.
        if np.allclose(own.astype(np.float32), own, rtol=1e-15, atol=0.0):
            found.append(SINGLE_PRECISION * largest)
        if len(own) >= FEWEST:
            steps = scale * _last_digit(own), scale * _grid_step(own)
            found += [step / 2 for step in steps if step <= LARGEST_STEP * size]
    return max(found)


def _last_digit(values: Array) -> float:
    """Return a unit in the last digit of the largest of `values` (n,), 0 if all need many digits.

    The third largest stands for it: one or two may have a digit more in front, as 100 has.
    """
    step = 0.0
    decade = np.floor(np.log10(values))
    for digits in range(MOST_DIGITS, 0, -1):
        last = 10.0 ** (digits - 1 - decade)
        if np.abs(values * last - np.round(values * last)).max() > 1e-5:
            break
        step = 1.0 / float(last[-3])
    return step


def _grid_step(values: Array) -> float:
    """Return the step of which all `values` (n,), sorted, are multiples, 0 if there is none."""
    gaps = np.diff(values)
    gaps = gaps[gaps > 2e-7 * values[-1]]
    if len(gaps) == 0:
        return 0.0
    spans = np.concatenate([gaps, values])
    for parts in range(1, 9):  # the smallest gap may be several steps
        step = gaps.min() / parts
        for reach in 10.0 ** np.arange(1, 8):  # the farther, the more exact
            near = spans[spans < reach * step]
            count = np.round(near / step)
            step = near @ count / max(count @ count, 1.0) or step
        multiple = values / step
        if np.abs(multiple - np.round(multiple)).max() < 0.1:
            return float(step)
    return 0.0
