"""The register of the hard cases."""

from __future__ import annotations

from sphshell_pin.cases.contents import Verdict, at_most, compare
from sphshell_pin.cases.register import Case, Register, Verdicts

__all__ = ["CASES", "Case", "Verdict", "Verdicts", "at_most", "case", "compare"]
# In the order of the page. A module's docstring is the text above its table.
CASES: Register[Case] = Register(
    "tests.hard_cases",
    (
        "analytic_impact",
        "analytic_rolling",
        "analytic_surfaces",
        "analytic_energy",
        "impacts",
        "under_stiff",
        "extremes",
        "resting",
        "starts",
        "repeats",
    ),
    Case,
)
case = CASES.case
