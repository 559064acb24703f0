"""Run the hard cases of tests/hard_cases in processes of their own; they belong to a checkout.

`python -m sphshell_pin.benchmarks.hard_cases [--quick] [--only WORD]`, in the root of the
checkout, prints a line of JSON for each case.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import sphshell_pin
from sphshell_pin.benchmarks.timing import Progress, silent

MOST_PROCESSES = 4


@dataclass(frozen=True)
class Row:
    """One verdict: what was tried, the law, how far it is from it; `bound` bounds `error`."""

    group: str
    case: str
    tried: str
    law: str
    expected: float | str
    measured: float | str
    error: float
    bound: float
    ok: bool


@dataclass(frozen=True)
class Found:
    """The verdicts of all cases that ran, and the seconds they took."""

    rows: list[Row]
    cases: int
    seconds: float


def checkout() -> Path | None:
    """Return the root of the checkout from which the package runs; None where it is installed."""
    root = Path(sphshell_pin.__file__).parent.parent
    return root if (root / "tests" / "hard_cases" / "__main__.py").exists() else None


def measure(
    root: Path, *, quick: bool = False, only: str | None = None, progress: Progress = silent
) -> Found:
    """Run the cases of the checkout at `root`, on all cores; `quick` leaves out the slow ones."""
    command = [sys.executable, "-m", "sphshell_pin.benchmarks.hard_cases"]
    command += ["--quick"] * quick + (["--only", only] if only else [])
    start = time.perf_counter()
    told: list[dict[str, Any]] = []
    count = min(MOST_PROCESSES, os.cpu_count() or 1)
    processes = [
        subprocess.Popen(
            [*command, "--part", f"{k}/{count}"],
            cwd=root,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        for k in range(count)
    ]
    try:
        with ThreadPoolExecutor(count) as pool:
            followed = [pool.submit(follow, one, told, progress) for one in processes]
            try:
                for one in followed:
                    one.result()
            except BaseException:
                end(processes)  # else the pool would wait for them
                raise
    finally:
        end(processes)
    told.sort(key=lambda case: int(case["number"]))
    rows = [Row(case["hard_case"], **v) for case in told for v in case["verdicts"]]
    return Found(rows, len(told), time.perf_counter() - start)


def follow(process: subprocess.Popen[str], told: list[dict[str, Any]], progress: Progress) -> None:
    """Add what a process tells to `told`; raise RuntimeError where it ends early."""
    assert process.stdout is not None
    said = ""
    for line in process.stdout:
        if not line.startswith('{"hard_case"'):
            said = line.strip() or said  # of a case itself, or of an error
            continue
        told.append(json.loads(line))
        progress(len(told) / told[-1]["of"])
    if process.wait() != 0:
        why = said or f"exit code {process.returncode}"
        raise RuntimeError(f"the hard cases ended early: {why}")


def end(processes: list[subprocess.Popen[str]]) -> None:
    """End the processes that still run."""
    for process in processes:
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


def heading(module: str) -> str:
    """Return the heading of a module of cases."""
    text = importlib.import_module(module).__doc__ or module
    return text.strip().partition(".")[0]


def main() -> None:
    """Run the cases, print a line of JSON for each."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.hard_cases", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--quick", action="store_true", help="leave out the slow cases")
    parser.add_argument("--only", metavar="WORD", help="cases whose name or module has the word")
    parser.add_argument("--part", default="0/1", help="K/N: of the cases every N-th, from K on")
    options = parser.parse_args()
    cases: Any = importlib.import_module("tests.hard_cases.__main__")
    chosen = [
        known
        for known in cases.collect()
        if not (options.quick and known.slow)
        and (not options.only or options.only in f"{known.module} {known.name}")
    ]
    first, count = map(int, options.part.split("/"))
    for number in range(first, len(chosen), count):
        known = chosen[number]
        verdicts = [{**asdict(v), "ok": bool(v.ok)} for v in cases.run(known)]
        told = {"hard_case": heading(known.module), "verdicts": verdicts}
        told |= {"number": number, "of": len(chosen)}
        print(json.dumps(told, default=float), flush=True)


if __name__ == "__main__":
    main()
