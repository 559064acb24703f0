"""Processes that run into one new folder at once: `python -m tests.scenario.races --rounds 300`.

Each round has a folder and processes of its own. One may compute, and begins when the others have
ended: each of these must say in a sentence that another process writes there. All results of the
one must be there, and nothing beside them.
"""

import argparse
import contextlib
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path

from sphshell_pin.cli import main as command
from sphshell_pin.scenario.running import run
from tests.scenario.operations import visible

WORDS = "sphshell-pin run sphere_on_shell --duration 0.01 --no-recording --no-figures --out x/out"
RESULTS = {"contacts.csv", "run.npz", "summary.json"}
TOLD = "is writing it: wait until it ends, or give another folder with --out"


def take_part(start: int, computing: int, go: int) -> int:
    """Run the command when `start` ends: 0 for results, 1 for the sentence, 2 for all else."""
    os.read(start, 1)
    simulate, said = run.simulate, Path(f"said by {os.getpid()}")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(os.open(said, os.O_WRONLY | os.O_CREAT), 2)

    def wait(*given, **more):
        os.write(computing, b"c")
        os.read(go, 1)
        return simulate(*given, **more)

    run.simulate, sys.argv = wait, WORDS.split()
    try:
        command()
    except SystemExit as end:
        told = end.code == 2 and " ".join(said.read_text().split()).endswith(TOLD)
        return 1 if told else 2 if end.code else 0
    return 0


def race(processes: int) -> str:
    """Let processes meet in a folder that is not there; return what was wrong, or nothing."""
    (start, begin), (computed, computing), (go, let) = os.pipe(), os.pipe(), os.pipe()
    children = set()
    for _ in range(processes):
        child = os.fork()
        if child == 0:
            code = 3
            with contextlib.suppress(BaseException):
                os.close(begin)
                os.close(let)
                code = take_part(start, computing, go)
            os._exit(code)
        children.add(child)
    os.close(begin)
    codes = Counter[int]()
    while children:
        if len(children) == 1:
            os.close(let)
        child, status = os.wait()
        if child in children:  # not one that an earlier test left
            children.remove(child)
            codes[os.waitstatus_to_exitcode(status)] += 1
    os.close(computing)
    begun = len(os.read(computed, processes))
    for one in (start, computed, go):
        os.close(one)
    found = {*visible(Path("x/out"))}
    if codes != {0: 1, 1: processes - 1} or begun != 1:
        return f"exit codes {dict(codes)}, and {begun} began to compute"
    return "" if found == RESULTS and os.listdir("x") == ["out"] else f"{os.listdir('x')}: {found}"


def main(arguments: list[str] | None = None) -> int:
    """Race; return how many rounds went wrong."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=300)
    parser.add_argument("--processes", type=int, default=5)
    chosen = parser.parse_args(arguments)
    wrong = 0
    for k in range(chosen.rounds):
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            if found := race(chosen.processes):
                wrong += 1
                print(f"round {k}: {found}", flush=True)
    print(f"{chosen.rounds} rounds of {chosen.processes} processes, {wrong} went wrong")
    return wrong


if __name__ == "__main__":
    sys.exit(main())
