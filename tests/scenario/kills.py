"""What commands leave behind when they are killed at random times.

`python -m tests.scenario.kills` runs each command of `COMMANDS` over its own earlier results and
kills it. After each kill the folder must have all old files or all new ones, and those of others.
Returns 1 if anything else was found. `test_results_kills` ends what writes at every file operation,
and on full disks.
"""

import argparse
import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sphshell_pin.base.atomic import AtomicFolder
from tests.scenario.operations import visible

MAIN = [sys.executable, "-c", "from sphshell_pin.cli import main; main()"]
REPORT = """
import sys
from sphshell_pin.study.report.making import Part, make_report
from sphshell_pin.study.report.contents import Finding, Section
value = float(sys.argv[1])
found = Section("x", "X", findings=[Finding("a", "a", value)])
make_report("out", parts=[Part("x", "X", lambda **_: found, (1.0, 1.0))])
"""
SCENE, STIFFNESS = "sphere_on_shell", "contact.ball-bowl.law.k"


def report_of(files: dict[str, bytes]) -> str:
    """Return the figure of the report whose files these are: its page has the time of day."""
    data = json.loads(files["report.json"])
    if {*files} != {"report.html", "report.json", *data["files"]}:
        return f"not complete: {sorted(files)}"
    (figure,) = data["sections"][0]["findings"]
    known = f"{figure['value']:g}"
    same = files["findings.csv"].decode().rstrip().splitlines()[-1].split(",")[3]
    shown = f">{figure['row'][1]}" in files["report.html"].decode()
    return known if float(same) == figure["value"] and shown else f"{known}, {same} and a page"


def run_of(files: dict[str, bytes]) -> str:
    """Return the stiffness of the run whose files these are, by the SHA-256 in its summary."""
    summary = json.loads(files["summary.json"])
    if not summary["complete"] or {*files} != {"summary.json", *summary["files"]}:
        return f"not complete: {sorted(files)}"
    for name, digest in summary["files"].items():
        if f"sha256:{hashlib.sha256(files[name]).hexdigest()}" != digest:
            return f"{name} is of another run"
    return f"{summary['settings']['contact'][0]['law']['k']:.0e}".replace("+0", "")


@dataclass(frozen=True)
class Command:
    """A command that writes into the folder `out` below the current one."""

    words: str
    """What it is called with; {value} stands for one of two values."""
    values: tuple[str, str]
    last: str
    """The file that says that the others are complete."""
    journal: str = ""
    """What it resumes from; it is removed once the command has done all."""
    beside: str = ""
    """The command whose results are in the same folder."""
    program: Sequence[str] = tuple(MAIN)
    whole: Callable[[dict[str, bytes]], str] | None = None
    """Returns the value whose files these are. By default they have always the same bytes."""


COMMANDS = {
    "run": Command(
        f"run {SCENE} --duration 0.03 --set {STIFFNESS}={{value}} --out out",
        ("1e5", "2e5"),
        "summary.json",
        beside="sweep",
        whole=run_of,
    ),
    "fit": Command(
        f"fit ../{{value}}.csv {SCENE} --param gravity.2 --out out", ("9.8", "9.7"), "fit.json"
    ),
    "render": Command(
        "render ../drawn --to {value} --fps 400 --size 320x240 --out out",
        ("0.02", "0.03"),
        "frame_0001.png",
    ),
    "sweep": Command(
        f"sweep {SCENE} --duration 0.01 --vary {STIFFNESS}=1e4:{{value}}:4 --workers 0 "
        "--no-pictures --out out/sweep.parquet",
        ("1e5", "2e5"),
        "sweep.parquet",
        journal="sweep.parquet.journal",
        beside="run",
    ),
    "new": Command(
        "new --robot three_link_finger --radius {value} --out out/new.toml --force",
        ("0.01", "0.02"),
        "new.toml",
    ),
    "report": Command(
        "{value}",
        ("1", "2"),
        "report.json",
        program=(sys.executable, "-c", REPORT),
        whole=report_of,
    ),
}


def prepare(folder: Path) -> None:
    """Write what the commands read: data of two falls, and a run to be drawn."""
    for gravity in COMMANDS["fit"].values:
        rows = [f"{k / 1000},{0.073 - float(gravity) * k**2 / 2e6:.6f}" for k in range(0, 41, 2)]
        text = "\n".join(["t [s],q.root_joint.2 [m]", *rows])
        (folder / f"{gravity}.csv").write_text(text)
    words = COMMANDS["run"].words.format(value="1e5").replace("--out out", "--out drawn")
    subprocess.run([*MAIN, *words.split()], cwd=folder, check=True, capture_output=True)


class Trial:
    """A command in a folder of its own, `place`, in which it has written already."""

    def __init__(self, name: str, place: Path) -> None:
        self.command, self.place, self.out = COMMANDS[name], place, place / "out"
        self.values = self.command.values
        self._others: dict[str, bytes] = {}
        self._known: dict[str, dict[str, bytes]] = {}
        place.mkdir(exist_ok=True)

    def words(self, value: str) -> list[str]:
        """Return the command with one of its values."""
        return [*self.command.program, *self.command.words.format(value=value).split()]

    def run(self, value: str) -> subprocess.CompletedProcess[str]:
        """Run to the end."""
        return subprocess.run(
            self.words(value), cwd=self.place, capture_output=True, text=True, check=False
        )

    def begin(self) -> None:
        """Put the results of others and those of the first value there."""
        self.out.mkdir()
        if self.command.beside:
            done = Trial(self.command.beside, self.place).run(self.values[0])
            assert done.returncode == 0, done.stderr
        (self.out / "notes.txt").write_text("mine")
        self._others = visible(self.out)
        for value in reversed(self.values):
            done = self.run(value)
            assert done.returncode == 0, done.stderr
            self._known[value] = self._files()
            self.forget()
        assert self.state() == self.values[0], self.state()

    def forget(self) -> None:
        """Remove what the command would resume from."""
        if self.command.journal:
            (self.out / self.command.journal).unlink(missing_ok=True)

    def state(self) -> str:
        """Return the value whose results are in the folder; else what is wrong."""
        try:
            found, files = visible(self.out), self._files()
            for name, data in self._others.items():
                if found.get(name) != data:
                    return f"{name} of others is lost or changed"
            if self.command.whole is not None:
                return self.command.whole(files)
            known = [value for value, whole in self._known.items() if whole == files]
            return known[0] if known else f"not whole: {sorted(files)}"
        except (OSError, ValueError, KeyError) as fault:
            return f"{type(fault).__name__}: {fault}"

    def ends(self) -> list[str]:
        """Return what is wrong after a last run that nobody kills."""
        done = self.run(self.values[1])
        if done.returncode or os.listdir(self.place) != ["out"] or self.state() != self.values[1]:
            return [f"the next one leaves {os.listdir(self.place)}: {self.state()} {done.stderr}"]
        return []

    def is_writing(self) -> bool:
        """Whether the command has begun to write."""
        return any(any(one.glob(".*writing")) for one in (self.place, self.out))

    def clear(self) -> None:
        """Clear away what a killed command left, to see the next one begin to write."""
        with AtomicFolder(self.out, last=self.command.last, inner=["stopped"]):
            for left in self.out.glob(".*.writing"):
                left.unlink()

    def _files(self) -> dict[str, bytes]:
        """Return the command's own files."""
        resumed = self.command.journal or "/"
        return {
            name: data
            for name, data in visible(self.out).items()
            if name not in self._others and not name.startswith(resumed)
        }


def kill_at_random(trial: Trial, times: int) -> list[str]:
    """Kill a chain of commands, each over what the one before left; return what was wrong.

    Half of them at any time, half while the files are being written; a third by Ctrl-C.
    """
    trial.begin()
    rng = random.Random(1)
    start, drawn = time.monotonic(), 0.0
    silent = {
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.DEVNULL,
        "cwd": trial.place,
    }
    with subprocess.Popen(trial.words(trial.values[1]), **silent) as process:
        while process.poll() is None:
            drawn = drawn or (time.monotonic() if trial.is_writing() else 0.0)
            time.sleep(0.001)
    whole, drawn = time.monotonic() - start, time.monotonic() - drawn
    trial.forget()
    found: Counter[str] = Counter()
    wrong = []
    for n in range(times):
        before = trial.state()
        wanted = trial.values[before == trial.values[0]]
        if n % 2:
            trial.clear()
        with subprocess.Popen(trial.words(wanted), **silent) as process:
            wait = rng.uniform(0.0, whole)
            if n % 2:
                while not trial.is_writing() and process.poll() is None:
                    time.sleep(0.001)
                wait = rng.uniform(0.0, drawn)
            try:
                process.wait(wait)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGINT if n % 3 == 2 else signal.SIGKILL)
        left = trial.state()
        found["old" if left == before else "new" if left == wanted else "wrong"] += 1
        # Python itself ends with -2 or 1 while it starts.
        ends = (0, 130, -2, 1) if n % 3 == 2 else (0, -9)
        if process.returncode not in ends or left not in trial.values:
            wrong.append(f"{n}, exit code {process.returncode}: {left}")
        if left == wanted:
            trial.forget()
    print(f"{times} signals at random times leave {dict(found)}", flush=True)
    return wrong + trial.ends()


def main() -> int:
    """Kill; return 1 if anything but whole results was found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--times", type=int, default=75, help="signals at random times, of each")
    parser.add_argument("--commands", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    chosen = parser.parse_args()
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        for name in chosen.commands:
            print(f"{name}:", flush=True)
            wrong += kill_at_random(Trial(name, Path(folder) / name), chosen.times)
    for one in wrong:
        print(f"wrong: {one}")
    print("failed" if wrong else "whole old or whole new each time")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
