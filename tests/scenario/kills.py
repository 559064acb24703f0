"""What `sphshell-pin run` leaves behind when it is killed, and when the disk is full.

`python -m tests.scenario.kills` runs the real command over the results of an earlier run and kills
it: at every system call that touches the folder's files (with strace), and at random times. After
each kill the folder must be whole, by the SHA-256 in its summary. Then it runs the command on small
file systems in memory (where it may mount them). Returns 1 if anything else was found.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from sphshell_pin.atomic import AtomicFolder

RUN = [
    sys.executable, "-c", "from sphshell_pin.cli import main; main()", "run", "sphere_on_shell",
    "--duration", "0.03", "--set",
]  # fmt: skip
STIFFNESS = ("1e5", "2e5")
CALLS = (
    "openat,write,pwrite64,writev,rename,renameat,renameat2,unlink,unlinkat,link,linkat,symlink,"
    "symlinkat,mkdir,mkdirat,rmdir,fsync,fdatasync,ftruncate,chmod,fchmod,fchmodat,chown,flock"
)
NOTES = "notes.txt"


def command(place: Path, stiffness: str) -> list[str]:
    """Return the command of one of two runs."""
    key = f"contact.ball-bowl.law.k={stiffness}"
    return [*RUN, key, "--out", str(place / "out")]


def run(place: Path, stiffness: str, *before: str) -> subprocess.CompletedProcess[str]:
    """Run to the end, below the command `before`."""
    return subprocess.run(
        [*before, *command(place, stiffness)], capture_output=True, text=True, check=False
    )


def state(place: Path) -> str:
    """Return the stiffness of the run whose results are in the folder; else what is wrong."""
    out = place / "out"
    try:
        names = {name for name in os.listdir(out) if not name.startswith(".")}
        summary = json.loads((out / "summary.json").read_text())
        if (out / NOTES).read_text() != "mine":
            return f"{NOTES} is lost"
        if not summary["complete"] or names != {NOTES, "summary.json", *summary["files"]}:
            return f"not complete: {sorted(names)}"
        for name, digest in summary["files"].items():
            if f"sha256:{hashlib.sha256((out / name).read_bytes()).hexdigest()}" != digest:
                return f"{name} is of another run"
        return f"{summary['settings']['contact'][0]['law']['k']:.0e}".replace("+0", "")
    except (OSError, ValueError, KeyError) as fault:
        return f"{type(fault).__name__}: {fault}"


def begin(place: Path) -> None:
    """Put the results of a run and a file of the user's there."""
    done = run(place, STIFFNESS[0])
    assert done.returncode == 0, done.stderr
    (place / "out" / NOTES).write_text("mine")
    assert state(place) == STIFFNESS[0], state(place)


def calls_on(place: Path, log: Path) -> list[tuple[str, int]]:
    """Return the system calls that touched files below `place`, each with its ordinal.

    `log` is strace's, of one process: descriptors are shown with their paths.
    """
    counts: Counter[str] = Counter()
    found = []
    for line in log.read_text(errors="replace").splitlines():
        call = re.match(r"(?:\d+ +)?(\w+)\(", line)
        if call is None:
            continue
        counts[call[1]] += 1
        if str(place) in line and not (call[1] == "openat" and "O_RDONLY" in line):
            found.append((call[1], counts[call[1]]))
    return found


def kill_at_every_call(place: Path) -> list[str]:
    """Kill the run at each of its system calls on files; return what was wrong."""
    log = place / ".strace"
    keep = place.with_name(f"{place.name}-keep")
    begin(place)
    shutil.copytree(place, keep)
    traced = run(place, STIFFNESS[1], "strace", "-y", "-o", str(log), "-e", f"trace={CALLS}")
    assert traced.returncode == 0, traced.stderr
    calls = calls_on(place, log)
    print(f"{len(calls)} system calls: {dict(Counter(name for name, _ in calls))}", flush=True)
    found: Counter[str] = Counter()
    wrong = []
    for name, ordinal in calls:
        shutil.rmtree(place)
        shutil.copytree(keep, place)
        inject = f"inject={name}:signal=KILL:when={ordinal}"
        done = run(
            place, STIFFNESS[1], "strace", "-o", "/dev/null", "-e", f"trace={name}", "-e", inject
        )
        left = state(place)
        found[f"exit code {done.returncode}, results of {left}"] += 1
        if left not in STIFFNESS:
            wrong.append(f"{name} {ordinal}: {left}")
    again = run(place, STIFFNESS[1])
    if again.returncode or os.listdir(place) != ["out"] or state(place) != STIFFNESS[1]:
        wrong.append(f"the next run leaves {os.listdir(place)}: {again.stderr}")
    shutil.rmtree(keep)
    print(dict(found), flush=True)
    return wrong


def kill_at_random(place: Path, times: int) -> list[str]:
    """Kill a chain of runs, each over what the one before left; return what was wrong.

    Half of them at any time, half while the files are being written.
    """
    begin(place)
    rng = random.Random(1)
    writing = place / ".out.writing"
    start, drawn = time.monotonic(), 0.0
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command(place, STIFFNESS[1]), **silent) as process:
        while process.poll() is None:
            drawn = drawn or (time.monotonic() if writing.exists() else 0.0)
            time.sleep(0.001)
    whole, drawn = time.monotonic() - start, time.monotonic() - drawn
    found: Counter[str] = Counter()
    wrong = []
    for n in range(times):
        before = state(place)
        wanted = STIFFNESS[before == STIFFNESS[0]]
        if n % 2:  # what is left is cleared away now, to see the new files appear
            with AtomicFolder(place / "out", last="summary.json", inner=["stopped"]):
                pass
        with subprocess.Popen(command(place, wanted), **silent) as process:
            wait = rng.uniform(0.0, whole)
            if n % 2:
                while not writing.exists() and process.poll() is None:
                    time.sleep(0.001)
                wait = rng.uniform(0.0, drawn)
            try:
                process.wait(wait)
            except subprocess.TimeoutExpired:
                process.kill()
        left = state(place)
        found["old" if left == before else "new" if left == wanted else "wrong"] += 1
        if process.returncode not in (0, -9) or left not in STIFFNESS:
            wrong.append(f"{n}, exit code {process.returncode}: {left}")
    again = run(place, STIFFNESS[0])
    if again.returncode or os.listdir(place) != ["out"] or state(place) != STIFFNESS[0]:
        wrong.append(f"the next run leaves {os.listdir(place)}: {again.stderr}")
    print(f"{times} SIGKILLs at random times leave {dict(found)}", flush=True)
    return wrong


def fill_disks(place: Path, sizes: int = 24) -> list[str]:
    """Run on file systems that are full after a while; return what was wrong."""
    place.mkdir(exist_ok=True)
    wrong = []
    found: Counter[str] = Counter()
    begin_size, told = 0, ""
    for n in range(sizes):
        options = ["-t", "tmpfs", "-o", "size=64m", "tmpfs", str(place)]
        if subprocess.run(["mount", *options], capture_output=True, check=False).returncode:
            print("full disks: left out, for file systems cannot be mounted here")
            return wrong
        try:
            begin(place)
            used = shutil.disk_usage(place).used
            begin_size = begin_size or used
            room = used + n * begin_size // (sizes - 4)
            resize = f"remount,size={room}"
            subprocess.run(["mount", "-o", resize, str(place)], check=True)
            done = run(place, STIFFNESS[1])
            left = state(place)
            expected = {0: STIFFNESS[1], 2: STIFFNESS[0]}.get(done.returncode, "?")
            found[f"exit code {done.returncode}"] += 1
            if left != expected or os.listdir(place) != ["out"]:
                wrong.append(f"{room} bytes: {left}, {os.listdir(place)}: {done.stderr}")
            elif done.returncode and done.stderr.count("\n") != 1:
                wrong.append(f"{room} bytes: {done.stderr}")
            told = done.stderr if done.returncode else told
        finally:
            subprocess.run(["umount", str(place)], check=True)
    print(f"{sizes} small file systems: {dict(found)}; the last error was\n  {told}", flush=True)
    return wrong


def main() -> int:
    """Kill and fill; return 1 if anything but whole results was found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--times", type=int, default=200, help="SIGKILLs at random times")
    parser.add_argument("--only", choices=["calls", "random", "full"])
    chosen = parser.parse_args()
    wrong = []
    with tempfile.TemporaryDirectory() as name:
        if chosen.only in (None, "calls") and shutil.which("strace"):
            (Path(name) / "a").mkdir()
            wrong += kill_at_every_call(Path(name) / "a")
        if chosen.only in (None, "random"):
            (Path(name) / "b").mkdir()
            wrong += kill_at_random(Path(name) / "b", chosen.times)
        if chosen.only in (None, "full"):
            wrong += fill_disks(Path(name) / "c")
    for one in wrong:
        print(f"wrong: {one}")
    print("failed" if wrong else "whole old or whole new each time")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
