"""Each hard case keeps its bounds; the slow ones are studies."""

import pytest

from tests.hard_cases.verdict import CASES, Case, measure, table
from tests.studies import mostly_studies

ALL = CASES.collect()
SOME = mostly_studies(ALL, lambda hard: not hard.slow)


@pytest.mark.parametrize("hard", SOME, ids=lambda hard: hard.name)
def test_case(hard: Case) -> None:
    verdicts = list(hard.run())
    assert verdicts, "a case without a verdict says nothing"
    wrong = table([verdict for verdict in verdicts if not verdict.ok])
    assert not wrong.rows, "\n".join(" | ".join(cells) for cells in wrong.cells)


def test_a_case_runs_in_a_process_of_its_own() -> None:
    found = measure(quick=True, only="impact without damping")
    assert found
    assert all(verdict.ok for verdict in found)
    assert {verdict.group for verdict in found} == {"Impacts"}
