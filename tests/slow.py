"""Writes tests/slow.txt, the tests that `make quick` leaves out: `pytest -p tests.slow`."""

from collections import Counter
from pathlib import Path

import pytest

LIST = Path(__file__).with_name("slow.txt")
LONG = 0.5  # [s] of a function's tests together

_taken: Counter[str] = Counter()


def function_of(test: str) -> str:
    """Return the name of a test without its parameters."""
    return test.partition("[")[0]


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up what the tests of each function take."""
    _taken[function_of(report.nodeid)] += report.duration


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the list, once where several processes run tests."""
    if not hasattr(session.config, "workerinput"):
        slow = sorted(name for name, seconds in _taken.items() if seconds > LONG)
        LIST.write_text("".join(f"{name}\n" for name in slow), "utf-8")
