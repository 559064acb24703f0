"""Uncertain inputs: points and Sobol indices against closed forms, and their pictures."""

import math

import numpy as np
import pytest
from scipy import stats

from sphshell_pin import robots
from sphshell_pin.errors import InvalidParameter, NameNotFound, ScenarioError
from sphshell_pin.plot.uncertainty import plot_uncertainty
from sphshell_pin.study.sweep import plan_sweep, quantiles, sample_of, sobol_indices, sweep
from tests.command import succeed
from tests.study.resting import GRAVITY
from tests.tables import cases_of

pd = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")
pytest.importorskip("matplotlib")

STIFFNESS, DAMPING = "contact.law.stiffness", "contact.law.damping"
WRONG = cases_of("wrong_sweeps")
DIST = {STIFFNESS: "lognormal(1e5,1.5)", DAMPING: "uniform(1,5)"}

# Ishigami's function: T. Ishigami and T. Homma, ISUMA 1990; variances V1, V2 and V13, all others
# are zero.
A, B = 7.0, 0.1
ANGLES = dict.fromkeys(("x", "y", "z"), f"uniform({-np.pi!r},{np.pi!r})")
V1 = 0.5 * (1 + B * np.pi**4 / 5) ** 2
V2 = A**2 / 8
V13 = B**2 * np.pi**8 * (1 / 18 - 1 / 50)
FIRST = np.array([V1, V2, 0.0]) / (V1 + V2 + V13)
TOTAL = np.array([V1 + V13, V2, V13]) / (V1 + V2 + V13)


def ishigami(x, y, z):
    return np.sin(x) + A * np.sin(y) ** 2 + B * z**4 * np.sin(x)


def columns(design):
    """Return the values (n, d) of the runs."""
    return np.column_stack(list(design.values.values()))


def table_of(design, values):
    """Return the table of a design, as a sweep makes it, whose figure f has `values`."""
    named = {"run": range(len(values)), **design.values}
    more = {"status": "done", "error": "", "design": design.parts, "f": values, "settings": ""}
    return pd.DataFrame(named | more)


def ishigami_table(n, **design):
    """Return the table of a sweep of n (d + 2) runs, with the function in place of a scenario."""
    made = sample_of(ANGLES, n, indices=True, **design)
    return table_of(made, ishigami(*columns(made).T))


def covers(found, kind, exact):
    return (found[f"{kind}_low"] <= exact) & (exact <= found[f"{kind}_high"])


def test_quantiles_are_those_of_the_textbook():
    # 0.8413... of a normal distribution lies below one deviation over the mean.
    below = 0.5 * (1 + math.erf(math.sqrt(0.5)))
    shares = np.array([1 - below, 0.5, below])
    texts = ["a = normal(10, 2e0)", "b=Uniform(10,12)", "c=lognormal(6,1.5)"]
    found = [np.quantile(one, shares) for one in sample_of(texts, 2**14).values.values()]
    np.testing.assert_allclose(found, [[8, 10, 12], 10 + 2 * shares, [4, 6, 9]], rtol=2e-3)


@pytest.mark.parametrize(("dist", "words"), WRONG["distributions"])
def test_wrong_distributions_are_told(dist, words):
    with pytest.raises(InvalidParameter, match=words):
        sample_of(dist, 8)


@pytest.mark.parametrize(("arguments", "words"), WRONG["arguments"])
def test_arguments_that_do_not_go_together_are_told(scenario, arguments, words):
    stated = {key: DIST if value == "DIST" else value for key, value in arguments.items()}
    with pytest.raises((InvalidParameter, ScenarioError), match=words):
        plan_sweep(scenario, **stated)


def test_each_interval_of_equal_probability_has_one_point():
    dist = {"a": "normal(3,2)", "b": "lognormal(2,3)", "c": stats.uniform(-1, 2)}
    found = columns(sample_of(dist, 64)).T
    exact = [stats.norm(3, 2), stats.lognorm(math.log(3), scale=2), stats.uniform(-1, 2)]
    for values, one in zip(found, exact, strict=True):
        assert sorted((64 * one.cdf(values)).astype(int)) == list(range(64))
    again, other = (columns(sample_of(dist, 64, seed=seed)).T for seed in (0, 1))
    assert np.array_equal(again, found)
    assert not np.any(other == found)


def test_the_design_is_saltellis():
    design = sample_of({"x": "uniform(0,1)", "y": "uniform(2,3)"}, 16, indices=True)
    assert design.parts == ("A", "B", "AB x", "AB y") * 16
    a, b, x, y = (columns(design)[i::4] for i in range(4))
    np.testing.assert_array_equal(x, np.column_stack([b[:, 0], a[:, 1]]))
    np.testing.assert_array_equal(y, np.column_stack([a[:, 0], b[:, 1]]))
    both = np.column_stack([a, b]) - [0, 2, 0, 2]
    assert all(sorted((16 * one).astype(int)) == list(range(16)) for one in both.T)


def test_the_indices_of_ishigamis_function():
    table = ishigami_table(8192)
    found = sobol_indices(table, "f")
    assert found.index.tolist() == ["x", "y", "z"]
    for kind, exact in (("first", FIRST), ("total", TOTAL)):
        np.testing.assert_allclose(found[kind], exact, rtol=0, atol=0.01)
        assert covers(found, kind, exact).all()
        assert (found[f"{kind}_high"] - found[f"{kind}_low"] < 0.1).all()
    few = ishigami_table(64)
    found = sobol_indices(few, "f")
    assert sobol_indices(few.sample(frac=1, random_state=1), "f").equals(found)
    narrow = sobol_indices(few, "f", confidence=0.5)
    assert (narrow["total_low"] > found["total_low"]).all()
    assert (narrow["total_high"] < found["total_high"]).all()


@pytest.mark.study
def test_intervals_cover_95_percent_where_the_points_are_random():
    """The bootstrap takes the points for independent: with such points it must be right."""
    rng, n, tables, hits = np.random.default_rng(5), 512, 300, []
    design = sample_of(ANGLES, n, indices=True)
    for _ in range(tables):
        a, b = rng.uniform(-np.pi, np.pi, (2, n, 3))
        swaps = [np.where(np.arange(3) == i, b, a) for i in range(3)]
        values = ishigami(*np.stack([a, b, *swaps], axis=1).reshape(-1, 3).T)
        found = sobol_indices(table_of(design, values), "f")
        hits.append([covers(found, "first", FIRST), covers(found, "total", TOTAL)])
    # As if the six intervals of a table all hit or missed together: 2.4 standard deviations.
    assert abs(np.mean(hits) - 0.95) < 2.4 * np.sqrt(0.95 * 0.05 / tables)


def test_a_step_function_of_one_input():
    design = sample_of({"x": "uniform(0,1)", "y": "uniform(0,1)"}, 1024, indices=True)
    found = sobol_indices(table_of(design, np.floor(4 * columns(design)[:, 0]).astype(int)), "f")
    np.testing.assert_allclose(found[["first", "total"]].loc["x"], [1, 1], atol=0.02)
    assert found.loc["y", ["first", "total", "first_low", "total_high"]].tolist() == [0, 0, 0, 0]


def test_tables_that_have_no_such_answer_are_told():
    table = ishigami_table(8)
    alone = sample_of(ANGLES, 8)
    plain = table_of(alone, ishigami(*columns(alone).T))
    constant = table.assign(f=0.3 * (1 + 1e-16 * np.arange(len(table))))  # but for rounding
    holes = table.copy()
    holes.loc[7, "f"] = np.inf
    for compute, words in (
        (lambda: sobol_indices(table.iloc[1:], "f"), "table lacks rows"),
        (lambda: sobol_indices(table.drop(columns="design"), "f"), "no column 'design'"),
        (lambda: sobol_indices(table, "f", confidence=95), "between 0 and 1"),
        (lambda: sobol_indices(plain, "f"), "no runs for Sobol indices"),
        (lambda: sobol_indices(constant, "f"), "'f' is 0.3 in all runs: without a variance"),
        (lambda: sobol_indices(holes, "f"), r"1 of 40 runs \(AB x, run 7: it is inf\)"),
    ):
        with pytest.raises(InvalidParameter, match=words):
            compute()
    with pytest.raises(NameNotFound, match="no figure 'g'; the table has: f"):
        sobol_indices(table, "g")


def depth_of(stiffness):
    mass = robots.load("ball").model.inertias[1].mass
    return (mass * GRAVITY / stiffness) ** (1 / 1.5)


def test_a_sample_has_the_closed_form_of_rest_is_told_and_drawn(scenario):
    # The depth falls with the stiffness, which alone decides it.
    out = scenario.parent / "told.parquet"
    options = [f"--dist={key}={one}" for key, one in DIST.items()]
    options += ["--n", 32, "--indices"]
    told = succeed("sweep", scenario, *options, "--workers", 0, "--out", out)
    table, words = pd.read_parquet(out), " ".join(told.output.split())
    assert table.columns[:6].tolist() == ["run", STIFFNESS, DAMPING, "status", "error", "design"]
    counts = table["design"].value_counts().to_dict()
    assert counts == dict.fromkeys(["A", "B", f"AB {STIFFNESS}", f"AB {DAMPING}"], 32)
    found = quantiles(table).loc["figures.depth"]
    assert found["runs"] == 64
    share = np.array([0.95, 0.75, 0.5, 0.25, 0.05])
    expected = depth_of(stats.lognorm(math.log(1.5), scale=1e5).ppf(share))
    np.testing.assert_allclose(found[[5, 25, 50, 75, 95]].to_numpy(float), expected, rtol=0.03)
    indices = sobol_indices(table, "figures.depth")
    assert abs(indices.loc[DAMPING, ["first", "total"]]).max() < 1e-3
    row = indices.loc[STIFFNESS]
    assert row["first_low"] < 1 < row["first_high"]
    for part in (
        "resting: 128 runs, 128 done, 0 failed",
        "contact.law.stiffness [N/m^1.5] 5",
        "met.figures.depth 0 0 0 0 64",
        f"{STIFFNESS} {row['first']:.6g} {row['first_low']:.6g}",
    ):
        assert part in words
    assert (scenario.parent / "told.figures.depth.png").read_bytes().startswith(b"\x89PNG")


def test_failed_runs_are_left_out_of_quantiles_and_refused_by_indices(scenario):
    # A radius above 24 mm starts deeper than its half.
    dist = {"contact.sphere.radius": "normal(0.018,0.005)", STIFFNESS: "uniform(1e5,2e5)"}
    table = sweep(scenario, dist=dist, n=8, indices=True, workers=0)
    failed = int((table[table["design"].isin(["A", "B"])]["status"] == "failed").sum())
    assert 0 < failed < 8
    assert quantiles(table).loc["figures.depth", "runs"] == 16 - failed
    with pytest.raises(InvalidParameter, match=r"no finite value in .* of 32 runs \(.*starts at"):
        sobol_indices(table, "figures.depth")


@pytest.mark.parametrize(
    "values", [[np.nan], [3.5, 3.5, np.nan], [1e300, -1e300, 0], list(range(10_000)), [1, 1, 2, 4]]
)
def test_the_histogram_counts_every_run_that_has_the_figure(values):
    values = np.array(values, dtype=float)
    figure = "pairs.a-b.peak_force"
    table = pd.DataFrame({"design": "sample", figure: values})
    table.attrs["units"] = {figure: "N"}
    (axis,) = plot_uncertainty(table, figure).axes
    known = values[~np.isnan(values)]
    assert sum(bar.get_height() for bar in axis.patches) == len(known)
    assert len(axis.patches) <= 60
    assert axis.get_xlabel() == "pairs.a-b.peak_force [N]"
    told = [one.get_text() for one in axis.texts]
    assert told == ([] if len(known) else ["No run has this figure."])
    drawn = [line.get_xdata()[0] for line in axis.lines]
    assert drawn == ([*np.percentile(known, [5, 50, 95])] if len(known) else [])


def test_bars_of_inputs_have_their_ends_and_intervals():
    """Of many inputs the largest are drawn, from the top."""
    table = ishigami_table(64)
    found = sobol_indices(table, "f").sort_values("total", ascending=False)
    _, right = plot_uncertainty(table, "f", found).axes
    assert [label.get_text() for label in right.get_yticklabels()] == list(found.index)
    assert np.all(np.diff(right.get_yticks()) < 0)
    assert [bar.get_width() for bar in right.patches] == [*found["first"], *found["total"]]
    for kind, lines in zip(("first", "total"), right.collections, strict=True):
        drawn = [segment[:, 0].tolist() for segment in lines.get_segments()]
        np.testing.assert_allclose(drawn, found[[f"{kind}_low", f"{kind}_high"]], rtol=1e-12)
