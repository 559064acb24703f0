"""Live scenarios: parameters, targets and bodies that change while a run goes on."""

from sphshell_pin.scenario.live.live_run import LiveRun as LiveRun
