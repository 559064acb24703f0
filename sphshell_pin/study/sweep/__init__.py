"""Sweeps: one scenario run many times with other values, over processes or a Dask cluster."""

from sphshell_pin.study.sweep.distributions import Distribution, LogNormal, Normal, Uniform
from sphshell_pin.study.sweep.driver import SweepReport, run_plan, sweep
from sphshell_pin.study.sweep.grid import Axis, axes_of
from sphshell_pin.study.sweep.indices import quantiles, sobol_indices, tornado
from sphshell_pin.study.sweep.plan import Plan, plan_sweep

__all__ = [
    "Axis",
    "Distribution",
    "LogNormal",
    "Normal",
    "Plan",
    "SweepReport",
    "Uniform",
    "axes_of",
    "plan_sweep",
    "quantiles",
    "run_plan",
    "sobol_indices",
    "sweep",
    "tornado",
]
