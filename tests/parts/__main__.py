"""Generate parts, write them as files, and compare what is read with their exact CAD faces.

python -m tests.parts [--count 300] [--seed 1] [--only 123 peg] [--write]
"""

import argparse
import sys
import time
from collections import Counter
from importlib.util import find_spec

from benchmarks.measured import Measured, write
from tests.parts import tables
from tests.parts.files import KINDS_OF_FILE
from tests.parts.running import Outcome, run
from tests.parts.solids import FAMILIES, family_of


def main() -> int:
    """Run, print and write; return 1 where a file is refused."""
    options = arguments()
    kinds = tuple(kind for kind in KINDS_OF_FILE if kind not in options.without)
    if "decimated" in kinds and find_spec("fast_simplification") is None:
        print("No decimated files: they need fast-simplification (pip install fast-simplification)")
        kinds = tuple(kind for kind in kinds if kind != "decimated")
    numbers = chosen(options.count, options.only)
    begin, outcomes = time.perf_counter(), []
    for outcome in run(numbers, options.seed, kinds):
        outcomes.append(outcome)
        report(outcome)
    verdicts = [verdict for outcome in outcomes for verdict in outcome.verdicts]
    rows = tables.by_file(verdicts)
    print(tables.table(rows))
    failed = Counter(f"{family_of(one.number)}: {one.skipped}" for one in outcomes if one.skipped)
    print(f"\n{len(outcomes)} parts, {failed.total()} skipped {dict(failed)}")
    print(f"{time.perf_counter() - begin:.0f} s")
    if options.write:
        command = f"python -m tests.parts --count {options.count} --seed {options.seed} --write"
        text = (
            f"{len(outcomes)} parts of {len(FAMILIES)} families; OpenCASCADE failed on "
            f"{failed.total()}, which were skipped."
        )
        found = [Measured(text=text), Measured("Kinds of files", table=rows)]
        print(f"wrote {write('mesh_parts', command, found)}")
    return 1 if any(outcome.refused for outcome in outcomes) else 0


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.parts", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--count", type=int, default=300, help="number of parts")
    parser.add_argument("--seed", type=int, default=1, help="of all parts together")
    parser.add_argument("--only", nargs="+", default=[], help="numbers of parts, or families")
    parser.add_argument("--without", nargs="+", default=[], help="kinds of files to leave out")
    parser.add_argument("--write", action="store_true", help="write docs/measured/mesh_parts.json")
    options = parser.parse_args()
    unknown = {*options.without} - {*KINDS_OF_FILE}
    if unknown:
        parser.error(f"unknown {sorted(unknown)}: --without takes {list(KINDS_OF_FILE)}")
    names = [one for one in options.only if not one.isdigit()]
    if not set(names) <= set(FAMILIES):
        parser.error(f"--only takes numbers, and the families {', '.join(FAMILIES)}")
    return options


def chosen(count: int, only: list[str]) -> list[int]:
    """Return the numbers of parts: all below `count`, those of families, or those named."""
    numbers = [int(one) for one in only if one.isdigit()]
    families = [one for one in only if not one.isdigit()]
    if only:
        return numbers + [k for k in range(count) if family_of(k) in families]
    return list(range(count))


def report(outcome: Outcome) -> None:
    for verdict in outcome.verdicts:
        print(tables.line(verdict), flush=True)
    for text in outcome.refused:
        print(f"{outcome.number:4d} REFUSED {text}", flush=True)
    if outcome.skipped:
        print(f"{outcome.number:4d} {family_of(outcome.number)} skipped: {outcome.skipped}")


if __name__ == "__main__":
    sys.exit(main())
