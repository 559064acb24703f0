"""Pictures of a sweep: what is drawn where, compared with the table itself."""

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.plot.sweep import plot_sweep

pd = pytest.importorskip("pandas")
pytest.importorskip("matplotlib")


def table(**varied):
    """Return a table as of a sweep over the grid of `varied`; its figure f is known."""
    grid = np.meshgrid(*varied.values(), indexing="ij")
    columns = {key: one.ravel() for key, one in zip(varied, grid, strict=True)}
    numbers = [one.astype(float) for one in columns.values() if one.dtype.kind in "if"]
    n = len(next(iter(columns.values())))
    figure = sum((np.log(one) * 10.0**i for i, one in enumerate(numbers)), np.zeros(n))
    return pd.DataFrame(
        {"run": range(n), **columns, "status": "done", "error": "", "f": figure, "settings": ""}
    )


def test_one_number_is_a_curve():
    made = table(k=np.array([1.0, 10.0, 100.0]))
    (axis,) = plot_sweep(made.iloc[::-1], "f").axes
    (line,) = axis.lines
    np.testing.assert_array_equal(line.get_xdata(), [1, 10, 100])
    np.testing.assert_array_equal(line.get_ydata(), np.log([1, 10, 100]))
    assert (axis.get_xscale(), axis.get_xlabel()) == ("log", "k")


def test_words_are_curves_of_their_own():
    made = table(k=np.array([1.0, 2.0, 3.0]), **{"run.integrator": np.array(["a", "b"])})
    (axis,) = plot_sweep(made, "f").axes
    assert [line.get_label() for line in axis.lines] == ["integrator = a", "integrator = b"]
    assert axis.get_xscale() == "linear"


def test_two_numbers_are_a_map_with_each_value_in_its_cell():
    k, mu = np.array([1e3, 1e4, 1e5]), np.array([0.1, 0.3, 0.5, 0.7])
    made = table(mu=mu, k=k)
    made.loc[5, "f"] = np.nan
    axis, _ = plot_sweep(made.iloc[::-1], "f").axes
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("k", "mu")
    (mesh,) = axis.collections
    cells = np.ma.filled(mesh.get_array(), np.nan).reshape(len(mu), len(k))
    np.testing.assert_equal(cells, made["f"].to_numpy().reshape(len(mu), len(k)))
    assert [one.get_text() for one in axis.get_xticklabels()] == ["1000", "1e+04", "1e+05"]
    np.testing.assert_array_equal(axis.get_yticks(), [0.5, 1.5, 2.5, 3.5])


def test_numbers_varied_together_and_words_alone():
    made = table(k=np.array([1.0, 2.0, 3.0]))
    made.insert(2, "c", [4.0, 5.0, 6.0])
    (axis,) = plot_sweep(made, "f").axes
    assert axis.get_xlabel() == "k"
    (axis,) = plot_sweep(table(word=np.array(["x", "y"])), "f").axes
    assert len(axis.patches) == 2


def test_what_cannot_be_drawn_is_told():
    two = np.array([1.0, 2.0])
    with pytest.raises(InvalidParameter, match="too many keys"):
        plot_sweep(table(a=two, b=two, c=two), "f")
    with pytest.raises(InvalidParameter, match="combinations"):
        plot_sweep(table(a=two, w=np.array(list("abcdefghijklm"))), "f")
    with pytest.raises(NameNotFound, match="the table has: f"):
        plot_sweep(table(a=two), "g")


def test_the_rows_of_one_value_can_be_drawn():
    two = np.array([1.0, 2.0])
    made = table(a=two, b=two, c=two)
    axis, _ = plot_sweep(made[made["b"] == 2.0], "f").axes
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("c", "a")
