"""Walk over the joints of parts with spheres, and count what is wrong with their contacts.

Of each part: how many of its faces are exact, and the share of their area that is.

python -m tests.joints [--count 1000000] [--seed 1] [--only disc shaft tray] [--stl] [--show 3]
python -m tests.joints --files part.step ... [--count 4000]
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from tests.joints.boxes import BOXES
from tests.joints.running import TRIMMED, walk_file, walk_part
from tests.joints.solids import FAMILIES
from tests.joints.verdict import ALLOWED, FAULTS, Verdict
from tests.parts.occ import OccFailed

NAMES = [*FAMILIES, *BOXES]


def main() -> int:
    """Walk, print the faults by part and by kind of joint; return 1 if there are any."""
    options = arguments()
    begin = time.perf_counter()
    counts: dict[str, Counter[str]] = {}
    if options.files:
        asked = 0
        for path in options.files:
            rng = np.random.default_rng(options.seed)
            asked += take(walk_file(path, path.name, options.count, rng), options.show, counts)
        number = len(options.files)
    else:
        number, asked = walk_families(options, counts)
    print(f"\n{number} parts, {asked} spheres, {time.perf_counter() - begin:.0f} s")
    return 1 if table(counts) else 0


def walk_families(options: argparse.Namespace, counts: dict[str, Counter[str]]) -> tuple[int, int]:
    """Walk over random parts until enough spheres were asked."""
    names, number, asked = options.only or NAMES, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        while asked < options.count:
            family = names[number % len(names)]
            rng = np.random.default_rng([options.seed, number])
            number += 1
            try:
                verdict = walk_part(
                    family, Path(folder), rng, options.stl, options.moved, options.count
                )
            except OccFailed as failure:
                print(f"{family}: {failure}")
                continue
            asked += take(verdict, options.show, counts)
    return number, asked


def take(verdict: Verdict, show: int, counts: dict[str, Counter[str]]) -> int:
    """Print the faults of one part, and the first spheres of each; return how many were asked."""
    found = ", ".join(f"{name} {len(rows)}" for name, rows in verdict.faults.items() if rows)
    print(f"{verdict.part:60s} {len(verdict.radii):6d}  {verdict.worst:.0e}  {found}", flush=True)
    for name, rows in verdict.found().items():
        for text in rows[:show]:
            print(f"    {name} at {text}")
    for joint, own in verdict.by_joint().items():
        counts[joint] = counts.get(joint, Counter()) + own
    return len(verdict.radii)


def table(counts: dict[str, Counter[str]]) -> int:
    """Print the faults by joint; return how many are not allowed."""
    columns = ("spheres", *FAULTS)
    total: Counter[str] = sum(counts.values(), Counter())
    print(f"{'joint':32s}" + "".join(f"{name:>9s}" for name in columns))
    for joint, own in [*sorted(counts.items()), ("all", total)]:
        print(f"{joint:32s}" + "".join(f"{own[name]:9d}" for name in columns))
    return sum(total[name] for name in FAULTS if name not in ALLOWED)


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
    if options.moved and {*options.only} & {*TRIMMED}:
        parser.error(f"--moved is for {', '.join(FAMILIES)}")
    return options


if __name__ == "__main__":
    sys.exit(main())
