"""Scenarios: TOML files that build a scene, a controller and a run."""

from __future__ import annotations

from sphshell_pin.scenario.build import Built, build, explain_built, rebuild
from sphshell_pin.scenario.figures import Verdict, judge
from sphshell_pin.scenario.knobs import Knob, knobs_of
from sphshell_pin.scenario.reading import find_scenario, read_scenario, shipped_scenarios
from sphshell_pin.scenario.run import RunReport, run_built, run_scenario
from sphshell_pin.scenario.schema import Scenario

__all__ = [
    "Built",
    "Knob",
    "RunReport",
    "Scenario",
    "Verdict",
    "build",
    "explain_built",
    "find_scenario",
    "judge",
    "knobs_of",
    "read_scenario",
    "rebuild",
    "run_built",
    "run_scenario",
    "shipped_scenarios",
]
