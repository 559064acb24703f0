"""Sweeps: one scenario run many times with other values, over processes or a Dask cluster."""

from sphshell_pin.study.sweep.driver import run_plan, sweep
from sphshell_pin.study.sweep.indices import quantiles, sobol_indices
from sphshell_pin.study.sweep.plan import Plan, plan_sweep
from sphshell_pin.study.sweep.points import Points, grid_of, sample_of

__all__ = [
    "Plan",
    "Points",
    "grid_of",
    "plan_sweep",
    "quantiles",
    "run_plan",
    "sample_of",
    "sobol_indices",
    "sweep",
]
