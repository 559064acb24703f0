"""Parts one after the other, in a process of their own: OpenCASCADE may crash it."""

import signal
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context

from tests.parts.judge import Verdict, judged, random_part

SECONDS = 120
"""A part that takes longer is ended."""


@dataclass(frozen=True)
class Outcome:
    """What came of a number: verdicts, or why the part was skipped, and what the shell refused."""

    number: int
    verdicts: tuple[Verdict, ...] = ()
    skipped: str = ""
    refused: tuple[str, ...] = ()


def run(numbers: Iterable[int], seed: int, kinds: tuple[str, ...]) -> Iterator[Outcome]:
    """Yield the outcome of each number."""
    pool = _pool()
    try:
        for number in numbers:
            try:
                yield pool.submit(outcome, number, seed, kinds).result()
            except BrokenProcessPool:
                pool = _pool()
                yield Outcome(number, skipped=f"crashed, or took more than {SECONDS} s")
    finally:
        pool.shutdown()


def outcome(number: int, seed: int, kinds: tuple[str, ...]) -> Outcome:
    # The alarm ends the process: nothing else interrupts OpenCASCADE.
    signal.alarm(SECONDS)
    try:
        part = random_part(number, seed)
    except Exception as error:  # OpenCASCADE's have no class of their own
        signal.alarm(0)
        return Outcome(number, skipped=f"{type(error).__name__}: {error}")
    verdicts, refused = [], []
    for kind in kinds:
        try:
            verdicts.append(judged(part, kind))
        except Exception as error:
            refused.append(f"{kind}: {type(error).__name__}: {error}")
    signal.alarm(0)
    return Outcome(number, tuple(verdicts), refused=tuple(refused))


def _pool() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"))
