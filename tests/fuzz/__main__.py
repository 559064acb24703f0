"""Damage small files of every kind that the package reads, and watch what its readers do.

    python -m tests.fuzz --seconds 60 --seed 1     stop at the first fault, exit code 1
    python -m tests.fuzz --files 50000 --go-on     list all faults
    python -m tests.fuzz --repeat 1:4711           one input again, with its traceback

A reader may read a file or refuse it with the package's own error; anything else is a fault: a
crash, more than 10 s or 1 GB for one file, any other exception. Input k of seed s is always the
same. The files that broke a reader are kept in the folder --out.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.fuzz.inputs import KINDS, TURNS, make_input, read
from tests.fuzz.tables import prepare
from tests.fuzz.watch import Failure, Report, Task, watch


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--files", type=int, help="as many files, however long it takes")
    parser.add_argument("--kind", choices=KINDS, nargs="+", help="files of these kinds alone")
    parser.add_argument("--go-on", action="store_true", help="do not stop at the first fault")
    parser.add_argument("--out", type=Path, default=Path("build/fuzz"), help="default: %(default)s")
    parser.add_argument("--repeat", metavar="SEED:K", help="read one input again, unwatched")
    options = parser.parse_args()
    if options.repeat:
        return repeat(*map(int, options.repeat.split(":")))
    return fuzz(options)


def fuzz(options: argparse.Namespace) -> int:
    report, told = Report(), Counter[str]()
    start = time.time()

    def failed(failure: Failure) -> bool:
        # The same fault at the same place is shown once.
        rows = failure.details.splitlines()
        own = ("/sphshell_pin/", "/robots/")
        where = [row.strip() for row in rows if any(folder in row for folder in own)]
        of_stack = rows[:1] and rows[0].startswith("Fatal")  # the innermost call is the first
        mark = f"{failure.why.partition(':')[0]} {(where or ['?'])[0 if of_stack else -1]}"
        told[mark] += 1
        path = keep(failure, options.out)
        if told[mark] == 1:
            show(failure, path, rows[:9] if of_stack else rows[-6:])
        return not options.go_on

    kinds = tuple(options.kind or KINDS)
    until = start + (1e9 if options.files else options.seconds)
    last = sys.maxsize
    if options.files:
        last = options.files * len(TURNS) // sum(turn in kinds for turn in TURNS)
    watch(Task(options.seed, 0, last, until, kinds), report, failed)
    print_table(report, time.time() - start)
    for mark, count in told.most_common():
        print(f"{count} x {mark}")
    return 1 if report.failures else 0


def keep(failure: Failure, out: Path) -> Path:
    """Write the input that broke its reader into the folder `out`."""
    one = make_input(failure.seed, failure.k)
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"{one.kind}-{failure.seed}-{failure.k}{one.suffix}"
    path.write_bytes(one.data)
    return path


def show(failure: Failure, path: Path, rows: list[str]) -> None:
    again = f"{failure.seed}:{failure.k}"
    print(f"{again}: {failure.why}")
    print(f"  kept as {path}; again: python -m tests.fuzz --repeat {again}")
    print("".join(f"    {row}\n" for row in rows), flush=True)


def print_table(report: Report, seconds: float) -> None:
    print(f"{'kind':12}{'files':>9}{'read':>9}{'refused':>9}{'broke':>9}")
    rows = {k: [report.counts[k, name] for name in ("read", "refused", "broke")] for k in KINDS}
    rows["all"] = [sum(each) for each in zip(*rows.values(), strict=True)]
    files = sum(rows["all"])
    for kind, row in rows.items():
        if any(row):
            print(f"{kind:12}{sum(row):9}{''.join(f'{n:9}' for n in row)}")
    faults = len(report.failures)
    print(f"{seconds:.0f} s, {files / seconds:.0f} files a second; {faults} faults")


def repeat(seed: int, k: int) -> int:
    one = make_input(seed, k)
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        path = Path(folder) / f"input{one.suffix}"
        path.write_bytes(one.data)
        start = time.monotonic()
        print(f"{one.kind} {seed}:{k}: {read(path)} in {time.monotonic() - start:.2f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
