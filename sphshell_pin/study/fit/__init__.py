"""Fits parameters of a scenario to measured data."""

from sphshell_pin.study.fit.data import Experiment
from sphshell_pin.study.fit.fitting import fit
from sphshell_pin.study.fit.report import Fit, Fitted, Series

__all__ = ["Experiment", "Fit", "Fitted", "Series", "fit"]
