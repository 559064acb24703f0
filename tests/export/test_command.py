"""The command export: files beside the run, times as people write them, one sentence a fault."""

from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import make_reader

import sphshell_pin as sp
from sphshell_pin.cli.export import beside
from tests.command import call, refused, succeed
from tests.scenario.files import without_pictures, write


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    with without_pictures():
        succeed("run", write(folder), "--out", folder / "drop", "--no-recording")
    return folder


def test_files_are_written_beside_the_run(folder, monkeypatch):
    monkeypatch.chdir(folder)
    printed = call("export", "drop", "--to", "mcap")
    assert (printed.exit_code, printed.stdout) == (0, "drop.mcap\n"), printed.output
    with open("drop.mcap", "rb") as stream:
        reader = make_reader(stream)
        about = next(reader.iter_metadata()).metadata
    assert about["scenario"].endswith("drop.toml")
    assert Path(about["scenario"]).name == "drop.toml"
    for format in ("csv", "parquet"):
        printed = succeed("export", "drop/run.npz", "--to", format)
        assert printed.stdout.split()[0] == f"drop_{format}/rows.{format}"
    assert "q.root_joint.2 [m]" in Path("drop_csv/rows.csv").read_text().partition("\n")[0]


def test_names_of_what_is_written(tmp_path, monkeypatch):
    (tmp_path / "runs" / "a.b").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "runs")
    assert beside(Path("a.b"), ".mcap") == Path("a.b.mcap")
    assert beside(Path("a.b/run.npz"), "_csv") == Path("a.b_csv")
    assert beside(Path("one.npz"), "_csv") == Path("one_csv")
    assert beside(Path(), ".mcap") == tmp_path / "runs.mcap"


def test_faults(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(folder)
    damaged = tmp_path / "damaged.npz"
    damaged.write_bytes(Path("drop/run.npz").read_bytes()[:5000])
    for arguments, words in (
        (["drop", "--to", "rrd"], "Rerun's viewer opens .mcap files"),
        (["drop"], "must be one of mcap, csv, parquet"),
        (["drop", "--to", "bag"], "must be one of mcap, csv, parquet"),
        (["none", "--to", "csv"], "none: cannot read the results"),
        ([damaged, "--to", "csv"], "damaged.npz: is not a file that Result.save wrote"),
        (["drop", "--to", "mcap", "--out", "drop.toml/x.mcap"], "cannot be written"),
    ):
        assert words in refused("export", *arguments)


def test_without_a_scenario_a_run_has_numbered_joints(folder, tmp_path):
    run = tmp_path / "own.npz"
    replace(sp.Result.load(folder / "drop" / "run.npz"), origin=None).save(run)
    printed = succeed("export", run, "--to", "csv")
    assert "warning: joints have numbers instead of names" in printed.stderr
    assert (tmp_path / "own_csv" / "rows.csv").read_text().startswith("t [s],q.0,q.1")
    assert "its scene can be given" in refused("export", run, "--to", "mcap")
