"""Speed of the package, as ratios: python -m benchmarks [--quick]."""

from __future__ import annotations

import argparse

from sphshell_pin.benchmarks import convergence, query, step
from sphshell_pin.benchmarks.building import SHEETS, building
from sphshell_pin.benchmarks.queries import assemble
from sphshell_pin.benchmarks.timing import measure_import, one_core
from sphshell_pin.cases.contents import markdown
from sphshell_pin.cases.machine import machine


def main() -> None:
    """Print all ratios."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rounds, rougher figures")
    rounds = 5 if parser.parse_args().quick else 25
    one_core()
    print(machine())
    queries = query.measure_peers(rounds), query.measure_sizes(rounds)
    print(markdown(assemble(*queries, convergence.measure_cost(rounds), [], [])))
    building(max(1, rounds // 8), SHEETS[:1])
    steps = step.measure_step(2 * rounds), step.measure_components(2 * rounds)
    print(markdown(step.assemble(*steps, measure_import(max(5, rounds // 2)))))


if __name__ == "__main__":
    main()
