"""Two-velocity Coulomb friction against the documented table and formula."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphshell_pin import CoulombFriction
from tests.oracle import laws as oracle

DEFAULTS = CoulombFriction(mu_static=0.3, mu_dynamic=0.1, v_static=0.1, v_dynamic=1.0)


@pytest.mark.parametrize(
    ("slip_mm", "mu"),
    [(0, 0), (10, 0.04485), (50, 0.20625), (100, 0.3), (300, 0.27476), (550, 0.2), (1000, 0.1)],
)
def test_table(slip_mm: float, mu: float) -> None:
    assert DEFAULTS.coefficient(slip_mm * 1e-3) == pytest.approx(mu, abs=5e-6)
    assert DEFAULTS.coefficient(2.0) == 0.1


@settings(derandomize=True, deadline=None)
@given(st.floats(0.0, 3.0))
def test_both_printed_forms_agree(slip: float) -> None:
    expected = oracle.coulomb(slip, 0.3, 0.1, 0.1, 1.0)
    assert DEFAULTS.coefficient(slip) == pytest.approx(expected, abs=1e-15)
