"""Ishigami's function, whose Sobol indices have closed forms, as a table."""

import numpy as np

from sphshell_pin.study.sweep.sampling import design_of

A, B = 7.0, 0.1
KEYS = [f"robot.speed.root_joint.{i}" for i in range(3)]
DIST = dict.fromkeys(KEYS, f"uniform({-np.pi!r},{np.pi!r})")

# T. Ishigami and T. Homma, ISUMA 1990; variances V1, V2 and V13, all others are zero.
_V1 = 0.5 * (1 + B * np.pi**4 / 5) ** 2
_V2 = A**2 / 8
_V13 = B**2 * np.pi**8 * (1 / 18 - 1 / 50)
_V = _V1 + _V2 + _V13
FIRST = np.array([_V1, _V2, 0.0]) / _V
TOTAL = np.array([_V1 + _V13, _V2, _V13]) / _V


def ishigami(x):
    """Return the function of points (..., 3)."""
    x, y, z = np.moveaxis(np.asarray(x), -1, 0)
    return np.sin(x) + A * np.sin(y) ** 2 + B * z**4 * np.sin(x)


def table_of(design, values):
    """Return the table of a design, as a sweep makes it, whose figure f has `values`."""
    import pandas as pd

    columns = {"run": range(len(values)), **{axis.key: axis.values for axis in design.axes}}
    more = {"status": "done", "error": "", "design": design.parts, "f": values, "settings": ""}
    return pd.DataFrame(columns | more)


def ishigami_table(n, seed=0):
    """Return the table of a sweep of n (d + 2) runs, with the function in place of a scenario."""
    design = design_of(DIST, "sobol", n, seed=seed, indices=True)
    return table_of(design, ishigami(design.values))
