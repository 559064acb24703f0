"""Each public case gives the figure that is its truth, and the page says what was measured."""

import warnings

import pytest

from tests.public_cases import CASES, machines, motion, surfaces  # noqa: F401  (registered by importing)
from tests.public_cases.__main__ import PAGE, listed


@pytest.mark.parametrize("name", CASES)
def test_the_figure_is_its_truth(name):
    one = CASES[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert one.measure() == pytest.approx(one.truth, rel=0.0, abs=one.bound)


def test_the_page_lists_all_cases():
    assert set(listed(PAGE.read_text(encoding="utf-8"))) == set(CASES)
