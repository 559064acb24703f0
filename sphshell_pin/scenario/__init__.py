"""Scenarios: TOML files that build a scene, a controller and a run."""

from sphshell_pin.scenario.format.build import Built, build, explain_built, rebuild
from sphshell_pin.scenario.format.reading import find_scenario, read_scenario, shipped_scenarios
from sphshell_pin.scenario.format.schema import Scenario
from sphshell_pin.scenario.format.sliders import LiveParameter, live_parameters
from sphshell_pin.scenario.running.figures import Verdict, judge
from sphshell_pin.scenario.running.run import RunReport, run_built, run_scenario

__all__ = [
    "Built",
    "LiveParameter",
    "RunReport",
    "Scenario",
    "Verdict",
    "build",
    "explain_built",
    "find_scenario",
    "judge",
    "live_parameters",
    "read_scenario",
    "rebuild",
    "run_built",
    "run_scenario",
    "shipped_scenarios",
]
