"""Generate parts, write them as files, and compare what is read with their exact CAD faces.

python -m tests.parts [--count 300] [--seed 1] [--only 123 peg] [--show] [--write]
"""

import argparse
import sys
import time
from collections import Counter
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

from benchmarks.measured import Measured, write
from tests.parts import tables
from tests.parts.cad_mesh import KINDS
from tests.parts.files import KINDS_OF_FILE
from tests.parts.judge import METHODS, Part, Verdict, distance_errors, loaded, random_part
from tests.parts.running import Outcome, run
from tests.parts.solids import FAMILIES, family_of, random_solid


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
        if options.show and not outcome.skipped:
            show(random_part(outcome.number, options.seed), kinds)
        if options.keep and not outcome.skipped:
            keep(outcome.number, options.seed, options.keep)
    verdicts = [verdict for outcome in outcomes for verdict in outcome.verdicts]
    found = sections(verdicts)
    for one in found:
        print(f"## {one.title}\n\n{tables.table(one.table)}\n")
    failed = Counter(f"{family_of(one.number)}: {one.skipped}" for one in outcomes if one.skipped)
    print(f"\n{len(outcomes)} parts, {failed.total()} skipped {dict(failed)}")
    print(f"{time.perf_counter() - begin:.0f} s")
    if options.write:
        command = f"python -m tests.parts --count {options.count} --seed {options.seed} --write"
        text = (
            f"{len(outcomes)} parts of {len(FAMILIES)} families; OpenCASCADE failed on "
            f"{failed.total()}, which were skipped."
        )
        print(f"wrote {write('mesh_parts', command, [Measured(text=text), *found])}")
    return 1 if any(outcome.refused for outcome in outcomes) else 0


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.parts", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--count", type=int, default=300, help="number of parts")
    parser.add_argument("--seed", type=int, default=1, help="of all parts together")
    parser.add_argument("--only", nargs="+", default=[], help="numbers of parts, or families")
    parser.add_argument("--without", nargs="+", default=[], help="kinds of files to leave out")
    parser.add_argument("--show", action="store_true", help="where the errors are")
    parser.add_argument("--keep", type=Path, help="folder for the STEP files of the parts")
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


def sections(verdicts: list[Verdict]) -> list[Measured]:
    """Return what the site shows."""
    first = next((kind for kind in KINDS_OF_FILE if any(v.file == kind for v in verdicts)), "")
    own = [verdict for verdict in verdicts if verdict.file == first]
    found = [
        Measured("Kinds of files", table=tables.by_file(verdicts)),
        Measured(f"Families: {first}", table=tables.by_family(own)),
    ]
    for name, group in tables.groups(verdicts, "file"):
        faces = tables.by_face(group)
        if faces:
            found.append(Measured(f"Triangles by their CAD face: {name}", table=faces))
    return [*found, Measured("The worst", table=tables.worst(verdicts))]


def show(part: Part, kinds: tuple[str, ...]) -> None:
    """Print where the largest errors of a part's files are, by the kind of the CAD face."""
    counts = np.bincount(part.mesh.kind, minlength=len(KINDS))
    triangles = ", ".join(f"{n} {k}" for k, n in zip(KINDS, counts.tolist(), strict=True) if n)
    print(
        f"     deflection {part.deflection:.0e} of {part.mesh.size:.1f} mm; triangles: "
        f"{triangles}; {len(part.places.points)} places, {part.places.dropped} dropped"
    )
    for kind in kinds:
        shell, _, _ = loaded(part, kind)
        curved, flat = (distance_errors(shell, part, method)[0] for method in METHODS)
        for k in np.unique(part.places.kinds).tolist():
            own = np.flatnonzero(part.places.kinds == k)
            row = own[curved[own].argmax()]
            at = ", ".join(f"{x:.4f}" for x in part.places.points[row])
            away = part.places.distances[row]
            print(
                f"     {kind}, beside a {KINDS[k]}: {curved[row]:.1e}, largest flat "
                f"{flat[own].max():.1e}, at ({at}) mm, {away:.4f} mm from it"
            )


def keep(number: int, seed: int, folder: Path) -> None:
    """Write the solid of a part as a STEP file."""
    folder.mkdir(parents=True, exist_ok=True)
    writer = STEPControl_Writer()
    writer.Transfer(random_solid(number, seed), STEPControl_AsIs)
    writer.Write(str(folder / f"{family_of(number)}_{seed}_{number}.step"))


if __name__ == "__main__":
    sys.exit(main())
