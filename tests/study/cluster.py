"""A Dask cluster of real processes on this machine."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path


class Cluster:
    """A scheduler and workers of one thread each, as the command dask starts them.

    The scheduler gives up a task that was with more than `allowed_failures` dying workers.
    """

    def __init__(self, folder: Path, allowed_failures: int = 3) -> None:
        self.folder = folder
        self.environment = os.environ | {
            "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(allowed_failures)
        }
        self.file = folder / "scheduler.json"
        self.processes: list[subprocess.Popen[bytes]] = []
        self.start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        end = time.monotonic() + 60
        # The file is there before it is written.
        while not (written := self.file.exists() and self.file.read_text()):
            assert time.monotonic() < end, "the scheduler did not start"
            time.sleep(0.05)
        self.address = json.loads(written)["address"]

    def start(self, kind: str, *options: str) -> None:
        command = [sys.executable, "-m", "dask", kind, "--scheduler-file", str(self.file), *options]
        with open(self.folder / f"{kind}-{len(self.processes)}.log", "wb") as log:
            self.processes.append(
                subprocess.Popen(
                    command, cwd=self.folder, env=self.environment, stdout=log, stderr=log
                )
            )

    def start_worker(self, *options: str) -> None:
        self.start("worker", "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1", *options)

    def close(self) -> None:
        for process in reversed(self.processes):
            process.terminate()
        for process in self.processes:
            try:
                process.wait(timeout=3)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
