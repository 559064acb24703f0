"""The same scenes in other engines: error against CPU time.

python -m benchmarks.peers [--engine E]... [--scene S]... [--quick] [--out DIR] [--write]
"""

from __future__ import annotations

import argparse
from pathlib import Path

from sphshell_pin.benchmarks.peers.measuring import measure
from sphshell_pin.benchmarks.peers.scenes import SCENES
from sphshell_pin.benchmarks.peers.tables import (
    PAGE,
    machine_line,
    page,
    replace,
    text_tables,
    write_files,
)
from sphshell_pin.benchmarks.peers.workers import ENGINES
from sphshell_pin.benchmarks.timing import one_core


def main() -> None:
    """Measure, print the tables, write the files."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.peers", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--engine", action="append", choices=ENGINES, help="only these, and ours")
    parser.add_argument("--scene", action="append", choices=SCENES, help="only these")
    parser.add_argument("--quick", action="store_true", help="fewer settings, swings and rounds")
    parser.add_argument("--out", type=Path, help="folder for results.csv and results.json")
    parser.add_argument("--write", action="store_true", help=f"write docs/{PAGE.name}")
    arguments = parser.parse_args()
    one_core()
    print(machine_line())
    rows, ratios = measure(
        arguments.engine or ENGINES,
        arguments.scene or SCENES,
        arguments.quick,
        say=lambda text: print(text, flush=True),
    )
    print(text_tables(rows, ratios))
    if arguments.out is not None:
        write_files(arguments.out, rows, ratios)
        print(f"wrote {arguments.out}/results.csv and results.json")
    if arguments.write:
        replace(PAGE, page(rows, ratios, arguments.quick))
        print(f"wrote docs/{PAGE.name}")


if __name__ == "__main__":
    main()
