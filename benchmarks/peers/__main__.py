"""The same scenes in other engines: error against CPU time.

python -m benchmarks.peers [--engine E]... [--scene S]... [--quick] [--write]
"""

import argparse
from pathlib import Path

from benchmarks.measured import write
from benchmarks.peers.measuring import measure
from benchmarks.peers.scenes import SCENES
from benchmarks.peers.section import assemble, site_sections
from benchmarks.peers.workers import ENGINES
from sphshell_pin.study.report.machine import describe, machine
from sphshell_pin.study.report.making import Report, report_json
from sphshell_pin.study.report.timing import one_core

REPORT = Path("results", "peers", "report.json")


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
    found = assemble(rows, ratios)
    for table in found.tables:
        print(f"{table.caption}\n\n{table.markdown()}")
    if arguments.write:
        command = f"python -m benchmarks.peers{' --quick' * arguments.quick} --write"
        print(f"wrote {write('peers', command, site_sections(rows, ratios))}")
        REPORT.parent.mkdir(parents=True, exist_ok=True)
        REPORT.write_text(report_json(Report([found], describe(command)), []), encoding="utf-8")
        print(f"wrote {REPORT}, for docs/site/quote.py")


if __name__ == "__main__":
    main()
