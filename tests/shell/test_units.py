"""Units of length, ADAMS's numbers in SI, and the warning that names millimeters."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.units import (
    ADAMS_UNITS,
    METERS_PER_UNIT,
    adams_damping_to_si,
    adams_length_to_si,
    adams_stiffness_to_si,
    meters_per_unit,
    size_warning,
)


def test_lengths():
    for name, value in METERS_PER_UNIT.items():
        assert meters_per_unit(name) == meters_per_unit(f" {name.upper()} ") == value
    assert 25.4 * meters_per_unit("mm") == pytest.approx(meters_per_unit("in"))
    assert meters_per_unit("ft") == pytest.approx(12.0 * meters_per_unit("inch"))
    for wrong in ("furlong", "", None, 3):
        with pytest.raises(InvalidParameter, match="must be one of: m, dm, cm, mm"):
            meters_per_unit(wrong)


def test_default_stiffness_of_adams_is_not_1e8():
    assert adams_stiffness_to_si(1e5, 2.2) == pytest.approx(1e5 * 1000**2.2)
    assert adams_damping_to_si(10.0) == pytest.approx(1e4)
    assert adams_length_to_si(0.1) == pytest.approx(1e-4)
    with pytest.raises(InvalidParameter, match="mm-N-s, m-N-s"):
        adams_damping_to_si(1.0, "furlong-N-s")


@given(st.sampled_from(sorted(ADAMS_UNITS)), st.floats(1.0, 3.0), st.floats(1e-3, 1e3))
def test_the_force_does_not_depend_on_the_unit(units, exponent, depth):
    length, force = ADAMS_UNITS[units]
    stiffness = adams_stiffness_to_si(3.0, exponent, units)
    assert stiffness * (depth * length) ** exponent == pytest.approx(
        force * 3.0 * depth**exponent, rel=1e-12
    )


def test_size_warning():
    for size in (0.4, np.nextafter(12.0, 0.0)):
        assert size_warning(size, 0.012, "sphere") is None
    assert size_warning(1.0, 0.0, "sphere") is None
    assert size_warning(12.0, 0.012, "sphere") is not None
    text = size_warning(400.0, 0.012, "sphere 'tip' (radius)")
    for part in ("400 m", "sphere 'tip'", "unit='mm'", "0.4 m"):
        assert part in text
