"""Sweeps on a Dask cluster of real processes, of which one is killed."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time

import pytest

from sphshell_pin.errors import SweepError
from sphshell_pin.study.sweep import sweep
from tests.study.resting import write

pd = pytest.importorskip("pandas")
pytest.importorskip("distributed")
pytest.importorskip("pyarrow")

VARY = {"contact.law.stiffness": "1e4:1e6:log:30", "contact.law.exponent": [1.5, 2.0]}


class Cluster:
    """A scheduler and workers, as the command dask starts them."""

    def __init__(self, folder):
        self.folder, self.file = folder, folder / "scheduler.json"
        self.processes = []
        self.start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        end = time.monotonic() + 60
        # The file is there before it is written.
        while not (written := self.file.exists() and self.file.read_text()):
            assert time.monotonic() < end, "the scheduler did not start"
            time.sleep(0.05)
        self.address = json.loads(written)["address"]

    def start(self, kind, *options):
        command = [sys.executable, "-m", "dask", kind, "--scheduler-file", self.file, *options]
        with open(self.folder / f"{kind}-{len(self.processes)}.log", "wb") as log:
            child = subprocess.Popen(command, cwd=self.folder, stdout=log, stderr=log)
        self.processes.append(child)

    def start_worker(self, *options, threads=1):
        more = "--nthreads", str(threads), "--no-dashboard", "--host", "127.0.0.1", *options
        self.start("worker", *more)

    def close(self):
        for process in reversed(self.processes):
            process.kill()
            process.wait()


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

    def progress(done, failed, total):
        if done == 15:
            os.kill(cluster.processes[1].pid, signal.SIGKILL)

    sweep(path, VARY, scheduler=cluster.address, out=table, progress=progress)
    assert [p.poll() for p in cluster.processes].count(-signal.SIGKILL) == 1
    assert table.read_bytes() == serial.read_bytes()


def test_runs_that_a_deadly_one_takes_with_it_are_done_all_the_same(tmp_path, cluster):
    """All four are on the one worker when it dies, each of the times that Dask tries."""
    cluster.start_worker(threads=4)
    vary = {"contact.law.stiffness": [1e4, 2e4, 3e4, 4e4]}
    table = sweep(write(tmp_path / "scenario", "deadly"), vary, scheduler=cluster.address)
    assert table["status"].tolist() == ["done", "failed", "done", "done"]
    assert table["error"][1] == "its worker process died each time it was tried"


def test_a_scheduler_that_dies_is_told_and_what_was_done_is_kept(tmp_path, cluster):
    path, table = write(tmp_path / "scenario"), tmp_path / "table.parquet"
    cluster.start_worker("--no-nanny")

    def progress(done, failed, total):
        if done == 10:
            cluster.processes[0].kill()

    with pytest.raises(SweepError, match="went away"):
        sweep(path, VARY, scheduler=cluster.address, out=table, progress=progress)
    kept = len(pd.read_parquet(table))
    assert 10 <= kept < 60
    counts = []
    sweep(path, VARY, workers=0, out=table, progress=lambda *one: counts.append(one))
    assert counts[0] == (kept, 0, 60)


def test_no_scheduler_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("sphshell_pin.study.sweep.driver._CONNECT_TIMEOUT", 0.5)
    for address in ("tcp://127.0.0.1:9", "pigeon://127.0.0.1:9", "localhost:99999", "nowhere"):
        with pytest.raises(SweepError, match=f"no Dask scheduler answers at {address}"):
            sweep(write(tmp_path), VARY, scheduler=address)
