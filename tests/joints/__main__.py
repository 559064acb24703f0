"""Walk over the joints of parts with spheres, and count what is wrong with their contacts.

python -m tests.joints [--count 1000000] [--seed 1] [--only disc shaft] [--stl] [--show 3]
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

import sphshell_pin as sp
from tests.joints.solids import FAMILIES, Part, write_step, write_stl
from tests.joints.walk import FAULTS, Verdict, chord_error, judge, spheres
from tests.parts.occ import OccFailed, Rng

PER_PART = 4000
CHORD = 3e-4
"""Deflection of STL files over the size."""

DIGITS = {False: 2e-12, True: 2e-7}
"""What the digits of STEP files leave open, and the single precision of STL, over the size."""


def main() -> int:
    """Walk, print the faults by part and by kind of joint; return 1 if there are any."""
    options = arguments()
    begin, names = time.perf_counter(), options.only or list(FAMILIES)
    by_kind: dict[str, Counter[str]] = {}
    asked, number = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        while asked < options.count:
            rng = np.random.default_rng([options.seed, number])
            family = names[number % len(names)]
            number += 1
            try:
                part = FAMILIES[family](rng)
                part = part.moved(rng) if options.moved else part
                shell = load(part, Path(folder), options.stl)
            except OccFailed as failure:
                print(f"{family}: {failure}")
                continue
            verdict = walk(shell, part, min(PER_PART, options.count), rng, options.stl)
            asked += len(verdict.spheres.radii)
            tell(shell, verdict, options.show)
            for joint, fault, _ in verdict.rows():
                by_kind.setdefault(joint, Counter())[fault] += 1
            for joint in np.array(verdict.joints)[verdict.spheres.joint].tolist():
                by_kind.setdefault(joint, Counter())["spheres"] += 1
    print(f"\n{number} parts, {asked} spheres, {time.perf_counter() - begin:.0f} s")
    print(f"{'joint':32s}" + "".join(f"{name:>9s}" for name in ("spheres", *FAULTS)))
    total: Counter[str] = Counter()
    for joint in sorted(by_kind):
        row(joint, by_kind[joint])
        total += by_kind[joint]
    row("all", total)
    return 1 if any(total[name] for name in FAULTS if name != "bridge") else 0


def load(part: Part, folder: Path, stl: bool) -> sp.Shell:
    solid = part.solid()
    if not stl:
        return sp.Shell.from_file(write_step(solid, folder / "part.step"))
    size = 2 * max(np.abs(piece.begin).max() for piece in part.profile.pieces)
    return sp.Shell.from_file(write_stl(solid, folder / "part.stl", CHORD * size), unit="mm")


def walk(shell: sp.Shell, part: Part, count: int, rng: Rng, stl: bool) -> Verdict:
    asked = spheres(part, count, rng)
    return judge(shell, part, asked, DIGITS[stl] * shell.size, chord_error(shell, part))


def tell(shell: sp.Shell, verdict: Verdict, show: int) -> None:
    """Print the faults of one part, and the first spheres of each."""
    found = ", ".join(f"{name} {len(rows)}" for name, rows in verdict.faults.items() if rows)
    exact = f"exact {sum(face.exact for face in shell.faces)}/{len(shell.faces)}"
    print(
        f"{verdict.part:44s} {exact:12s} spheres {len(verdict.spheres.radii)} "
        f"depth {verdict.worst_depth:.0e} {found}",
        flush=True,
    )
    seen: Counter[str] = Counter()
    for joint, fault, row in verdict.rows():
        seen[fault] += 1
        if seen[fault] <= show:
            center, radius = verdict.spheres.centers[row], verdict.spheres.radii[row]
            print(f"    {fault} at {joint}: center {center.tolist()}, radius {radius}")


def row(name: str, counts: "Counter[str]") -> None:
    print(f"{name:32s}" + "".join(f"{counts[key]:9d}" for key in ("spheres", *FAULTS)))


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.joints", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--count", type=int, default=100_000, help="number of spheres")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", default=[], help=f"of {', '.join(FAMILIES)}")
    parser.add_argument("--stl", action="store_true", help="binary STL files instead of STEP")
    parser.add_argument("--moved", action="store_true", help="parts turned at random")
    parser.add_argument("--show", type=int, default=0, help="spheres to print for each fault")
    options = parser.parse_args()
    if not {*options.only} <= {*FAMILIES}:
        parser.error(f"--only takes {', '.join(FAMILIES)}")
    return options


if __name__ == "__main__":
    sys.exit(main())
