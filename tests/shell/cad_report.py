"""How near shells of CAD files are to the exact surfaces: `python -m tests.shell.cad_report`.

Prints a line per real file and per known surface, and writes nothing. `--samples` points are taken
of each surface, 10 000 unless said; names of files choose among them.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from sphshell_pin import Shell
from sphshell_pin.shell.cad import require_kernel
from tests.oracle.cad import ExactShape, curved_places, deviation
from tests.shell import cad_shapes as shapes
from tests.shell.cad_cases import (
    KNOWN,
    REAL_FILES,
    force_errors,
    order,
    rms,
    stated_and_measured,
)
from tests.shell.surfaces import DATA, MORE_DATA


def file_of(name: str) -> Path:
    """Where a real file is, or would be."""
    return next((f / name for f in (DATA, MORE_DATA) if (f / name).is_file()), MORE_DATA / name)


def report_files(names: list[str], samples: int) -> None:
    """Print deviation both ways, area and volume of each real file."""
    from sphshell_pin.shell.cad.reading import read_model

    print(
        f"{'file':34s} {'s':>5s} {'elements':>8s} {'stated':>8s} {'says':>8s} | "
        f"{'flat':>8s} {'back':>8s} {'smooth':>8s} {'back':>8s} | "
        f"curved: {'border':>8s} {'sides':>8s} {'inside':>8s} | area off  volume off"
    )
    for name in names:
        start = time.perf_counter()
        shell = Shell.from_file(file_of(name), REAL_FILES[name])
        took = time.perf_counter() - start
        stated, says, held = stated_and_measured(shell)
        shape = read_model(file_of(name)).shape
        exact = ExactShape(shape)
        found = deviation(shell, exact, samples).largest
        curved = [
            float(exact.closest(places).distances.max(initial=0.0)) if len(places) else 0.0
            for places in curved_places(shell, samples // 10).values()
        ]
        area, volume = shapes.area_and_volume(shape)
        health = shell.health
        off = f"{health.area / (area * 1e-6) - 1:+.1e}"
        off += f"  {abs(health.volume / (volume * 1e-9)) - 1:+.1e}" if shell.is_closed else "  open"
        print(
            f"{name:34s} {took:5.1f} {len(shell.elements):8d} {stated:8.2e} {says:8.2e} | "
            + " ".join(f"{one:8.2e}" for one in (found[0], found[2], found[1], found[3]))
            + " |         "
            + " ".join(f"{one:8.2e}" for one in curved)
            + f" | {off} "
            + ("held" if held and max(found[0], found[2], *curved) <= stated else "NOT HELD"),
            flush=True,
        )


def report_forces(levels: int) -> None:
    """Print the error of the smooth force on known surfaces, under refinement."""
    print("\nforce k depth^1.5 on balls, relative error (order) as the chord error falls")
    for name, known in KNOWN.items():
        with tempfile.TemporaryDirectory() as folder:
            path = shapes.write_brep(Path(folder) / "part.brep", known.make())
            before = None
            for level in range(levels):
                shell = Shell.from_file(path, "mm", chord_error=known.chord / known.step**level)
                errors, chord = force_errors(shell, known), stated_and_measured(shell)[1]
                figures = (rms(errors), float(errors.max()))
                line = f"{name:18s} {len(shell.elements):7d} elements, measured {chord:8.2e} m"
                for k, (what, figure) in enumerate(zip(("rms", "max"), figures, strict=True)):
                    line += f", {what} {figure:8.2e}"
                    if before is not None:
                        line += f" ({order((before[0][k], figure), (before[1], chord)):.1f})"
                print(line, flush=True)
                before = (figures, chord)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--levels", type=int, default=3, help="chord errors, one below the other")
    parser.add_argument("names", nargs="*", default=list(REAL_FILES))
    chosen = parser.parse_args()
    require_kernel("this report")
    report_files([n for n in chosen.names if file_of(n).is_file()], chosen.samples)
    if chosen.levels:
        report_forces(chosen.levels)
