"""Generate parts, write them as files, and compare what is read with their exact CAD faces.

python -m tests.parts [--count 300] [--seed 1] [--only 123 124] [--write]
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Sequence
from importlib.util import find_spec

import numpy as np

from benchmarks.measured import Measured, write
from tests.parts.files import KINDS_OF_FILE
from tests.parts.judge import MARGIN, Verdict
from tests.parts.running import run
from tests.parts.solids import FAMILIES, family_of

Rows = list[Sequence[str]]
"""Of texts, the headings first."""


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
    rows = by_file(verdicts)
    print("\n".join(" | ".join(row) for row in rows))
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


def by_file(verdicts: list[Verdict]) -> Rows:
    """One row for each kind of file of which not all are spoiled."""
    kinds = dict.fromkeys(verdict.file for verdict in verdicts if not verdict.spoiled)
    cells = [summary(kind, [v for v in verdicts if v.file == kind]) for kind in kinds]
    return [tuple(cells[0]), *(tuple(row.values()) for row in cells)] if cells else []


def summary(file: str, verdicts: list[Verdict]) -> dict[str, str]:
    """Cells by their headings."""
    kept = [verdict for verdict in verdicts if not verdict.spoiled]
    spoiled = len(verdicts) - len(kept)
    worse = [verdict for verdict in kept if verdict.worse]
    planes = [verdict for verdict in kept if verdict.touches]
    lost = [sum(v.lost[method] for v in kept) for method in ("smooth", "facets")]
    not_ok = [sum(not verdict.ok for verdict in some) for some in (kept, worse)]
    ratio = np.exp(np.mean([np.log(verdict.ratio) for verdict in kept]))
    seconds, triangles = sum(v.seconds for v in kept), sum(v.triangles for v in kept)
    return {
        "file": file,
        "parts": str(len(kept)) + (f" ({spoiled} spoiled)" if spoiled else ""),
        "worse than flat": str(len(worse)),
        "mean error over flat's": f"{ratio:.3f}",
        "largest over flat's": f"{max(largest_ratio(verdict) for verdict in kept):.3g}",
        "planes off": f"{sum(v.off_plane > 0 for v in planes)} of {len(planes)}",
        "force on them, curved": forces(planes, "smooth"),
        "flat": forces(planes, "facets"),
        "touches lost, curved / flat": f"{lost[0]} / {lost[1]} of {sum(v.touches for v in kept)}",
        "health not ok (of the worse)": f"{not_ok[0]} ({not_ok[1]})",
        "recognized": f"{np.mean([v.recognized for v in kept]):.2f}",
        "ms per 1000 triangles": f"{1e6 * seconds / triangles:.1f}",
    }


def forces(verdicts: list[Verdict], method: str) -> str:
    if not verdicts:
        return "-"
    low = min(verdict.forces[method][0] for verdict in verdicts)
    return f"{low:.3f} to {max(verdict.forces[method][1] for verdict in verdicts):.4g}"


def largest_ratio(verdict: Verdict) -> float:
    """Largest error, curved over flat; flat ones below the margin count as that."""
    return verdict.largest["smooth"] / max(verdict.largest["facets"], MARGIN)


if __name__ == "__main__":
    sys.exit(main())
