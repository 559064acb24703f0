"""The report's study of integrators, coarse and fast: errors fall, stiffness costs no steps."""

from dataclasses import replace
from functools import cache

import pytest

import sphshell_pin as sp
from sphshell_pin.study.report.integrators import measure
from sphshell_pin.study.report.motions import Judge, bowl, difference, press, stick_slip

CASES = {
    "bowl": lambda: replace(bowl(), duration=0.2),
    "press": lambda: press(duration=0.13),
    "stick-slip": lambda: replace(stick_slip(), duration=0.6),
}


@cache
def judge_of(name: str) -> Judge:
    return Judge(CASES[name]())


def test_references_of_different_kinds_agree():
    for name in CASES:
        (_, one), (_, other) = judge_of(name).known
        assert difference(one, other) < 1e-7


# On the press explicit methods are unstable with coarse steps, and slow with others.
@pytest.mark.parametrize(
    ("name", "coarse", "fine", "factor"),
    [
        ("bowl", sp.SemiImplicitEuler(2e-3), sp.SemiImplicitEuler(5e-4), 3),
        ("bowl", sp.RungeKutta4(2e-3), sp.RungeKutta4(1e-3), 10),
        ("bowl", sp.LinearlyImplicitEuler(1e-3), sp.LinearlyImplicitEuler(2.5e-4), 3),
        ("bowl", sp.Adaptive(1e-3), sp.Adaptive(1e-5), 50),
        ("bowl", sp.Implicit(1e-3), sp.Implicit(1e-5), 50),
        ("press", sp.LinearlyImplicitEuler(1e-2), sp.LinearlyImplicitEuler(1e-3), 10),
        ("press", sp.Implicit(1e-4), sp.Implicit(1e-6), 20),
        ("stick-slip", sp.SemiImplicitEuler(2e-4), sp.SemiImplicitEuler(5e-5), 3),
        ("stick-slip", sp.RungeKutta4(2e-4), sp.RungeKutta4(5e-5), 10),
        ("stick-slip", sp.LinearlyImplicitEuler(2e-4), sp.LinearlyImplicitEuler(5e-5), 3),
        ("stick-slip", sp.Adaptive(1e-3), sp.Adaptive(1e-5), 20),
        ("stick-slip", sp.Implicit(1e-3), sp.Implicit(1e-5), 20),
    ],
)
def test_error_falls(name, coarse, fine, factor):
    judge = judge_of(name)
    before, after = (judge.error(i, judge.case.run(i)) for i in (coarse, fine))
    assert after < before / factor


def test_implicit_presses_with_a_tenth_of_the_evaluations():
    judge = judge_of("press")
    settings = (
        sp.SemiImplicitEuler(5e-6),
        sp.SemiImplicitEuler(2e-6),
        sp.Implicit(1e-4),
        sp.Implicit(1e-5),
        sp.Implicit(1e-6),
    )
    rows = measure(replace(judge.case, integrators=settings), judge, rounds=1)
    explicit, implicit = (
        min(row.evaluations for row in rows if row.integrator == name and row.error <= 1e-4)
        for name in ("SemiImplicitEuler", "Implicit")
    )
    assert explicit > 10 * implicit
