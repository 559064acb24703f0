"""Fits to synthetic data with known parameters: errors, and how often the intervals hold them.

python -m tests.study.fitted_sets [--sets 1000] [--first 0]
"""

import argparse
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.scenario import build
from sphshell_pin.study.fit import fit
from sphshell_pin.study.quantities import quantities_of
from sphshell_pin.study.report.machine import machine
from tests.texts import text_of

NOISE, STEP = 0.02, 2e-4  # of the largest value of each column; between times [s]
SCENARIO = text_of("scenarios/bounce.toml")
LAW = "contact.tip.law."
TRUTH = {f"{LAW}stiffness": 1e5, f"{LAW}dissipation": 0.3, "contact.tip.friction.mu_dynamic": 0.2}
COLUMNS = {"pairs.tip.normal_force": "N", "pairs.tip.force_x": "N"}


def exact(path: Path) -> tuple[Array, dict[str, Array]]:
    """Return the times (n,) and the columns (n,) of a run with the true values."""
    built = build(path)
    run = built.scenario.run
    t: Array = STEP * np.arange(1, round(run.duration / STEP) + 1, dtype=float)
    result = built.simulation.run(built.q0, built.v0, run.duration, record_dt=STEP)
    known = quantities_of(result, built.scene, t, COLUMNS)
    return t, {name: values for name, (_, values) in known.items()}


def one_set(path: Path, number: int) -> tuple[Array, Array, Array, int]:
    """Return values, ends of the intervals, and runs of the fit to one noisy set.

    The noise and the start, up to 30 % from the truth, are those of the seed `number`.
    """
    rng = np.random.default_rng(number)
    t, columns = exact(path)
    data = {"t [s]": t}
    for name, unit in COLUMNS.items():
        noise = NOISE * np.abs(columns[name]).max() * rng.normal(size=len(t))
        data[f"{name} [{unit}]"] = columns[name] + noise
    start = {key: repr(value * rng.uniform(0.7, 1.3)) for key, value in TRUTH.items()}
    found = fit(path, data, list(TRUTH), changes=start)
    ends = [(one.value, one.low, one.high) for one in found.parameters]
    return *np.transpose(ends), found.runs


def many_sets(count, first=0, workers=2):
    """Yield what one_set returns of sets `first` to `first` + `count`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bounce.toml"
        path.write_text(SCENARIO, encoding="utf-8")
        numbers = range(first, first + count)
        if workers < 2:
            yield from map(partial(one_set, path), numbers)
            return
        with ProcessPoolExecutor(workers) as pool:
            yield from pool.map(partial(one_set, path), numbers, chunksize=8)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.study.fitted_sets", description=__doc__)
    parser.add_argument("--sets", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first set")
    given = parser.parse_args()
    print(machine())
    begin = time.perf_counter()
    values, low, high, runs = zip(*many_sets(given.sets, given.first), strict=True)
    truth = np.array(list(TRUTH.values()))
    off = np.array(values) / truth - 1.0
    inside = (np.array(low) <= truth) & (truth <= np.array(high))
    print(
        f"{given.sets} sets in {time.perf_counter() - begin:.0f} s, "
        f"{np.mean(runs):.0f} runs a fit on average, {max(runs)} at most\n"
    )
    print("| parameter | mean | mean error | mean of errors' sizes | largest | in its interval |")
    print("|---|---|---|---|---|---|")
    for k, key in enumerate(TRUTH):
        column = off[:, k]
        print(
            f"| `{key}` | {np.mean(values, axis=0)[k]:.6g} | {column.mean():+.3%} | "
            f"{np.abs(column).mean():.3%} | {np.abs(column).max():.2%} | "
            f"{inside[:, k].mean():.1%} |"
        )


if __name__ == "__main__":
    main()
