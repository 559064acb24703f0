"""Walk over the joints of parts with spheres, and count what is wrong with their contacts.

Of each part: how many of its faces are exact, and the share of their area that is.

python -m tests.joints [--count 1000000] [--seed 1] [--only disc shaft tray] [--stl] [--show 3]
python -m tests.joints --files part.step ... [--count 4000]
"""

import argparse
import itertools
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.joints.boxes import BOXES
from tests.joints.running import walk_file, walk_part
from tests.joints.solids import FAMILIES
from tests.joints.verdict import Verdict
from tests.parts.occ import OccFailed

NAMES = [*FAMILIES, *BOXES]


def main() -> int:
    """Walk, print the faults of each part and of all; return 1 if there are any."""
    options = arguments()
    begin, number, asked = time.perf_counter(), 0, 0
    total: Counter[str] = Counter()
    for verdict in of_files(options) if options.files else of_families(options):
        counts = Counter({name: len(rows) for name, rows in verdict.faults.items()})
        found = ", ".join(f"{name} {count}" for name, count in counts.items())
        print(f"{verdict.part:60s} {verdict.spheres:6d}  {found}", flush=True)
        for name, rows in verdict.faults.items():
            for text in rows[: options.show]:
                print(f"    {name} at {text}")
        number, asked, total = number + 1, asked + verdict.spheres, total + counts
        if not options.files and asked >= options.count:
            break
    print(f"\n{number} parts, {asked} spheres, {time.perf_counter() - begin:.0f} s; {dict(total)}")
    return 1 if total else 0


def of_files(options: argparse.Namespace) -> Iterator[Verdict]:
    for path in options.files:
        yield walk_file(path, path.name, options.count, np.random.default_rng(options.seed))


def of_families(options: argparse.Namespace) -> Iterator[Verdict]:
    """Walk over random parts without end."""
    with tempfile.TemporaryDirectory() as folder:
        for number, family in enumerate(itertools.cycle(options.only or NAMES)):
            rng = np.random.default_rng([options.seed, number])
            try:
                yield walk_part(family, Path(folder), rng, options.stl, options.count)
            except OccFailed as failure:
                print(f"{family}: {failure}")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.joints", description=(__doc__ or "").partition("\n")[0]
    )
    add = parser.add_argument
    add("--count", type=int, default=100_000, help="spheres, of each file or of all")
    add("--seed", type=int, default=1)
    add("--only", nargs="+", default=[], choices=NAMES, metavar="FAMILY")
    add("--files", nargs="+", type=Path, default=[], help="STEP files")
    add("--stl", action="store_true", help="binary STL files instead of STEP")
    add("--show", type=int, default=0, help="spheres to print for each fault")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
