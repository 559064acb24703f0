"""Sentences on a fit: what the data do not determine, and what speaks against the scenario."""

import math
from collections.abc import Sequence

import numpy as np

from sphshell_pin.base.arrays import Mask
from sphshell_pin.study.fit.parameters import Free
from sphshell_pin.study.fit.report import Fitted, Series
from sphshell_pin.study.fit.statistics import Spread, serial_of, variance_is

# A pair of which one explains so much of the variance of the other is told.
_SHARED = 0.9


def remarks_on(
    fitted: Sequence[Fitted],
    free: Sequence[Free],
    spread: Spread,
    series: Sequence[Series],
    dof: int,
    tolerance: float,
    *,
    still: Mask,
    converged: bool,
) -> list[str]:
    """Return what is to be said of a fit; `tolerance` is the relative error of its runs.

    `still` (p,) are parameters that change nothing.
    """
    out = []
    if not converged:
        out.append(
            "the search ended before the residuals were least: start nearer to the solution, or "
            "run the fit again from these values"
        )
    out += _undetermined(fitted, free, spread, still)
    out += [
        f"{one.key} stands at its bound, {one.value:.6g} {one.unit}".rstrip()
        + ": the data would have it beyond; it has no interval, and those of others hold for it so"
        for one in fitted
        if one.at_bound
    ]
    out += _correlated(fitted, spread)
    return out + _residuals(series, dof, tolerance)


def _undetermined(
    fitted: Sequence[Fitted], free: Sequence[Free], spread: Spread, still: Mask
) -> list[str]:
    out = []
    together: set[int] = set()
    for direction in spread.blind:
        members = np.flatnonzero(np.abs(direction) > 0.01 * np.abs(direction).max())
        lost = [k for k in members.tolist() if math.isinf(spread.deviations[k])]
        if len(lost) > 1 and not together.issuperset(lost):
            together |= set(lost)
            out.append(_combination(lost, direction, fitted, free))
    for k, one in enumerate(fitted):
        if one.determined or k in together:
            continue
        if math.isinf(one.low) and math.isinf(one.high):
            why = "a change of it changes nothing that was measured"
            if not still[k]:
                why = (
                    "the derivatives of what was measured by it are inexact, so it has no "
                    "interval, and others' take it for known; a smaller run.rtol or run.dt may help"
                )
        elif free[k].log or one.low <= 0.0 <= one.high:
            why = f"they do not tell it from 0, and allow up to {one.high:.4g} {one.unit}"
            if free[k].log:
                why = f"its interval, {one.low:.4g} to {one.high:.4g} {one.unit}".rstrip()
                why += ", leaves its order of magnitude open"
        else:
            why = "its interval is its whole range"
        out.append(f"the data do not determine {one.key}: {why}".rstrip())
    return out


def _combination(
    members: Sequence[int], direction: object, fitted: Sequence[Fitted], free: Sequence[Free]
) -> str:
    """Say which changes of several parameters leave the runs as they are."""
    vector = np.asarray(direction, dtype=float)
    largest = max(members, key=lambda k: abs(vector[k]))
    parts = []
    for k in members:
        ratio = float(vector[k] / vector[largest])
        # x is the logarithm of the value, or the value over its scale.
        share = ratio if free[k].log else ratio * free[k].scale / (abs(fitted[k].value) or 1.0)
        parts.append(f"{fitted[k].key} changes by {share:+.2g} %")
    names = " and ".join(fitted[k].key for k in members)
    return (
        f"the data do not determine {names} separately: runs stay as they are if "
        f"{' and '.join(parts)}"
    )


def _correlated(fitted: Sequence[Fitted], spread: Spread) -> list[str]:
    out = []
    correlation = spread.correlation
    for i, one in enumerate(fitted):
        for k in range(i):
            r = float(correlation[i, k])
            if r**2 > _SHARED:
                narrower = math.sqrt(1.0 / max(1.0 - r**2, 1e-12))
                out.append(
                    f"{fitted[k].key} and {one.key} are correlated, {r:+.3f}: if one were known, "
                    f"the interval of the other would be {narrower:.2g} times narrower"
                )
    return out


def _residuals(series: Sequence[Series], dof: int, tolerance: float) -> list[str]:
    out = []
    for one in series:
        called = f"{one.name} of {one.experiment}"
        if one.rms <= 10.0 * tolerance * float(np.abs(one.measured).max(initial=0.0)):
            continue  # what is left is the error of the runs
        serial = serial_of(one.residuals / one.sigma, len(series))
        if not serial.independent and serial.correlation > 0.0:
            out.append(
                f"the residuals of {called} are not noise: neighbors have the correlation "
                f"{serial.correlation:.2f} (Durbin-Watson {serial.ratio:.2f}), so that the "
                "scenario leaves something out, or the data were filtered; honest intervals would "
                f"be about {serial.inflation:.2g} times wider"
            )
        elif not serial.independent:
            out.append(
                f"the residuals of {called} alternate: neighbors have the correlation "
                f"{serial.correlation:.2f} (Durbin-Watson {serial.ratio:.2f}), as of data "
                "that were differentiated"
            )
    given = [one for one in series if one.given]
    if given and len(given) == len(series):
        squares = sum(float(np.sum((one.residuals / one.sigma) ** 2)) for one in given)
        if not variance_is(squares, dof):
            ratio = math.sqrt(squares / dof)
            out.append(
                f"the residuals are {ratio:.3g} times the standard deviations that were given: "
                "these are wrong, or the scenario leaves something out"
            )
    return out
