"""Each hard case keeps its bounds; the slow ones run with python -m tests.hard_cases alone."""

from __future__ import annotations

import pytest

from tests.hard_cases.__main__ import MODULES, collect, row
from tests.hard_cases.verdict import Case

pytestmark = pytest.mark.slow

CASES = collect()


@pytest.mark.parametrize("hard", [c for c in CASES if not c.slow], ids=lambda hard: hard.name)
def test_case(hard: Case) -> None:
    verdicts = hard.run()
    assert verdicts, "a case without a verdict says nothing"
    wrong = [" | ".join(row(verdict)) for verdict in verdicts if not verdict.ok]
    assert not wrong, "\n".join(wrong)


def test_every_module_has_cases() -> None:
    assert {case.module.rpartition(".")[2] for case in CASES} == set(MODULES)
