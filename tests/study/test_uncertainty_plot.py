"""Pictures of samples: what is drawn where, compared with the numbers themselves."""

import numpy as np
import pytest

from sphshell_pin.plot.uncertainty import plot_bands, plot_uncertainty
from sphshell_pin.study.sweep import sobol_indices
from tests.study.ishigami import ishigami_table

pd = pytest.importorskip("pandas")
pytest.importorskip("matplotlib")


def moved(keys):
    """Return a tornado whose last input changes least, on one side only."""
    n = len(keys)
    low = np.linspace(-2, 0.5, n)
    columns = {"low_value": -1.0, "high_value": 1.0, "low": low, "median": 1.0, "high": 3.0}
    return pd.DataFrame(columns, index=keys)


def test_the_histogram_counts_every_run_that_has_the_figure():
    values = np.r_[np.linspace(0, 1, 50), np.nan, np.nan]
    (axis,) = plot_uncertainty("pairs.a-b.peak_force", values).axes
    assert sum(bar.get_height() for bar in axis.patches) == 50
    assert axis.get_title() == "50 runs (2 without this figure left out)"
    assert axis.get_xlabel() == "peak force [N]"
    lines = {line.get_label(): line.get_xdata()[0] for line in axis.lines}
    assert lines == {
        f"{name}: {np.percentile(values[:50], at):.4g}": np.percentile(values[:50], at)
        for name, at in {"5 %": 5, "median": 50, "95 %": 95}.items()
    }


def test_whole_numbers_have_a_bar_each():
    (axis,) = plot_uncertainty("touches", np.array([1.0, 1.0, 2.0, 4.0])).axes
    bars = {bar.get_x() + bar.get_width() / 2: bar.get_height() for bar in axis.patches}
    assert bars == {1: 2, 2: 1, 3: 0, 4: 1}


@pytest.mark.parametrize("values", [[np.nan], [3.5, 3.5], [1e300, -1e300, 0], list(range(10_000))])
def test_odd_values_are_drawn(values):
    (axis,) = plot_uncertainty("f", np.array(values, dtype=float)).axes
    known = int(np.sum(~np.isnan(values)))
    assert sum(bar.get_height() for bar in axis.patches) == known
    assert len(axis.patches) <= 60
    assert [one.get_text() for one in axis.texts] == ([] if known else ["No run has this figure."])


def test_the_bars_of_the_tornado_begin_at_the_median():
    (axis,) = plot_uncertainty("f", tornado=moved(["x", "y", "z"])).axes
    ends = [bar.get_x() + bar.get_width() for bar in axis.patches]
    assert {bar.get_x() for bar in axis.patches} == {1.0}
    assert ends == [-2, -0.75, 0.5, 3, 3, 3]
    order = [label.get_text() for label in axis.get_yticklabels()]
    assert order == ["x", "y", "z"]
    assert np.all(np.diff(axis.get_yticks()) < 0)  # from the top


def test_sobol_indices_are_bars_with_their_intervals():
    found = sobol_indices(ishigami_table(64), "f")
    *_, axis = plot_uncertainty("f", np.zeros(3), moved(["x"]), found).axes
    ordered = found.sort_values("total", ascending=False)
    assert [bar.get_width() for bar in axis.patches] == [*ordered["first"], *ordered["total"]]
    first, total = axis.collections
    for kind, lines in (("first", first), ("total", total)):
        drawn = [segment[:, 0].tolist() for segment in lines.get_segments()]
        exact = ordered[[f"{kind}_low", f"{kind}_high"]].to_numpy()
        np.testing.assert_allclose(drawn, exact, rtol=1e-12)


def test_of_many_inputs_the_largest_are_drawn():
    keys = [f"key {i}" for i in range(30)]
    (axis,) = plot_uncertainty("f", tornado=moved(keys)).axes
    assert [label.get_text() for label in axis.get_yticklabels()] == keys[:20]
    assert "(20 of 30)" in axis.get_title()


def test_bands_lie_around_their_median():
    t = np.linspace(0, 1, 11)
    columns = {one: np.sin(t) * 1e-6 + one * 1e-7 for one in (5, 25, 50, 75, 95)}
    bands = pd.DataFrame({"t": t, **columns, "runs": [8] * 10 + [7]})
    canvas = plot_bands(bands, "pairs.a-b.depth")
    (axis,) = canvas.axes
    assert axis.get_ylabel() == "largest depth [µm]"
    (line,) = axis.lines
    np.testing.assert_allclose(line.get_ydata(), columns[50] * 1e6, rtol=1e-12)
    for area, (low, high) in zip(axis.collections, ((5, 95), (25, 75)), strict=True):
        (path,) = area.get_paths()
        heights = np.unique(np.round(path.vertices[:, 1], 9))
        edges = np.unique(np.round(np.r_[columns[low], columns[high]] * 1e6, 9))
        np.testing.assert_array_equal(heights, edges)
    assert canvas.get_suptitle() == "pairs.a-b.depth: quantiles of 7 to 8 runs"


def test_bands_of_no_run_say_so():
    columns = dict.fromkeys((5, 25, 50, 75, 95), np.full(2, np.nan))
    bands = pd.DataFrame({"t": [0.0, 1.0], **columns, "runs": 0})
    (axis,) = plot_bands(bands, "q.joint").axes
    assert [one.get_text() for one in axis.texts] == ["No run has this curve."]
    assert axis.get_ylabel() == "q.joint"
