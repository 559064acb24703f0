"""Damaged CAD files, read as users read them: `python -m tests.fuzz.cad --count 500 --seed 1`.

OpenCASCADE crashes on some of them and never ends on others; that must reach the process that
reads them as an error of the package, within the limits of time and memory. It stops at anything
else and keeps the file: the last one is always in the folder, should this process itself crash.
"""

import argparse
import faulthandler
import random
import resource
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

from sphshell_pin import Shell, SphshellError
from tests.fuzz.mutate import damage

TIME_LIMIT = 10.0
"""Given to OpenCASCADE for each file [s]."""

HANG = 20.0
"""Beyond the limit; what takes longer is a fault [s]."""

MOST_MEMORY = 2e9
"""Of this process [bytes]."""

KINDS = {
    "makes OpenCASCADE crash": "child crashed",
    "time limit": "child out of time",
    "memory limit": "child out of memory",
    "makes OpenCASCADE fail": "OpenCASCADE failed",
    "no valid answer": "child answered badly",
}
"""By what its message says, the outcome of a file."""


def bases(folder: Path) -> list[Path]:
    """Small whole files of all formats, made by OpenCASCADE in `folder`."""
    from sphshell_pin.shell.cad import require_kernel
    from tests.shell import cad_shapes as shapes

    require_kernel("making files to damage")  # and keep OpenCASCADE from printing
    made = []
    for name in ("box", "cylinder", "ring", "drilled_plate", "roof", "rounded_box"):
        shape = getattr(shapes, name)()
        made.append(shapes.write_step(folder / f"{name}.step", (name, shape)))
        made.append(shapes.write_iges(folder / f"{name}.iges", shape))
        made.append(shapes.write_iges(folder / f"{name}_solid.iges", shape, solids=1))
        made.append(shapes.write_brep(folder / f"{name}.brep", shape))
    return made


def outcome(path: Path, time_limit: float = TIME_LIMIT) -> str:
    """Read a file and use its surface; return how that ended. Foreign exceptions come through."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            unit = "mm" if path.suffix == ".brep" else None
            shell = Shell.from_file(path, unit, time_limit=time_limit)
            shell.curvature_report()
            shell.contacts(shell.vertices[0], 0.1 * shell.size)
        except SphshellError as error:
            told = (kind for part, kind in KINDS.items() if part in str(error))
            return next(told, type(error).__name__)
    return "read"


def main() -> int:
    """Read damaged files until one of them does harm; print how they ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--count", type=int, default=sys.maxsize)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--time-limit", type=float, default=TIME_LIMIT)
    parser.add_argument("--out", type=Path, help="folder for the file that did harm")
    given = parser.parse_args()
    folder = given.out or Path(tempfile.mkdtemp(prefix="fuzz_cad_"))
    folder.mkdir(parents=True, exist_ok=True)
    found: Counter[tuple[str, str]] = Counter()
    start, longest = time.monotonic(), 0.0
    with tempfile.TemporaryDirectory() as whole:
        files = bases(Path(whole))
        for row in range(given.count):
            if time.monotonic() - start > given.seconds:
                break
            rng = random.Random(f"{given.seed}/{row}")
            base = rng.choice(files)
            path = folder / f"cad_{given.seed}_{row}{base.suffix}"
            path.write_bytes(damage(rng, base.read_bytes()))
            before = time.monotonic()
            faulthandler.dump_traceback_later(given.time_limit + HANG, exit=True)
            ended = outcome(path, given.time_limit)
            faulthandler.cancel_dump_traceback_later()
            longest = max(longest, time.monotonic() - before)
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
            if memory > MOST_MEMORY:
                print(f"{path}: this process took {memory / 1e9:.2f} GB")
                return 1
            found[base.suffix, ended] += 1
            if given.out is None or ended not in KINDS.values():
                path.unlink()
            else:
                print(f"{path.name}: {ended}", flush=True)
    for (suffix, ended), count in sorted(found.items()):
        print(f"{suffix:6} {ended:20} {count:6}")
    print(f"{sum(found.values())} files, the longest took {longest:.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
