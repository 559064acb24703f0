"""A sweep of many runs whose workers, and which itself, are killed.

`python -m tests.study.sweep_survival [RUNS]` prints, for each way to make the runs, whether every
run is in the table once, and whether the file is bit for bit that of runs made in turn in one
process.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from sphshell_pin.study.sweep import plan_sweep, run_plan
from tests.study.cluster import Cluster
from tests.study.resting import entries, write

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 500  # a multiple of 20
VARY = [f"contact.law.stiffness=1e4:1e6:log:{RUNS // 4}", "contact.law.exponent=1.5,1.75,2,2.25"]
COMMAND = [sys.executable, "-c", "from sphshell_pin.cli import main; main()", "sweep"]
Progress = Callable[[int, int, int], None]


def killer(table: Path, at: tuple[int, ...], deaths: list[str]) -> Progress:
    """Return what kills the worker that was heard of last, when so many runs are done."""

    def progress(done: int, failed: int, total: int) -> None:
        if done in at:
            deaths.append(entries(table)[-1]["worker"])
            os.kill(int(deaths[-1].rpartition(":")[2]), signal.SIGKILL)

    return progress


def kill_the_sweep(scenario: Path, table: Path, at: int) -> None:
    """Run the command, and kill it when so many runs are done."""
    command = [*COMMAND, str(scenario), "--workers", "2", "--out", str(table)]
    for one in VARY:
        command += ["--vary", one]
    with subprocess.Popen(command) as process:
        while len(entries(table)) < at:
            assert process.poll() is None, "the sweep ended too early"
            time.sleep(0.01)
        process.kill()


def main() -> int:
    """Make the sweep in five ways; return 1 if a table differs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scenario = write(folder)
        plan = plan_sweep(scenario, VARY)
        assert len(plan.runs) == RUNS
        cluster = Cluster(folder)
        for _ in range(2):
            cluster.start_worker("--no-nanny")
        reference = b""
        good = True
        print(f"{'':58}  runs once  killed  same bytes    time")
        for way, kills in (
            ("in turn, in one process", 0),
            ("two processes", 0),
            ("two processes, workers killed three times", 3),
            ("two processes, the sweep killed, resumed", 1),
            ("Dask, two workers, one killed", 1),
        ):
            table = folder / f"{way}.parquet"
            deaths: list[str] = []
            start = time.perf_counter()
            if way.startswith("in turn"):
                run_plan(plan, workers=0, out=table)
                reference = table.read_bytes()
            elif way.startswith("Dask"):
                stop = killer(table, (RUNS // 2,), deaths)
                run_plan(plan, scheduler=cluster.address, out=table, progress=stop)
            elif "resumed" in way:
                kill_the_sweep(scenario, table, 2 * RUNS // 5)
                deaths.append("the sweep")
                resumed = run_plan(plan, workers=2, out=table).resumed
                assert 2 * RUNS // 5 <= resumed < RUNS
            else:
                at = (RUNS // 5, RUNS // 2, 4 * RUNS // 5) if kills else ()
                run_plan(plan, workers=2, out=table, progress=killer(table, at, deaths))
            took = time.perf_counter() - start
            times = Counter(one["run"] for one in entries(table))
            once = sum(times[i] == 1 for i in range(RUNS))
            same = table.read_bytes() == reference
            good = good and same and once == RUNS == sum(times.values()) and len(deaths) == kills
            print(f"{way:58}  {once:9}  {len(deaths):6}  {same!s:>10}  {took:5.1f} s", flush=True)
        cluster.close()
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
