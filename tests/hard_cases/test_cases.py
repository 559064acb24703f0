"""Each hard case keeps its bounds; the slow ones are studies."""

from __future__ import annotations

import pytest

from tests.hard_cases.__main__ import collect, row
from tests.hard_cases.verdict import CASES, Case
from tests.studies import mostly_studies

ALL = collect()
SOME = mostly_studies(ALL, lambda hard: not hard.slow)


@pytest.mark.parametrize("hard", SOME, ids=lambda hard: hard.name)
def test_case(hard: Case) -> None:
    verdicts = list(hard.run())
    assert verdicts, "a case without a verdict says nothing"
    wrong = [" | ".join(row(verdict)) for verdict in verdicts if not verdict.ok]
    assert not wrong, "\n".join(wrong)


def test_every_module_has_cases() -> None:
    assert {case.module for case in ALL} == set(CASES.modules)
