"""Speed of the package, as ratios: python -m benchmarks [--quick]."""

from __future__ import annotations

import argparse

import numpy as np

from sphshell_pin.benchmarks.building import SHEETS, building
from sphshell_pin.benchmarks.query import against_peers, against_size
from sphshell_pin.benchmarks.step import ingredients, step_cost
from sphshell_pin.benchmarks.timing import machine, measure_import, one_core, ratio


def import_time(rounds: int) -> None:
    """Print the time of importing the package against importing Pinocchio."""
    times = measure_import(rounds)
    print("Import, whole interpreter")
    print(
        f"  {'sphshell_pin / pinocchio':40s} {np.median(times['sphshell_pin']) * 1e3:9.1f} ms   "
        f"{ratio(times['sphshell_pin'], times['pinocchio'])} x"
    )


def main() -> None:
    """Print all ratios."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rounds, rougher figures")
    rounds = 5 if parser.parse_args().quick else 25
    one_core()
    print(machine())
    against_peers(rounds)
    against_size(rounds)
    building(max(1, rounds // 8), SHEETS[:1])
    step_cost(2 * rounds)
    ingredients(2 * rounds)
    import_time(max(5, rounds // 2))


if __name__ == "__main__":
    main()
