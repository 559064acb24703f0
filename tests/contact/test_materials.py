"""Friction and restitution of two materials."""

import pytest

import sphshell_pin as sp

M = sp.MATERIALS


@pytest.mark.parametrize("name", M)
def test_against_steel_they_are_those_of_the_table(name):
    one = M[name]
    static, dynamic = one.friction, one.friction * one.slip
    for pair in ((one, M["steel"]), (M["steel"], one)):
        assert sp.friction_between(*pair) == pytest.approx((static, dynamic), rel=1e-15)
        assert sp.restitution_between(*pair) == min(one.restitution, 0.90)


@pytest.mark.parametrize(
    ("one", "other", "static", "dynamic"),
    [
        ("rubber", "wood", 0.80, 0.80 * 0.85),  # a thousand times softer: it conforms
        ("silicone", "rubber", 0.70, 0.70 * 0.85),
        ("plastic", "aluminium", 0.30, 0.30 * 0.80),  # 28 times softer
        ("plastic", "wood", 0.35, 0.35 * 0.80),  # 4 times: the mean, the slip of the softer one
        ("wood", "aluminium", 0.425, 0.425 * 0.75),  # 7 times
    ],
)
def test_the_much_softer_one_decides_else_the_mean(one, other, static, dynamic):
    for pair in ((M[one], M[other]), (M[other], M[one])):
        assert sp.friction_between(*pair) == pytest.approx((static, dynamic), rel=1e-12)


def test_the_more_dissipative_one_decides_the_restitution():
    assert sp.restitution_between(M["wood"], M["rubber"]) == 0.60
    assert sp.restitution_between(M["plastic"], M["rubber"]) == 0.70
