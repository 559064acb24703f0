"""The shipped scenarios come out as they expect."""

import pytest

from sphshell_pin.errors import MissingExtra
from sphshell_pin.scenario import build, shipped_scenarios
from sphshell_pin.scenario.running.figures import check_expectations
from tests.scenario.files import run_well


@pytest.mark.parametrize("name", shipped_scenarios())
def test_a_shipped_scenario_comes_out_as_expected(name):
    try:
        built = build(name)
    except MissingExtra:
        pytest.skip("needs the example-robot-data loaders")
    check_expectations(built)
    run_well(built)
