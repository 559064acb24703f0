"""Two-velocity Coulomb friction against the documented table and formula."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphshell_pin import CoulombFriction
from sphshell_pin.errors import InvalidParameter
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


@pytest.mark.parametrize("knot", [0.1, 1.0])
def test_once_differentiable_at_the_knots(knot: float) -> None:
    h = 1e-6
    below, at, above = (DEFAULTS.coefficient(knot + s * h) for s in (-1, 0, 1))
    assert abs((above - at) - (at - below)) / h < 1e-3


@pytest.mark.parametrize(
    ("share", "creep"),
    [(1 / 6, 0.1116), (1 / 3, 0.2261), (2 / 3, 0.4817), (5 / 6, 0.645), (29 / 30, 0.847)],
)
def test_creep_speed(share: float, creep: float) -> None:
    """Below v_static the coefficient is mu_s (3 w - w^3)/2: a held load creeps at w v_static."""
    w = np.roots([-0.5, 0.0, 1.5, -share])
    w = float(np.real(w[(np.abs(w.imag) < 1e-12) & (w.real > 0) & (w.real <= 1)][0]))
    assert DEFAULTS.coefficient(w * 0.1) == pytest.approx(0.3 * share, rel=1e-12)
    assert w == pytest.approx(creep, abs=6e-4)


@pytest.mark.parametrize(
    ("values", "name"), [((0.1, 0.3, 0.1, 1.0), "mu_dynamic"), ((0.3, 0.1, 0.1, 0.1), "v_dynamic")]
)
def test_values_that_do_not_fit_together_are_refused(values, name: str) -> None:
    with pytest.raises(InvalidParameter) as caught:
        CoulombFriction(*values)
    assert caught.value.name == name
