"""How the figures of a report are judged, and read."""

import math

import pytest

from sphshell_pin.study.report.contents import Finding, number


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.2345, "1.23"), (0.0, "0"), (2.66e-15, "2.7\u00d710⁻¹⁵"), (199712, "199\u202f712"),
        (12345.6, "12\u202f346"), (math.nan, "-"), (None, ""),
    ],
)  # fmt: skip
def test_numbers(value, text):
    assert number(value) == text


def test_nothing_measured_meets_no_aim():
    assert Finding("a", "a", math.nan, aim=1.0).met is None
    assert Finding("a", "a", math.nan, aim=1.0, sense=">=").met is None
    assert Finding("a", "a", math.nan, aim=1.0).verdict == "not measured"
    assert Finding("a", "a", math.nan).verdict == ""
    assert Finding("a", "a", 1.0, aim=1.0).met is True
    assert Finding("a", "a", 1.0).met is None


def test_a_missed_figure_never_reads_like_its_aim():
    assert Finding("a", "a", 1.8011613, "x", aim=1.8).text == "1.801 x"
    assert Finding("a", "a", 1.8000004, "x", aim=1.8).text == "1.8000004 x"
    assert Finding("a", "a", 14.9999, aim=15.0, sense=">=").text == "14.9999"
    assert Finding("a", "a", 1.7999, "x", aim=1.8).text == "1.8 x"
    assert Finding("a", "a", 1.8011, "x").text == "1.8 x"
