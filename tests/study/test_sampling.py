"""Uncertain inputs: distributions from texts, points, what is refused, what the runs record."""

import math
import sys

import numpy as np
import pytest
from scipy import stats

from sphshell_pin import robots
from sphshell_pin.errors import (
    InvalidParameter,
    MissingExtra,
    NameNotFound,
    ScenarioError,
    SweepError,
)
from sphshell_pin.scenario import build
from sphshell_pin.scenario.running.run import simulate
from sphshell_pin.study.sweep import (
    LogNormal,
    Normal,
    Uniform,
    plan_sweep,
    quantile_bands,
    quantiles,
    run_plan,
    sobol_indices,
    sweep,
    tornado,
)
from sphshell_pin.study.sweep.distributions import distributions_of
from sphshell_pin.study.sweep.grid import MOST_RUNS
from sphshell_pin.study.sweep.sampling import design_of
from tests.study.resting import GRAVITY, entries, write

pd = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")

STIFFNESS, DAMPING = "contact.law.stiffness", "contact.law.damping"
DIST = {STIFFNESS: "lognormal(1e5,1.5)", DAMPING: "uniform(1,5)"}
SOBOL = {"dist": DIST, "sample": "sobol"}
DEPTH = "pairs.ball-plate.depth"


def test_texts_are_distributions():
    found = distributions_of(["a = normal(1e5, 2e3)", "b=Uniform(-1,2)", "c=lognormal(3,1.5)"])
    assert found == {"a": Normal(1e5, 2e3), "b": Uniform(-1, 2), "c": LogNormal(3, 1.5)}
    assert [str(one) for one in found.values()] == [
        "normal(100000,2000)",
        "uniform(-1,2)",
        "lognormal(3,1.5)",
    ]
    assert distributions_of({"a": Normal(0, 1)}) == {"a": Normal(0, 1)}


def test_quantiles_are_those_of_the_textbook():
    # 0.8413... of a normal distribution lies below one deviation over the mean.
    below = 0.5 * (1 + math.erf(math.sqrt(0.5)))
    shares = np.array([1 - below, 0.5, below])
    np.testing.assert_allclose(Normal(10, 2).quantile(shares), [8, 10, 12], rtol=1e-12)
    np.testing.assert_allclose(Uniform(10, 12).quantile(shares), 10 + 2 * shares, rtol=1e-12)
    found = LogNormal(6, 1.5).quantile(shares)
    np.testing.assert_allclose(found, [4, 6, 9], rtol=1e-12)


@pytest.mark.parametrize(
    ("dist", "words"),
    [
        ({}, "must say what is uncertain"),
        (["a"], "must be KEY=DISTRIBUTION, one of normal"),
        (["a="], "must be one of normal"),
        (["a=normal"], r"must be one of normal\(mean,deviation\), uniform"),
        (["a=gauss(1,2)"], "names no distribution that is known: normal"),
        (["a=normal(1)"], r"must have 2 numbers: normal\(mean,deviation\)"),
        (["a=normal(1;2)"], "must have 2 numbers"),
        (["a=normal(1,-2)"], "deviation = -2.0 must be positive"),
        (["a=normal(nan,2)"], "must be finite"),
        (["a=uniform(2,1)"], "high = 1.0 must be more than low = 2"),
        (["a=lognormal(-3,2)"], "median = -3.0 must be positive"),
        (["a=lognormal(12.2,0.4)"], r"factor = 0.4 must be more than 1: .*exp\(0.4\) = 1.49182"),
        (["a=normal(1,2)", "a=normal(1,3)"], "a' is given twice"),
        (["a=uniform(-1e308,1e308)"], "not finite"),
        ({"a": [1, 2]}, "must be one of normal"),
        (3, "must map keys to distributions"),
    ],
)
def test_wrong_distributions_are_told(dist, words):
    with pytest.raises(InvalidParameter, match=words):
        design_of(dist, "lhs", 8)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "sample must be given with dist"),
        ({"n": 8}, "sample must be given with dist"),
        ({"n": 8, "tornado": True}, "n = 8 is the size of a sample"),
        ({"sample": "soboll", "n": 8}, "must be one of sobol, lhs"),
        ({"sample": "sobol"}, "n must be given"),
        ({"sample": "sobol", "n": 100}, "power of 2 .* such as 64 or 128"),
        ({"sample": "lhs", "n": 1}, "whole number, 2 or more"),
        ({"sample": "lhs", "n": 8.0}, "whole number"),
        ({"sample": "lhs", "n": True}, "whole number"),
        ({"sample": "lhs", "n": 8, "seed": -1}, "seed = -1 must be a whole number, 0 or more"),
        ({"sample": "lhs", "n": 8, "indices": True}, "indices need .* sample = sobol"),
        ({"sample": "sobol", "n": 2**19, "indices": True}, f"{MOST_RUNS} at most"),
    ],
)
def test_wrong_samples_are_told(arguments, words):
    with pytest.raises(InvalidParameter, match=words):
        design_of(DIST, **arguments)


@pytest.mark.parametrize("sample", ["sobol", "lhs"])
def test_each_interval_of_equal_probability_has_one_point(sample):
    dist = {"a": Normal(3, 2), "b": LogNormal(2, 3), "c": Uniform(-1, 1)}
    found = design_of(dist, sample, 64).values.T
    exact = [stats.norm(3, 2), stats.lognorm(math.log(3), scale=2), stats.uniform(-1, 2)]
    for values, one in zip(found, exact, strict=True):
        assert sorted((64 * one.cdf(values)).astype(int)) == list(range(64))


def test_a_seed_gives_the_same_points_and_another_one_others():
    first, again, other = (design_of(**SOBOL, n=32, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.values, again.values)
    assert first.description == again.description
    assert not np.any(first.values == other.values)
    assert first.description != other.description


def test_the_design_is_saltellis():
    design = design_of({"x": "uniform(0,1)", "y": "uniform(2,3)"}, "sobol", 16, indices=True)
    assert design.parts == ("A", "B", "AB x", "AB y") * 16
    a, b, x, y = (design.values[i::4] for i in range(4))
    np.testing.assert_array_equal(x, np.column_stack([b[:, 0], a[:, 1]]))
    np.testing.assert_array_equal(y, np.column_stack([a[:, 0], b[:, 1]]))
    both = np.column_stack([a, b]) - [0, 2, 0, 2]
    assert all(sorted((16 * one).astype(int)) == list(range(16)) for one in both.T)


def test_the_tornado_moves_one_input_at_a_time():
    design = design_of({"x": "uniform(0,1)", "y": "normal(2,1)"}, tornado=True)
    assert design.parts == ("median", "5 % x", "95 % x", "5 % y", "95 % y")
    z = 1.6448536269514722
    expected = [[0.5, 2], [0.05, 2], [0.95, 2], [0.5, 2 - z], [0.5, 2 + z]]
    np.testing.assert_allclose(design.values, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("dist", "kind", "words"),
    [
        # Beyond the bounds: not cut off, not made a failed run, but told before anything runs.
        (
            {STIFFNESS: "normal(1e5,6e4)"},
            InvalidParameter,
            r"3 points of 64 have a value that is not allowed; the first: .*stiffness: should be "
            r"greater than 0 \(given: -.*lognormal\(median,factor\) is positive",
        ),
        ({"contact.law.stifness": "normal(1,2)"}, ScenarioError, "did you mean 'stiffness'"),
        ({"run.integrator": "normal(1,2)"}, ScenarioError, "run.integrator: should be a valid"),
        ({"contact.lw.k": "normal(1,2)"}, ScenarioError, "no item 'lw.k'"),
        (
            {STIFFNESS: "uniform(1,2)", "contact.ball-plate.law.stiffness": "uniform(1,2)"},
            InvalidParameter,
            "dist = .* is given twice: leave one of the two out",
        ),
    ],
)
def test_what_no_run_can_have_is_told_beforehand(scenario, dist, kind, words):
    with pytest.raises(kind, match=words):
        plan_sweep(scenario, dist=dist, sample="lhs", n=64)


def test_whole_numbers_have_no_distribution(tmp_path):
    path = write(tmp_path)
    friction = 'friction = { type = "mindlin", mu_static = 0.3, mu_dynamic = 0.2, young = 1e9, '
    text = path.read_text().replace(
        'shell = "plate"', f'shell = "plate"\n{friction}poisson = 0.3, rings = 2 }}'
    )
    path.write_text(text)
    words = r"8 points of 8 .* valid integer.*give whole numbers by vary"
    with pytest.raises(InvalidParameter, match=words):
        plan_sweep(path, dist={"contact.friction.rings": "uniform(1,3)"}, sample="lhs", n=8)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "vary must say what varies, as .* or dist what is uncertain"),
        ({"vary": ["a=1,2"], "sample": "lhs"}, "sample = 'lhs' is for uncertain inputs"),
        ({"vary": ["a=1,2"], "indices": True}, "indices = True is for uncertain inputs"),
        ({"vary": ["a=1,2"], "bands": [DEPTH]}, "bands = .* is for uncertain inputs"),
        ({"vary": ["a=1,2"], "dist": DIST}, "vary = .* is for values in a grid"),
        ({"dist": DIST, "together": True}, "together = True is for values in a grid"),
        ({"dist": DIST, "tornado": True, "bands": [DEPTH]}, "bands = .* need a sample"),
        ({**SOBOL, "n": 8, "band_steps": 5}, "band_steps = 5 is for bands"),
        ({**SOBOL, "n": 8, "bands": [DEPTH], "band_steps": 0}, "whole number"),
        ({**SOBOL, "n": 8, "bands": [DEPTH], "band_steps": 11}, "10 or less, as rows are"),
        ({**SOBOL, "n": 8, "bands": [DEPTH, DEPTH]}, "is given twice"),
    ],
)
def test_arguments_that_do_not_go_together_are_told(scenario, arguments, words):
    with pytest.raises(InvalidParameter, match=words):
        plan_sweep(scenario, **arguments)


def test_an_unknown_curve_is_told(scenario):
    with pytest.raises(NameNotFound, match=f"no curve 'depth'.*{DEPTH}"):
        plan_sweep(scenario, **SOBOL, n=8, bands=["depth"])


def test_curves_that_would_fill_the_memory_are_told(scenario, monkeypatch):
    monkeypatch.setattr("sphshell_pin.study.sweep.curves.MOST_VALUES", 87)
    words = r"bands = 88 values \(8 runs, 1 curves, 11 times\) are too many: 87 at most"
    with pytest.raises(InvalidParameter, match=words):
        plan_sweep(scenario, **SOBOL, n=8, bands=[DEPTH])


def test_without_scipy_the_extra_is_named(scenario, monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy", None)
    with pytest.raises(MissingExtra, match=r"scipy.*sphshell-pin\[sweep\]"):
        plan_sweep(scenario, **SOBOL, n=8)


@pytest.fixture(scope="module")
def sampled(scenario):
    """A finished sweep with everything: its report."""
    plan = plan_sweep(
        scenario, **SOBOL, n=32, indices=True, tornado=True, bands=[DEPTH, "q.root_joint.2"]
    )
    return run_plan(plan, workers=0, out=scenario.parent / "sampled.parquet")


def test_the_table_says_what_each_run_is_for(sampled):
    table = sampled.table
    assert len(table) == 32 * 4 + 5
    assert table.columns[:6].tolist() == ["run", STIFFNESS, DAMPING, "status", "error", "design"]
    assert table["design"].value_counts().to_dict() == {
        **dict.fromkeys(["A", "B", f"AB {STIFFNESS}", f"AB {DAMPING}"], 32),
        **dict.fromkeys(["median"], 1),
        **{f"{i} % {key}": 1 for key in DIST for i in (5, 95)},
    }
    pd.testing.assert_frame_equal(pd.read_parquet(sampled.out), table, check_dtype=False)


def depth_of(stiffness):
    mass = robots.load("ball").model.inertias[1].mass
    return (mass * GRAVITY / stiffness) ** (1 / 1.5)


def test_figures_have_the_closed_form_of_rest(sampled):
    # The depth falls with the stiffness, which alone decides it.
    found = quantiles(sampled.table).loc["figures.depth"]
    assert found["runs"] == 64
    share = np.array([0.95, 0.75, 0.5, 0.25, 0.05])
    expected = depth_of(LogNormal(1e5, 1.5).quantile(share))
    np.testing.assert_allclose(found[[5, 25, 50, 75, 95]].to_numpy(float), expected, rtol=0.03)
    moved = tornado(sampled.table, "figures.depth")
    assert moved.index.tolist() == [STIFFNESS, DAMPING]
    ends = depth_of(LogNormal(1e5, 1.5).quantile(np.array([0.05, 0.5, 0.95])))
    np.testing.assert_allclose(moved.loc[STIFFNESS, ["low", "median", "high"]].tolist(), ends, 1e-8)
    np.testing.assert_allclose(moved.loc[DAMPING, ["low", "high"]].tolist(), [ends[1]] * 2, 1e-4)
    np.testing.assert_allclose(moved.loc[DAMPING, ["low_value", "high_value"]].tolist(), [1.2, 4.8])
    indices = sobol_indices(sampled.table, "figures.depth")
    assert abs(indices.loc[DAMPING, ["first", "total"]]).max() < 1e-3
    assert indices.loc[STIFFNESS, "first_low"] < 1 < indices.loc[STIFFNESS, "first_high"]


def test_curves_are_those_of_a_run_alone(sampled, scenario):
    curves = sampled.curves
    drawn = sampled.table[sampled.table["design"].isin(["A", "B"])]
    assert curves["run"].unique().tolist() == drawn["run"].tolist()
    assert curves.columns.tolist() == ["run", "t", DEPTH, "q.root_joint.2"]
    number = int(drawn["run"].iloc[7])
    row, mine = sampled.table.loc[number], curves[curves["run"] == number]
    built = build(scenario, {key: repr(float(row[key])) for key in DIST})
    result, _ = simulate(built)
    np.testing.assert_allclose(mine["t"], result.t, rtol=1e-12)
    np.testing.assert_allclose(mine["q.root_joint.2"], result.q[:, 2], rtol=1e-12)
    depths = np.zeros(len(result.t))
    depths[result.contacts.row] = result.contacts.depth
    np.testing.assert_allclose(mine[DEPTH], depths, rtol=1e-9, atol=1e-18)


def test_bands_are_the_quantiles_at_each_time(sampled):
    bands = quantile_bands(sampled.curves, DEPTH)
    assert bands["t"].tolist() == pytest.approx(np.linspace(0, 1, 11))
    assert (bands["runs"] == 64).all()
    last = sampled.curves[sampled.curves["t"] == 1.0][DEPTH]
    for percent in (5, 25, 50, 75, 95):
        assert bands[percent].iloc[-1] == np.percentile(last, percent)
    np.testing.assert_allclose(
        bands[[5, 50, 95]].iloc[-1].tolist(),
        quantiles(sampled.table).loc["figures.depth", [5, 50, 95]].tolist(),
        rtol=1e-3,
    )
    with pytest.raises(NameNotFound, match=f"has: {DEPTH}"):
        quantile_bands(sampled.curves, "depth")


def test_a_resumed_sample_leaves_the_same_bytes(sampled, scenario):
    """Half of the rows lost, one of them damaged: those runs are done again."""
    out = sampled.out
    files = [out, sampled.curves_out]
    whole = [path.read_bytes() for path in files]
    head, *lines = sampled.journal.read_text().splitlines(keepends=True)
    lines[4] = lines[4].replace('"curves": "', '"curves": "AAAA')
    sampled.journal.write_text("".join([head, *lines[::2]]))
    for path in files:
        path.unlink()
    plan = plan_sweep(
        scenario, **SOBOL, n=32, indices=True, tornado=True, bands=[DEPTH, "q.root_joint.2"]
    )
    report = run_plan(plan, workers=0, out=out)
    assert report.resumed == 66
    assert [path.read_bytes() for path in files] == whole
    assert {len(one["curves"]) for one in entries(out)} >= {0, 4 * -(-2 * 11 * 8 // 3)}


def test_the_journal_of_another_sample_is_refused(scenario):
    out = scenario.parent / "another.parquet"
    sweep(scenario, **SOBOL, n=4, workers=0, out=out)
    for more, words in (
        ({"seed": 1}, "other values"),
        ({"n": 8}, "other values"),
        ({"tornado": True}, "other values"),
        ({"bands": [DEPTH]}, "other curves"),
    ):
        with pytest.raises(SweepError, match=words):
            sweep(scenario, **{**SOBOL, "n": 4, **more}, workers=0, out=out)


def test_failed_runs_are_left_out_of_quantiles_and_refused_by_indices(scenario):
    # A radius above 24 mm starts deeper than its half.
    dist = {"contact.sphere.radius": "normal(0.018,0.005)", STIFFNESS: "uniform(1e5,2e5)"}
    plan = plan_sweep(scenario, dist=dist, sample="sobol", n=8, indices=True, bands=[DEPTH])
    report = run_plan(plan, workers=0)
    table = report.table
    drawn = table[table["design"].isin(["A", "B"])]
    failed = int((drawn["status"] == "failed").sum())
    assert 0 < failed < 8
    assert quantiles(table).loc["figures.depth", "runs"] == 16 - failed
    assert report.curves["run"].nunique() == 16 - failed
    holes = int(table["figures.depth"].isna().sum())
    with pytest.raises(
        InvalidParameter,
        match=rf"'figures.depth' has no finite value in {holes} of 32 runs \(.*starts at depth.*"
        "Sobol indices of the others would be wrong",
    ):
        sobol_indices(table, "figures.depth")
