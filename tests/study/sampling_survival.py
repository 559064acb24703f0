"""Sampled sweeps through the command, killed and resumed, against closed forms.

`python -m tests.study.sampling_survival [N]` makes two sweeps of 4096 points (or N): a Sobol
sample with curves, and Sobol indices of Ishigami's function. Each is made without a break, and
again with a SIGKILL in the middle; it prints whether the files are the same, bit for bit, and how
far the indices are from their closed forms.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd

from sphshell_pin.study.sweep import sobol_indices
from tests.study.ishigami import DIST, FIRST, TOTAL
from tests.study.ishigami import write as write_ishigami
from tests.study.resting import entries
from tests.study.resting import write as write_resting

N = int(sys.argv[1]) if len(sys.argv) > 1 else 4096
COMMAND = [sys.executable, "-c", "from sphshell_pin.cli import main; main()", "sweep"]


def call(scenario: Path, out: Path, options: list[str], kill_at: int | None = None) -> None:
    """Make the sweep by the command; SIGKILL it when so many runs are in its journal."""
    command = [
        *COMMAND,
        str(scenario),
        *options,
        "--n",
        str(N),
        "--workers",
        "2",
        "--out",
        str(out),
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        while kill_at is not None and len(entries(out)) < kill_at:
            assert process.poll() is None, "the sweep ended too early"
            time.sleep(0.2)
        if kill_at is not None:
            process.kill()
        printed, _ = process.communicate()
    if kill_at is None:
        assert process.returncode == 0, printed
        print(printed.splitlines()[0])


def killed_and_resumed(scenario: Path, options: list[str], runs: int) -> bool:
    """Make the sweep twice; return whether all files of the one that was killed are the same."""
    whole, killed = (scenario.parent / f"{name}.parquet" for name in ("whole", "killed"))
    call(scenario, whole, options)
    call(scenario, killed, options, kill_at=runs // 2)
    left = len(entries(killed))
    assert runs // 2 <= left < runs
    assert not killed.exists()
    call(scenario, killed, options)
    times = Counter(one["run"] for one in entries(killed))
    assert times == Counter(range(runs))
    pairs = [(whole.with_suffix(end), killed.with_suffix(end)) for end in (".parquet", ENDING)]
    same = all(a.read_bytes() == b.read_bytes() for a, b in pairs if a.exists())
    print(f"  killed after {left} of {runs} runs, resumed: same bytes {same}")
    return same


ENDING = ".curves.parquet"


def main() -> int:
    """Make both sweeps; return 1 if a file differs or an index is wrong by more than 0.01."""
    with tempfile.TemporaryDirectory() as name:
        resting = write_resting(Path(name) / "resting")
        options = [
            "--dist=contact.law.stiffness=lognormal(1e5,1.5)",
            "--dist=contact.law.damping=uniform(1,5)",
            "--sample=sobol",
            "--bands=pairs.ball-plate.depth",
        ]
        same = killed_and_resumed(resting, options, N)
        curves = pd.read_parquet(resting.parent / f"whole{ENDING}")
        print(f"  {len(curves)} rows of curves")
        scenario = write_ishigami(Path(name) / "ishigami")
        options = [f"--dist={key}={one}" for key, one in DIST.items()]
        options += ["--sample=sobol", "--indices"]
        same &= killed_and_resumed(scenario, options, N * (len(DIST) + 2))
        found = sobol_indices(pd.read_parquet(scenario.parent / "whole.parquet"), "figures.f")
        error = 0.0
        for kind, exact in (("first", FIRST), ("total", TOTAL)):
            error = max(error, float(np.abs(found[kind] - exact).max()))
            covered = (found[f"{kind}_low"] <= exact) & (exact <= found[f"{kind}_high"])
            print(f"  {kind}: {found[kind].to_numpy().round(5)}, exact {exact.round(5)}")
            print(f"  in their intervals: {covered.tolist()}")
        print(f"  largest error of an index: {error:.5f}")
    return 0 if same and error < 0.01 else 1


if __name__ == "__main__":
    sys.exit(main())
