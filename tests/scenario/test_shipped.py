"""The shipped scenarios come out as they expect."""

import pytest

from sphshell_pin.errors import MissingExtra
from sphshell_pin.scenario import build, judge, shipped_scenarios
from sphshell_pin.scenario.running.figures import check_expectations
from sphshell_pin.scenario.running.run import simulate


@pytest.mark.parametrize("name", shipped_scenarios())
def test_a_shipped_scenario_comes_out_as_expected(name):
    try:
        built = build(name)
    except MissingExtra:
        pytest.skip("needs the example-robot-data loaders")
    check_expectations(built)
    result, stopped = simulate(built)
    assert stopped is None
    for verdict in judge(built, result):
        assert verdict.met, f"{verdict.figure}: {verdict.measured}, expected {verdict.expected}"
