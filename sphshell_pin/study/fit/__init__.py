"""Fits parameters of a scenario to measured data."""

from sphshell_pin.study.fit.data import Experiment, Series
from sphshell_pin.study.fit.fitting import fit
from sphshell_pin.study.fit.report import Fit, Fitted

__all__ = ["Experiment", "Fit", "Fitted", "Series", "fit"]
