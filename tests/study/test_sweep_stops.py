"""Sweeps killed, interrupted, and taken up again; and what the command prints."""

import contextlib
import errno
import io
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from unittest.mock import Mock

import pytest

from sphshell_pin.errors import ResultError
from sphshell_pin.study.sweep import local
from sphshell_pin.study.sweep.job import DONE, Outcome, Run
from sphshell_pin.study.sweep.journal import Journal
from tests.command import call, refused
from tests.programs import python
from tests.study.resting import check_once, entries

pytest.importorskip("pandas")
pytest.importorskip("pyarrow")

# The process sends itself the signal when so many runs are kept, however fast the machine is. Tests
# that run in the background pass on that Ctrl-C is to be ignored.
ENTRY = """
import os, signal
from sphshell_pin.cli import main
from sphshell_pin.study.sweep.journal import Journal

signal.signal(signal.SIGINT, signal.default_int_handler)
add = Journal.add


def stop(journal, outcome):
    add(journal, outcome)
    if len(journal.outcomes) == {runs}:
        os.kill(os.getpid(), {number})


Journal.add = stop
main()
"""
RUNS = 100
VARY = ["--vary", "contact.law.stiffness=1e4:1e6:log:50", "--vary", "contact.law.exponent=1.5,2"]


def wait_for(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.002)


def is_alive(pid):
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, 0)
        return True
    return False


@pytest.fixture(scope="module")
def reference(scenario):
    """The bytes of the table of a sweep that nothing happened to."""
    out = scenario.parent / "reference.parquet"
    told = call("sweep", scenario, *VARY, "--workers", "0", "--out", out)
    assert told.exit_code == 0, told.output
    assert f"{RUNS} runs, {RUNS} done, 0 failed" in told.output
    return out.read_bytes()


def stopped(runs, scenario, options, out, workers, number):
    """Begin a sweep that gets the signal when `runs` are done; return its exit code and errors."""
    code = ENTRY.format(runs=runs, number=int(number))
    done = python(code, "sweep", scenario, *options, "--workers", workers, "--out", out)
    return done.returncode, done.stderr


@pytest.mark.study
def test_a_killed_sweep_leaves_no_worker_and_goes_on(scenario, reference):
    out = scenario.parent / "killed.parquet"
    code, _ = stopped(5, scenario, VARY, out, 2, signal.SIGKILL)
    assert code == -signal.SIGKILL
    assert not out.exists()
    kept = entries(out)
    assert len(kept) == 5
    workers = {int(one["worker"].rpartition(":")[2]) for one in kept}
    wait_for(lambda: not any(map(is_alive, workers)))
    told = call("sweep", scenario, *VARY, "--workers", "0", "--out", out)
    assert told.exit_code == 0, told.output
    assert "5 were done before" in told.output
    check_once(out, RUNS)
    assert out.read_bytes() == reference


def test_ctrl_c_tells_how_to_go_on(scenario, reference):
    out = scenario.parent / "interrupted.parquet"
    code, told = stopped(5, scenario, VARY, out, 1, signal.SIGINT)
    assert code == 130
    number = int(told.split()[1])
    assert len(entries(out)) == 5
    assert number in (4, 5)  # Ctrl-C may come when a run is kept but not counted yet
    assert told.startswith(f"interrupted: {number} of {RUNS} runs are done and kept in {out}.")
    assert told.strip().endswith(f"--workers 1 --out {out}")
    assert len(told.splitlines()) == 1
    assert not out.exists()
    assert call("sweep", scenario, *VARY, "--out", out, "--workers", "0").exit_code == 0
    check_once(out, RUNS)
    assert out.read_bytes() == reference


@pytest.mark.parametrize("workers", [1, 3])
def test_deaths_count_for_each_run_alone(monkeypatch, workers):
    """The pools break under each run as often as `deaths` says."""
    deaths = {0: 1, 1: 1, 2: 1, 4: 3}

    class Pool:
        _processes = None
        broken = False

        def __init__(self, *_, **__):
            pass

        def submit(self, call, job, run=None):
            if self.broken:
                raise BrokenProcessPool
            future = Future()
            if run is not None and deaths.get(run.number, 0):
                deaths[run.number] -= 1
                self.broken = True
                future.set_exception(BrokenProcessPool())
            else:
                future.set_result(run and Outcome(run.number, DONE, "", {}))
            return future

        def shutdown(self, **_):
            pass

    monkeypatch.setattr(local, "ProcessPoolExecutor", Pool)
    died: list[int] = []
    found = list(local.run_locally(None, [Run(i, {}) for i in range(6)], workers, died.append))
    assert sorted(one.number for one in found) == list(range(6))
    assert [(one.number, one.error) for one in found if one.status != DONE] == [(4, local.KILLED)]
    assert sum(died) == 6


def test_a_full_disk_is_told_whenever_it_is_noticed(tmp_path, monkeypatch):
    """The journal passes on what the system says, and closes without writing once more."""
    journal = Journal(tmp_path / "x.journal", {}, 4)
    real, full = journal._file, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    journal.add(Outcome(0, DONE, "", {}))
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", Mock(side_effect=full))
        with pytest.raises(ResultError, match="No space left"):
            journal.add(Outcome(1, DONE, "", {}))
    # Writes of five bytes, then none.
    patchy = Mock(wraps=real, closed=False)
    patchy.write.side_effect = [*[5] * 3, full]
    journal._file = patchy
    with pytest.raises(ResultError, match="No space left"):
        journal.add(Outcome(2, DONE, "", {}))
    sent = [call.args[0] for call in patchy.write.call_args_list]
    assert [len(sent[0]) - len(one) for one in sent] == [0, 5, 10, 15]
    assert isinstance(real, io.RawIOBase)  # nothing is left for close() to write
    journal.close()
    assert real.closed


def test_a_script_without_a_guard_is_told(scenario):
    script = scenario.parent / "script.py"
    script.write_text(
        "from sphshell_pin.study.sweep import sweep\n"
        f"sweep({str(scenario)!r}, ['contact.law.stiffness=1e4,1e5'], workers=1)\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 1
    assert '__name__ == "__main__"' in done.stderr.splitlines()[-1]


def test_pictures_and_failed_runs_are_told(scenario):
    pytest.importorskip("matplotlib")
    out = scenario.parent / "failed.parquet"
    radii = ["--vary", "contact.sphere.radius=0.012,0.03", "--workers", "0", "--out", out]
    told = call("sweep", scenario, *radii, "--plot", "figures.depth", "--plot", "energy.residual")
    assert told.exit_code == 0
    assert "2 runs, 1 done, 1 failed" in told.output
    assert (
        "run 1 failed (contact.sphere.radius = 0.03 m): contact 'ball-plate' starts" in told.output
    )
    for name in ("figures.depth", "energy.residual"):
        assert (scenario.parent / f"failed.{name}.png").read_bytes().startswith(b"\x89PNG")


def test_a_sweep_of_failures_is_an_error(scenario):
    out = scenario.parent / "failures.parquet"
    vary = ["--vary", "contact.sphere.radius=0.03,0.04", "--workers", "0", "--out", out]
    assert call("sweep", scenario, *vary).exit_code == 2


FAULTS = {
    "figure": (["--vary", "contact.law.stiffness=1,2", "--plot", "peak"], "no figure 'peak'"),
    "file": (["--vary", "contact.law.stiffness=1,2", "--out", "x.csv"], ".parquet or .h5"),
    "picture": (
        [f"--vary={key}=1:2:2" for key in ("gravity.0", "gravity.1", "gravity.2")]
        + ["--plot", "figures.depth"],
        "too many numbers for one picture",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_one_sentence(scenario, fault):
    arguments, words = FAULTS[fault]
    assert words in refused("sweep", scenario, *arguments)
