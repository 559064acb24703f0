"""Generate parts, write them as files, and compare what is read with their exact CAD faces.

python -m tests.parts [--count 300] [--seed 1] [--only 123 124] [--write]
"""

import argparse
import sys
import time
from collections import Counter
from importlib.util import find_spec

from benchmarks.measured import Measured, write
from tests.parts import tables
from tests.parts.files import KINDS_OF_FILE
from tests.parts.running import run
from tests.parts.solids import FAMILIES, family_of


def main() -> int:
    """Run, print and write; return 1 where a file is refused."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.parts", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--count", type=int, default=300, help="number of parts")
    parser.add_argument("--seed", type=int, default=1, help="of all parts together")
    parser.add_argument("--only", type=int, nargs="+", help="numbers of parts, instead of all")
    parser.add_argument("--write", action="store_true", help="write docs/measured/mesh_parts.json")
    options = parser.parse_args()
    kinds = tuple(KINDS_OF_FILE)
    if find_spec("fast_simplification") is None:
        print("No decimated files: they need fast-simplification (pip install fast-simplification)")
        kinds = tuple(kind for kind in kinds if kind != "decimated")
    begin, verdicts, refused, failed = time.perf_counter(), [], 0, Counter[str]()
    numbers = options.only or range(options.count)
    for outcome in run(numbers, options.seed, kinds):
        name = f"{outcome.number:4d} {family_of(outcome.number)}"
        for verdict in outcome.verdicts:
            verdicts.append(verdict)
            largest = f"curved {verdict.largest['smooth']:.1e} flat {verdict.largest['facets']:.1e}"
            print(f"{name:24s} {verdict.file:18s} {largest} {'WORSE' * verdict.worse}", flush=True)
        for text in outcome.refused:
            print(f"{name} REFUSED {text}", flush=True)
            refused += 1
        if outcome.skipped:
            failed[f"{family_of(outcome.number)}: {outcome.skipped}"] += 1
    rows = tables.by_file(verdicts)
    if rows:
        print(tables.table(rows))
    print(f"\n{len(numbers)} parts, {failed.total()} skipped {dict(failed)}")
    print(f"{time.perf_counter() - begin:.0f} s")
    if options.write:
        command = f"python -m tests.parts --count {options.count} --seed {options.seed} --write"
        text = (
            f"{len(numbers)} parts of {len(FAMILIES)} families; OpenCASCADE failed on "
            f"{failed.total()}, which were skipped."
        )
        found = [Measured(text=text), Measured("Kinds of files", table=rows)]
        print(f"wrote {write('mesh_parts', command, found)}")
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
