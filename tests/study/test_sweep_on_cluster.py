"""Sweeps on a Dask cluster of real processes, of which one is killed."""

import contextlib
import os
import signal

import pytest

from sphshell_pin.errors import SweepError
from sphshell_pin.study.sweep import plan_sweep, run_plan, sweep
from tests.study.cluster import Cluster
from tests.study.resting import check_once, entries, write

pytest.importorskip("distributed")
pytest.importorskip("pyarrow")

VARY = {"contact.law.stiffness": "1e4:1e6:log:30", "contact.law.exponent": [1.5, 2.0]}


@pytest.fixture
def cluster(tmp_path):
    with contextlib.closing(Cluster(tmp_path)) as one:
        yield one


def test_a_killed_worker_of_a_cluster_costs_nothing(tmp_path, cluster):
    path = write(tmp_path / "scenario")
    for _ in range(2):
        cluster.start_worker("--no-nanny")
    serial, table = tmp_path / "serial.parquet", tmp_path / "cluster.parquet"
    sweep(path, VARY, workers=0, out=serial)
    killed = []

    def progress(done, failed, total):
        workers = {one["worker"] for one in entries(table)}
        if done >= 15 and not killed and len(workers) == 2:
            killed.append(min(workers))
            os.kill(int(killed[0].rpartition(":")[2]), signal.SIGKILL)

    sweep(path, VARY, scheduler=cluster.address, out=table, progress=progress)
    check_once(table, 60)
    assert len(killed) == 1
    assert [p.poll() for p in cluster.processes].count(-signal.SIGKILL) == 1
    assert table.read_bytes() == serial.read_bytes()


@pytest.mark.study
def test_a_sample_is_the_same_on_a_cluster(tmp_path, cluster):
    path = write(tmp_path / "scenario")
    cluster.start_worker("--no-nanny")
    sample = {
        "dist": {"contact.law.stiffness": "lognormal(1e5,1.5)"},
        "sample": "sobol",
        "n": 4,
        "indices": True,
        "tornado": True,
        "bands": ["pairs.ball-plate.depth"],
    }
    serial, table = tmp_path / "serial.parquet", tmp_path / "cluster.parquet"
    sweep(path, **sample, workers=0, out=serial)
    sweep(path, **sample, scheduler=cluster.address, out=table)
    check_once(table, 15)
    for end in (".parquet", ".curves.parquet"):
        assert table.with_suffix(end).read_bytes() == serial.with_suffix(end).read_bytes()


@pytest.mark.study
def test_a_run_that_kills_the_workers_of_a_cluster_is_given_up(tmp_path, request):
    # Runs that were with a dying worker are given up at once, and tried again alone.
    cluster = Cluster(tmp_path, allowed_failures=0)
    request.addfinalizer(cluster.close)
    path = write(tmp_path / "scenario", "deadly")
    cluster.start_worker()  # a nanny starts it again
    vary = {"contact.law.stiffness": [1e4, 2e4, 3e4, 4e4]}
    table = sweep(path, vary, scheduler=cluster.address)
    assert table["status"].tolist() == ["done", "failed", "done", "done"]
    assert "worker process died" in table["error"][1]


def test_a_scheduler_without_workers_is_waited_for_and_one_that_dies_is_told(
    tmp_path, cluster, monkeypatch
):
    monkeypatch.setattr("sphshell_pin.study.sweep.cluster._PATIENCE", 0.2)
    path = write(tmp_path / "scenario")
    table = tmp_path / "table.parquet"
    notes = []

    def note(sentence):
        notes.append(sentence)
        cluster.start_worker("--no-nanny")

    def progress(done, failed, total):
        if done == 10:
            cluster.processes[0].kill()

    plan = plan_sweep(path, VARY)
    with pytest.raises(SweepError, match="went away"):
        run_plan(plan, scheduler=cluster.address, out=table, progress=progress, note=note)
    assert len(notes) == 1
    assert "has no workers" in notes[0]
    assert 10 <= len(entries(table)) < 60
    sweep(path, VARY, workers=0, out=table)
    check_once(table, 60)


def test_no_scheduler_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("sphshell_pin.study.sweep.cluster._CONNECT_TIMEOUT", 0.5)
    for address in ("tcp://127.0.0.1:9", "pigeon://127.0.0.1:9", "localhost:99999"):
        with pytest.raises(SweepError, match=f"no Dask scheduler answers at {address}"):
            sweep(write(tmp_path), VARY, scheduler=address)


def test_an_address_of_ipv6_is_understood(monkeypatch, scenario):
    asked = []

    def connect(place, timeout):
        asked.append(place)
        raise OSError("nobody answers")

    monkeypatch.setattr("socket.create_connection", connect)
    for address in ("tcp://[::1]:8786", "[::1]:8786", "localhost:8786"):
        with pytest.raises(SweepError, match="nobody answers"):
            sweep(scenario, VARY, scheduler=address)
    assert asked == [("::1", 8786), ("::1", 8786), ("localhost", 8786)]
