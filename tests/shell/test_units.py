"""Units of length, ADAMS's numbers in SI, and the warning that names millimeters."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphshell_pin import units
from sphshell_pin.errors import InvalidParameter


def test_lengths():
    for name, value in units.METERS_PER_UNIT.items():
        assert units.meters_per_unit(name) == units.meters_per_unit(f" {name.upper()} ") == value
    assert 25.4 * units.meters_per_unit("mm") == pytest.approx(units.meters_per_unit("in"))
    assert units.meters_per_unit("ft") == pytest.approx(12.0 * units.meters_per_unit("inch"))
    for wrong in ("furlong", "", None, 3):
        with pytest.raises(InvalidParameter, match="must be one of: m, dm, cm, mm"):
            units.meters_per_unit(wrong)


def test_default_stiffness_of_adams_is_not_1e8():
    assert units.adams_stiffness_to_si(1e5, 2.2) == pytest.approx(1e5 * 1000**2.2)
    assert units.adams_damping_to_si(10.0) == pytest.approx(1e4)
    assert units.adams_length_to_si(0.1) == pytest.approx(1e-4)
    with pytest.raises(InvalidParameter, match="mm-N-s, m-N-s"):
        units.adams_damping_to_si(1.0, "furlong-N-s")


@given(st.sampled_from(sorted(units.ADAMS_UNITS)), st.floats(1.0, 3.0), st.floats(1e-3, 1e3))
def test_the_force_does_not_depend_on_the_unit(system, exponent, depth):
    length, force = units.ADAMS_UNITS[system]
    stiffness = units.adams_stiffness_to_si(3.0, exponent, system)
    expected = pytest.approx(force * 3.0 * depth**exponent, rel=1e-12)
    assert stiffness * (depth * length) ** exponent == expected


def test_size_warning():
    for size in (0.4, np.nextafter(12.0, 0.0)):
        assert units.size_warning(size, 0.012, "sphere") is None
    assert units.size_warning(1.0, 0.0, "sphere") is None
    assert units.size_warning(12.0, 0.012, "sphere") is not None
    text = units.size_warning(400.0, 0.012, "sphere 'tip' (radius)")
    for part in ("400 m", "sphere 'tip'", "unit='mm'", "0.4 m"):
        assert part in text
