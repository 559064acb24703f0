"""The report's study of integrators, coarse and fast: errors fall, stiffness costs no steps."""

from dataclasses import replace
from functools import cache

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
