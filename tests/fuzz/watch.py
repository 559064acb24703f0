"""A process that reads damaged files, and one that watches it for crashes and hangs."""

import faulthandler
import importlib
import multiprocessing
import os
import resource
import signal
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tests.fuzz.inputs import KINDS, TURNS, make_input
from tests.fuzz.tables import prepare

PATIENCE = 600.0  # [s] by the clock: a busy machine computes little, a file that waits nothing
MEMORY = 1 << 30  # [B] on top of what the process has before its first file


@dataclass(frozen=True)
class Failure:
    """Input `k` of `seed` broke its reader: `why` in one line, with `details`."""

    seed: int
    k: int
    why: str
    details: str = ""


@dataclass
class Report:
    """What happened to how many files, by kind and outcome, and those that broke their reader."""

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    failures: list[Failure] = field(default_factory=list)


@dataclass(frozen=True)
class Task:
    """The inputs from `first` to below `last` of `seed`, until `until` [s since 1970].

    Those of other `kinds` are left out. `reader`, "module:function", takes the path of each; it may
    compute for `hang` [s].
    """

    seed: int
    first: int
    last: int
    until: float
    kinds: tuple[str, ...] = tuple(KINDS)
    reader: str = "tests.fuzz.inputs:read"
    hang: float = 10.0


def watch(task, report, failed=lambda failure: True):
    """Do `task` and fill `report`; `failed` is told of each failure, and True ends it.

    A new process takes over from one that died or hung.
    """
    context = multiprocessing.get_context("spawn")
    first = task.first
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        while first < task.last and time.time() < task.until:
            place = context.Value("q", -1, lock=False)  # of the file that is read, or -1
            ours, theirs = context.Pipe(duplex=False)
            rest = replace(task, first=first)
            worker = context.Process(target=_work, args=(rest, theirs, place, folder), daemon=True)
            worker.start()
            theirs.close()
            try:
                why = _follow(task, ours, worker, place, report, failed)
            finally:
                worker.kill()
                worker.join()
            if why is None:
                return
            stack = Path(folder, "stack.txt")
            details = stack.read_text(errors="replace") if stack.exists() else ""
            if place.value < 0:
                raise RuntimeError(f"the process that reads did not start: {why}\n{details}")
            failure = Failure(task.seed, place.value, why, details)
            report.failures.append(failure)
            report.counts[TURNS[failure.k % len(TURNS)], "broke"] += 1
            if failed(failure):
                return
            first = place.value + 1


def _follow(task, ours, worker, place, report, failed):
    """Take what `worker` reports until it ends; return why it had to, None if it came to its end.

    None as well where `failed` says that this is enough.
    """
    here, since, before = -1, time.monotonic(), 0.0
    while True:
        try:
            while ours.poll(0.2):
                what, value = ours.recv()
                if what == "failure":
                    report.failures.append(value)
                    if failed(value):
                        return None
                    continue
                if what == "end":
                    return None
                report.counts[value] += 1
        except EOFError:
            worker.join()
            code = worker.exitcode
            return f"crash: {signal.Signals(-code).name if code < 0 else f'exit code {code}'}"
        if place.value != here:
            here, since, before = place.value, time.monotonic(), _computed(worker.pid)
            continue
        computed = _computed(worker.pid) - before if here >= 0 else 0.0
        if computed > task.hang or time.monotonic() - since > PATIENCE:
            os.kill(worker.pid, signal.SIGABRT)  # faulthandler then writes where it hangs
            worker.join(5.0)
            return f"hang: more than {task.hang:g} s"


def _computed(process: int) -> float:
    """Return the processor time of a process, and of those that it started and that ended [s]."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0  # it has just ended
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def _work(task: Task, theirs: Any, place: Any, folder: str) -> None:
    """Read files one after another; a fault of Python is reported, any other ends the process."""
    home = Path(folder)
    stack = open(home / "stack.txt", "w")  # noqa: SIM115 as long as the process lives
    faulthandler.enable(stack)
    silent = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(silent, stream)
    module, _, name = task.reader.partition(":")
    read = getattr(importlib.import_module(module), name)

    prepare(home)
    for kind in task.kinds:
        KINDS[kind].corpus()  # made once
    space = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (space + MEMORY, space + MEMORY))
    for k in range(task.first, task.last):
        if TURNS[k % len(TURNS)] not in task.kinds:
            continue
        if time.time() >= task.until:
            break
        place.value = -1  # an input may take long to make
        one = make_input(task.seed, k)
        path = home / f"input{one.suffix}"
        path.write_bytes(one.data)
        place.value = k
        try:
            outcome = read(path)
        except BaseException as fault:
            outcome = "broke"
            why = f"{type(fault).__name__}: {' '.join(str(fault).split())[:200]}"
            theirs.send(("failure", Failure(task.seed, k, why, traceback.format_exc())))
        theirs.send(("news", (TURNS[k % len(TURNS)], outcome)))
    theirs.send(("end", None))
