"""The same scenes in other engines: error against CPU time.

python -m benchmarks.peers [--engine E]... [--scene S]... [--quick] [--write]
"""

from __future__ import annotations

import argparse

from sphshell_pin.benchmarks.peers.measuring import measure
from sphshell_pin.benchmarks.peers.scenes import SCENES
from sphshell_pin.benchmarks.peers.section import assemble, site_sections
from sphshell_pin.benchmarks.peers.workers import ENGINES
from sphshell_pin.benchmarks.timing import one_core
from sphshell_pin.cases.machine import machine
from sphshell_pin.cases.measured import write


def main() -> None:
    """Measure, print the tables, write the files."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.peers", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--engine", action="append", choices=ENGINES, help="only these, and ours")
    parser.add_argument("--scene", action="append", choices=SCENES, help="only these")
    parser.add_argument("--quick", action="store_true", help="fewer settings, swings and rounds")
    parser.add_argument("--write", action="store_true", help="write docs/measured/peers.json")
    arguments = parser.parse_args()
    one_core()
    print(machine())
    rows, ratios = measure(
        arguments.engine or ENGINES,
        arguments.scene or SCENES,
        arguments.quick,
        say=lambda text: print(text, flush=True),
    )
    for table in assemble(rows, ratios).tables:
        print(f"{table.caption}\n\n{table.markdown()}")
    if arguments.write:
        command = f"python -m benchmarks.peers{' --quick' * arguments.quick} --write"
        print(f"wrote {write('peers', command, site_sections(rows, ratios))}")


if __name__ == "__main__":
    main()
