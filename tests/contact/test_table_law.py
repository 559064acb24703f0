"""A law from a table: monotone, of one slope at its rows, energy the integral of force."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sphshell_pin as sp
from sphshell_pin.errors import ScenarioError
from sphshell_pin.scenario import build
from tests import models
from tests.scenario.files import DROP, write

SPRING = sp.ImpactLaw(1e6, 1.5)
DEPTHS = 2e-3 * np.linspace(0.0, 1.0, 200) ** 2
TABLE = sp.TableLaw(DEPTHS, [SPRING.normal_force(depth) for depth in DEPTHS])
LAW_LINE = next(line for line in DROP.splitlines() if line.startswith("law"))

steps = st.lists(st.floats(1e-3, 10.0), min_size=1, max_size=12)


def table_of(deeper: list[float], more: list[float]) -> sp.TableLaw:
    rows = min(len(deeper), len(more))
    columns = [[0.0, *np.cumsum(column[:rows])] for column in (deeper, more)]
    return sp.TableLaw(*columns)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(steps, steps)
def test_it_goes_through_its_rows_and_never_falls(deeper, more) -> None:
    law = table_of(deeper, more)
    for depth, force in zip(law.depth, law.force, strict=True):
        assert law.normal_force(depth) == pytest.approx(force, rel=1e-9)
    dense = np.linspace(0.0, 1.5 * law.depth[-1], 400)
    forces = np.array([law.normal_force(depth) for depth in dense])
    assert (np.diff(forces) >= -1e-12 * forces[-1]).all()
    assert law.normal_stiffness(2 * law.depth[-1]) > 0


@settings(derandomize=True, deadline=None)
@given(steps, steps, st.floats(0.01, 1.3))
def test_stiffness_and_energy_belong_to_the_force(deeper, more, share) -> None:
    law = table_of(deeper, more)
    depth = share * law.depth[-1]
    h = 1e-6 * depth
    low, at, high = (law.normal_force(depth + k * h) for k in (-1, 0, 1))
    # A row may lie between: there the slope has a kink, which is of order h.
    largest = 3 * max(np.diff(law.force) / np.diff(law.depth))
    tolerance = 1e-4 * largest + 1e-9 * at / h
    assert (high - low) / (2 * h) == pytest.approx(law.normal_stiffness(depth), abs=tolerance)
    work = (law.energy(depth + h) - law.energy(depth - h)) / (2 * h)
    assert work == pytest.approx(at, rel=1e-4, abs=1e-4 * law.force[1])
    assert law.depth_at(law.normal_force(depth)) == pytest.approx(depth, rel=1e-6)
    assert law.depth_of(law.energy(depth)) == pytest.approx(depth, rel=1e-9)


def test_the_slope_is_continuous_at_the_rows() -> None:
    law = sp.TableLaw([0.0, 1.0, 1.5, 4.0], [0.0, 0.2, 3.0, 3.1])
    for row in law.depth[1:]:
        below, above = (law.normal_stiffness(row * (1 + s * 1e-12)) for s in (-1, 1))
        assert below == pytest.approx(above, rel=1e-9, abs=1e-9)


def test_it_reproduces_the_spring_that_it_was_taken_from() -> None:
    for ask in ("normal_force", "energy"):
        most = getattr(SPRING, ask)(2e-3)
        for depth in np.linspace(0.0, 2e-3, 997):
            exact = getattr(SPRING, ask)(depth)
            assert getattr(TABLE, ask)(depth) == pytest.approx(exact, abs=1e-6 * most)
    asked = {"depth_at": (20.0,), "depth_of": (1e-3,), "contact_time": (1e-3, 0.3)}
    for ask, numbers in (asked | {"shortest_time": (1.0, 0.3, 10.0)}).items():
        found, exact = (getattr(law, ask)(*numbers) for law in (TABLE, SPRING))
        assert found == pytest.approx(exact, rel=1e-5), ask


def test_it_is_explained_and_pickled() -> None:
    scene = models.on_plate(models.ball(), TABLE)
    assert "table of 200 rows down to 2 mm" in str(scene.explain())
    assert pickle.loads(pickle.dumps(scene)).pairs[0].law == TABLE


def test_a_scenario_names_a_file_beside_it(tmp_path) -> None:
    rows = "".join(f"{d!r},{f!r}\n" for d, f in zip(TABLE.depth, TABLE.force, strict=True))
    (tmp_path / "rubber.csv").write_text(f"# measured\ndepth [m], force [N]\n{rows}")
    text = DROP.replace(LAW_LINE, 'law = { type = "table", file = "rubber.csv" }')
    built = build(write(tmp_path, text))
    assert built.scene.pairs[0].law == TABLE
    stated = built.scenario.model_dump()["contact"][0]["law"]
    assert stated == {"type": "table", "file": "rubber.csv"}
    result = built.simulation.run(built.q0, built.v0, 0.01)
    result.save(tmp_path / "run.npz")
    np.testing.assert_array_equal(sp.Result.load(tmp_path / "run.npz").q, result.q)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0,0\n", "at least 2 rows"),
        ("", "at least 2 rows"),
        ("0,0\n1e-3,1\n1e-3,2\n", r"depth\[2\] = 0.001 must be more than the row before, 0.001"),
        ("0,0\n1e-3,2\n2e-3,1\n", r"force\[2\] = 1.0 must be more than the row before, 2.0"),
        ("1e-3,0\n2e-3,1\n", r"depth\[0\] = 0.001 must be 0"),
        ("0,1\n2e-3,2\n", r"force\[0\] = 1.0 must be 0"),
        ("0,0\n1e-3,nan\n", "must hold two numbers in line 2"),
        ("0,0\n1e-3,1_0\n", "must hold two numbers in line 2"),
        ("depth,force\n0,0\n1e-3,1,2\n", "two numbers in line 3"),
        ("0,0\nx,1\n", "two numbers in line 2"),
        (None, "cannot be read"),
    ],
)
def test_a_wrong_file_is_refused_in_one_sentence(rows, said, tmp_path) -> None:
    if rows is not None:
        (tmp_path / "t.csv").write_text(rows)
    text = DROP.replace(LAW_LINE, 'law = { type = "table", file = "t.csv" }')
    with pytest.raises(ScenarioError, match=said) as caught:
        build(write(tmp_path, text))
    assert caught.value.key == "contact.ball-plate"
    assert "\n" not in str(caught.value)
