"""What a sweep varies: texts to values, values to runs; wrong ones are reported in one sentence."""

import math
from itertools import pairwise

import numpy as np
import pytest

from sphshell_pin import errors
from sphshell_pin.errors import InvalidParameter, NameNotFound, SphshellError
from sphshell_pin.study.sweep import grid_of, plan_sweep
from tests.study.resting import write
from tests.tables import cases_of

WRONG = cases_of("wrong_sweeps")
KEY = "contact.law.stiffness"


def values(text):
    return grid_of([f"key={text}"]).values["key"]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        # Equal steps and factors have both ends and short numbers.
        ("0:1:11", (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)),
        ("1:-1:3", (1.0, 0.0, -1.0)),
        ("1e3:1e6:log:4", (1e3, 1e4, 1e5, 1e6)),
        # Lists are of numbers, words, truths or lists.
        ("1, 2.5,1e-3, .5", (1, 2.5, 1e-3, 0.5)),
        ("adaptive,implicit", ("adaptive", "implicit")),
        ("true,false", (True, False)),
        ("[0,0,-9.81],[0, 0, -1.6]", ("[0, 0, -9.81]", "[0, 0, -1.6]")),
        ("a.py:f,b.py:g", ("a.py:f", "b.py:g")),
    ],
)
def test_a_text_is_steps_or_a_list(text, found):
    assert values(text) == found


def test_equal_factors_have_both_ends_and_one_ratio():
    found = values("2.5e-3:7:log:9")
    assert (found[0], found[-1]) == (2.5e-3, 7.0)
    ratios = [b / a for a, b in pairwise(found)]
    assert ratios == pytest.approx([(7 / 2.5e-3) ** (1 / 8)] * 8, rel=1e-11)


def test_python_values_are_taken_as_they_are_and_numbers_as_exact_texts():
    given = [0.1 + 0.2, 1e-308, math.pi, 2**53, np.int64(3)]
    found = grid_of({"a": given})
    assert found.values["a"] == (*given[:4], 3)
    assert [float(one["a"]) for one in found.changes] == given
    found = grid_of({"b": [True, False, "x", [1, "y"], 7]})
    assert [one["b"] for one in found.changes] == ["true", "false", "x", '[1, "y"]', "7"]


def test_the_last_key_turns_fastest():
    vary = {"a": [1, 2], "b": ["x", "y"]}
    assert grid_of(vary).values == {"a": (1, 1, 2, 2), "b": ("x", "y", "x", "y")}


@pytest.mark.parametrize(("vary", "words"), [({"k": [None]}, "numbers, words"), *WRONG["values"]])
def test_wrong_values_are_told(vary, words):
    with pytest.raises(InvalidParameter, match=words):
        grid_of(vary)


@pytest.mark.parametrize(("vary", "kind", "words"), WRONG["keys"])
def test_a_wrong_key_or_value_is_told_before_anything_runs(tmp_path, vary, kind, words):
    with pytest.raises(getattr(errors, kind), match=words):
        plan_sweep(write(tmp_path), vary, changes={"contact.ball-plate.law.damping": "4"})


def test_an_unknown_scenario_is_told():
    with pytest.raises(NameNotFound, match="fingertip_on_blade"):
        plan_sweep("no_such", [f"{KEY}=1,2"])


def test_integrators_may_vary_where_the_file_gives_a_step(tmp_path):
    path = write(tmp_path)
    vary = ["run.integrator=adaptive,semi-implicit-euler"]
    text = path.read_text().replace('"implicit"\n', '"runge-kutta-4"\ndt = 1e-3\n')
    path.write_text(text)
    plan = plan_sweep(path, vary)
    assert len(set(plan.digests)) == 2
    with pytest.raises(SphshellError, match="takes rtol and atol, not dt"):
        plan_sweep(path, [*vary, "run.dt=1e-3,1e-4"])
