"""Runs the hard cases in processes of their own, which import this module."""

import importlib
import multiprocessing
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache

from tests.hard_cases.verdict import CASES, Case, Verdict, verdicts_table

MOST_PROCESSES = 4
collect = cache(CASES.collect)


def row(verdict: Verdict) -> list[str]:
    return verdicts_table([verdict]).cells[0]


def about(module: str) -> tuple[str, str]:
    """Return the heading of a module's cases and the text above their table."""
    heading, _, text = (importlib.import_module(module).__doc__ or module).strip().partition(".")
    return heading, text.strip()


def verdicts(number: int, quick: bool, only: str | None) -> list[Verdict]:
    """Return the verdicts of a case; the group is the heading of its module."""
    case: Case = collect(quick=quick, only=only)[number]
    return [replace(verdict, group=about(case.module)[0]) for verdict in case.verdicts()]


def measure(quick: bool = False, only: str | None = None) -> list[Verdict]:
    """Run the cases in fresh interpreters, on all cores: a case may change its process."""
    count = len(collect(quick=quick, only=only))
    workers = min(MOST_PROCESSES, os.cpu_count() or 1)
    context = multiprocessing.get_context("spawn")
    found: list[Verdict] = []
    with ProcessPoolExecutor(workers, context) as pool:
        runs = [pool.submit(verdicts, k, quick, only) for k in range(count)]
        for k, run in enumerate(runs, 1):
            found += run.result()
            print(f"\r{k / count:.0%}", end="", file=sys.stderr, flush=True)
    return found
