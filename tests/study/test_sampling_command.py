"""The command sweep with uncertain inputs: what it prints, writes, and how it resumes."""

import signal

import numpy as np
import pytest

from sphshell_pin.study.sweep import sobol_indices
from tests.command import call, refused
from tests.study.resting import check_once, entries
from tests.study.test_sweep_stops import stopped

pd = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")
pytest.importorskip("matplotlib")

STIFFNESS = "--dist=contact.law.stiffness=lognormal(1e5,1.5)"
DAMPING = "--dist=contact.law.damping=uniform(1,5)"
DEPTH = "pairs.ball-plate.depth"


def test_a_sample_is_told_and_drawn(scenario):
    out = scenario.parent / "told.parquet"
    options = ["--sample", "sobol", "--n", 8, "--indices", "--tornado", "--bands", DEPTH]
    more = ["--verdicts", "--workers", 0, "--out", out, "--plot", "figures.depth"]
    told = call("sweep", scenario, STIFFNESS, DAMPING, *options, *more)
    assert told.exit_code == 0, told.output
    words = " ".join(told.output.split())
    assert "resting: 37 runs, 37 done, 0 failed" in words
    assert "contact.law.stiffness lognormal(100000,1.5) 51328.2 100000 194825 N/m^1.5" in words
    assert "expectation met in" in words
    assert "figures.depth 0 % of the runs" in words
    table = pd.read_parquet(out)
    depths = table.loc[table["design"].isin(["A", "B"]), "figures.depth"]
    shown = " ".join(f"{one:.6g}" for one in np.percentile(depths, [5, 25, 50, 75, 95]))
    assert f"figures.depth {shown} 16" in words
    found = sobol_indices(table, "figures.depth").loc["contact.law.stiffness"]
    assert (
        f"contact.law.stiffness {found['first']:.4f} {found['first_low']:.4f} to "
        f"{found['first_high']:.4f} {found['total']:.4f}"
    ) in words
    middle = table.loc[table["design"] == "median", "figures.depth"].iloc[0]
    assert f"figures.depth is {middle:.6g} with all inputs at their medians" in words
    for name in ("told.figures.depth.png", f"told.curves.{DEPTH}.png"):
        assert (scenario.parent / name).read_bytes().startswith(b"\x89PNG")
        assert name in told.output
    assert "told.curves.parquet" in told.output


def test_a_tornado_alone(scenario):
    out = scenario.parent / "tornado.h5"
    told = call("sweep", scenario, STIFFNESS, "--tornado", "--workers", 0, "--out", out)
    assert told.exit_code == 0, told.output
    assert "3 runs, 3 done" in told.output
    assert "runs  " not in told.output  # no quantiles of three runs that are no sample
    assert (scenario.parent / "tornado.figures.depth.png").exists()


def test_indices_of_a_design_with_holes_are_not_computed(scenario):
    out = scenario.parent / "holes.parquet"
    radius = "--dist=contact.sphere.radius=normal(0.018,0.005)"
    options = ["--sample", "sobol", "--n", 8, "--indices", "--tornado", "--workers", 0]
    told = call("sweep", scenario, radius, STIFFNESS, *options, "--out", out)
    assert told.exit_code == 0
    assert "no Sobol indices: figure = 'figures.depth' has no finite value in" in told.output
    assert "no tornado: figure = 'figures.depth' has no finite value in 1 of 5 runs" in told.output
    assert "starts at depth" in told.output
    assert "Sobol indices of figures.depth" not in told.output


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "must say what varies"),
        ([STIFFNESS, "--sample=lhs", "--n=8", "--plot=peak"], "no figure 'peak'"),
        ([STIFFNESS, "--sample=lhs", "--n=8", "--bands=force"], "no curve 'force'"),
    ],
)
def test_faults_are_one_sentence(scenario, options, words):
    assert words in refused("sweep", scenario, *options, "--out", scenario.parent / "fault.parquet")
    assert not list(scenario.parent.glob("fault*"))


@pytest.mark.study
def test_a_killed_sample_resumes_to_the_same_bytes(scenario):
    options = [STIFFNESS, DAMPING, "--sample", "sobol", "--n", 16, "--indices", "--bands", DEPTH]
    whole, killed = (scenario.parent / f"{name}.parquet" for name in ("whole", "killed"))
    assert call("sweep", scenario, *options, "--workers", 0, "--out", whole).exit_code == 0
    code, _ = stopped(20, scenario, options, killed, 2, signal.SIGKILL)
    assert code == -signal.SIGKILL
    assert len(entries(killed)) == 20
    told = call("sweep", scenario, *options, "--workers", 0, "--out", killed)
    assert told.exit_code == 0, told.output
    assert "20 were done before" in told.output
    check_once(killed, 64)
    for end in (".parquet", ".curves.parquet"):
        assert killed.with_suffix(end).read_bytes() == whole.with_suffix(end).read_bytes()
