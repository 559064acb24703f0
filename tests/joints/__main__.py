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
        counts = Counter({name: len(rows) for name, rows in verdict.faults.items() if rows})
        found = ", ".join(f"{name} {count}" for name, count in counts.items())
        spheres = len(verdict.radii)
        print(f"{verdict.part:60s} {spheres:6d}  {found}", flush=True)
        for name, rows in verdict.found().items():
            for text in rows[: options.show]:
                print(f"    {name} at {text}")
        number, asked, total = number + 1, asked + spheres, total + counts
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
            given = family, Path(folder), rng, options.stl, options.moved, options.count
            try:
                yield walk_part(*given)
            except OccFailed as failure:
                print(f"{family}: {failure}")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.joints", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument(
        "--count", type=int, default=100_000, help="spheres, of each file or of all"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", default=[], help=f"of {', '.join(NAMES)}")
    parser.add_argument("--files", nargs="+", type=Path, default=[], help="STEP files")
    parser.add_argument("--stl", action="store_true", help="binary STL files instead of STEP")
    parser.add_argument("--moved", action="store_true", help="parts turned at random")
    parser.add_argument("--show", type=int, default=0, help="spheres to print for each fault")
    options = parser.parse_args()
    if not {*options.only} <= {*NAMES}:
        parser.error(f"--only takes {', '.join(NAMES)}")
    return options


if __name__ == "__main__":
    sys.exit(main())
