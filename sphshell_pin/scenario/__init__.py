"""Scenarios: TOML files that build a scene, a controller and a run."""

from sphshell_pin.scenario.format.build import Built as Built
from sphshell_pin.scenario.format.build import build as build
from sphshell_pin.scenario.format.build import explain_built as explain_built
from sphshell_pin.scenario.format.build import rebuild as rebuild
from sphshell_pin.scenario.format.reading import find_scenario as find_scenario
from sphshell_pin.scenario.format.reading import read_scenario as read_scenario
from sphshell_pin.scenario.format.reading import shipped_scenarios as shipped_scenarios
from sphshell_pin.scenario.format.schema import Scenario as Scenario
from sphshell_pin.scenario.format.sliders import LiveParameter as LiveParameter
from sphshell_pin.scenario.format.sliders import live_parameters as live_parameters
from sphshell_pin.scenario.running.figures import Verdict as Verdict
from sphshell_pin.scenario.running.figures import judge as judge
from sphshell_pin.scenario.running.run import RunReport as RunReport
from sphshell_pin.scenario.running.run import run_built as run_built
from sphshell_pin.scenario.running.run import run_scenario as run_scenario
