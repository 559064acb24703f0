"""Sobol indices and tornado of tables: against closed forms, and what is refused."""

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.study.sweep import quantiles, sobol_indices, tornado
from sphshell_pin.study.sweep.sampling import design_of
from tests.study.ishigami import DIST, FIRST, KEYS, TOTAL, ishigami, ishigami_table, table_of

pytest.importorskip("pandas")

N = 8192


def covers(found, kind, exact):
    return (found[f"{kind}_low"] <= exact) & (exact <= found[f"{kind}_high"])


def test_the_indices_of_ishigamis_function():
    found = sobol_indices(ishigami_table(N), "f")
    assert found.index.tolist() == KEYS
    np.testing.assert_allclose(found["first"], FIRST, rtol=0, atol=0.01)
    np.testing.assert_allclose(found["total"], TOTAL, rtol=0, atol=0.01)
    assert covers(found, "first", FIRST).all()
    assert covers(found, "total", TOTAL).all()
    assert (
        found[["first_high", "total_high"]].to_numpy() - found[["first_low", "total_low"]] < 0.1
    ).all(axis=None)


def test_the_order_of_the_rows_does_not_matter_and_the_intervals_are_repeatable():
    table = ishigami_table(64)
    found = sobol_indices(table, "f")
    assert sobol_indices(table.sample(frac=1, random_state=1), "f").equals(found)
    narrow = sobol_indices(table, "f", confidence=0.5)
    assert (narrow["total_low"] > found["total_low"]).all()
    assert (narrow["total_high"] < found["total_high"]).all()


@pytest.mark.study
@pytest.mark.parametrize("tables", [150, 300])
def test_intervals_cover_95_percent_where_the_points_are_random(tables):
    """The bootstrap takes the points for independent: with such points it must be right."""
    rng = np.random.default_rng(5)
    n = 512
    design = design_of(DIST, "sobol", n, indices=True)
    hits = []
    for _ in range(tables):
        a, b = rng.uniform(-np.pi, np.pi, (2, n, 3))
        swaps = [np.where(np.arange(3) == i, b, a) for i in range(3)]
        values = ishigami(np.stack([a, b, *swaps], axis=1).reshape(-1, 3))
        found = sobol_indices(table_of(design, values), "f")
        hits.append([covers(found, "first", FIRST), covers(found, "total", TOTAL)])
    # As if the six intervals of a table all hit or missed together: 2.4 standard deviations.
    assert abs(np.mean(hits) - 0.95) < 2.4 * np.sqrt(0.95 * 0.05 / tables)


def test_a_constant_figure_has_no_indices():
    table = ishigami_table(8)
    for value in (0.0, 3.7):
        table["f"] = value
        with pytest.raises(InvalidParameter, match=f"'f' is {value:g} in all runs: without a var"):
            sobol_indices(table, "f")
    table["f"] = 0.3 * (1 + 1e-16 * np.arange(len(table)))  # the same but for rounding
    with pytest.raises(InvalidParameter, match="without a variance"):
        sobol_indices(table, "f")


def test_whole_numbers_are_numbers():
    """A step function of one input: all of its variance comes from there."""
    design = design_of({"x": "uniform(0,1)", "y": "uniform(0,1)"}, "sobol", 1024, indices=True)
    table = table_of(design, np.floor(4 * design.values[:, 0]).astype(int))
    found = sobol_indices(table, "f")
    np.testing.assert_allclose(found[["first", "total"]].loc["x"], [1, 1], atol=0.02)
    assert found.loc["y", ["first", "total", "first_low", "total_high"]].tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize(("value", "words"), [(np.nan, "it is nan"), (np.inf, "it is inf")])
def test_a_hole_in_the_design_is_told(value, words):
    table = ishigami_table(8)
    table.loc[7, "f"] = value
    with pytest.raises(InvalidParameter, match=rf"1 of 40 runs \(AB .*0, run 7: {words}\)"):
        sobol_indices(table, "f")
    table.loc[7, "error"] = "it broke"
    with pytest.raises(InvalidParameter, match=r"run 7: it broke\): Sobol indices of the others"):
        sobol_indices(table, "f")


def test_tables_that_are_no_such_design_are_told():
    table = ishigami_table(8)
    with pytest.raises(NameNotFound, match="no figure 'g'; the table has: f"):
        sobol_indices(table, "g")
    with pytest.raises(InvalidParameter, match="table lacks rows"):
        sobol_indices(table.iloc[1:], "f")
    with pytest.raises(InvalidParameter, match="no runs for a tornado"):
        tornado(table, "f")
    with pytest.raises(InvalidParameter, match="no column 'design'"):
        sobol_indices(table.drop(columns="design"), "f")
    for confidence in (0.0, 1, 95):
        with pytest.raises(InvalidParameter, match="between 0 and 1"):
            sobol_indices(table, "f", confidence=confidence)
    alone = design_of(DIST, tornado=True)
    table = table_of(alone, ishigami(alone.values))
    with pytest.raises(InvalidParameter, match="no runs for Sobol indices"):
        sobol_indices(table, "f")
    with pytest.raises(InvalidParameter, match="no sample, only a tornado"):
        quantiles(table)
    table.loc[2, "f"] = np.nan
    with pytest.raises(InvalidParameter, match="a tornado of the others would be wrong"):
        tornado(table, "f")


def test_the_tornado_has_the_largest_change_first():
    design = design_of(
        {"a": "uniform(0,1)", "b": "uniform(0,1)", "c": "uniform(-1,1)"}, tornado=True
    )
    a, b, c = design.values.T
    found = tornado(table_of(design, a + 3 * b + 10 * c**2), "f")
    assert found.index.tolist() == ["c", "b", "a"]
    # Both ends of c lie on one side of its median.
    np.testing.assert_allclose(found.loc["c"], [-0.9, 0.9, 2 + 8.1, 2, 2 + 8.1], rtol=1e-12)
    np.testing.assert_allclose(found.loc["b"], [0.05, 0.95, 0.65, 2, 3.35], rtol=1e-12)
