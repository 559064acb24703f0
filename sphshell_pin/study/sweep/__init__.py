"""Sweeps: one scenario run many times with other values, over processes or a Dask cluster."""

from __future__ import annotations

from sphshell_pin.study.sweep.driver import Plan, SweepReport, plan_sweep, run_plan, sweep
from sphshell_pin.study.sweep.grid import Axis, axes_of

__all__ = ["Axis", "Plan", "SweepReport", "axes_of", "plan_sweep", "run_plan", "sweep"]
