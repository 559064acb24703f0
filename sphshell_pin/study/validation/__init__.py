"""Runs against published experiments and solutions: nothing is tuned, parameters are published."""

from sphshell_pin.study.validation.cases import Case, Outcome, collect, make_validation

__all__ = ["Case", "Outcome", "collect", "make_validation"]
