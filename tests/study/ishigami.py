"""Ishigami's function, whose Sobol indices have closed forms, as a table and as a scenario."""

from pathlib import Path

import numpy as np

from sphshell_pin.study.sweep.sampling import design_of
from tests.study.resting import SCENARIO

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

FIGURES = """
import math


def ishigami(result, scene):
    x, y, z = (float(one) for one in result.v[0][:3])
    return math.sin(x) + 7 * math.sin(y) ** 2 + 0.1 * z**4 * math.sin(x)
"""


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


def write(folder: Path) -> Path:
    """Write a scenario whose figure is the function of the ball's first speed; return its path."""
    folder.mkdir(exist_ok=True)
    text = SCENARIO.replace("duration = 1.0", "duration = 1e-6").partition("[figures]")[0]
    text = text.replace("record_dt = 0.1", "record_dt = 1e-6")
    text = text.replace(f"0.02, {0.012}, 0", "0.02, 0.1, 0")  # in the air
    text = text.replace(
        "\n[[shell]]", "speed = { root_joint = [0, 0, 0, 0, 0, 0] }\n\n[[shell]]", 1
    )
    path = folder / "ishigami.toml"
    path.write_text(text + '[figures]\nf = "ishigami.py:ishigami"\n', encoding="utf-8")
    (folder / "ishigami.py").write_text(FIGURES, encoding="utf-8")
    return path
