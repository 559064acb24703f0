"""What strangers' robot files come to: every robot in clones of repositories, loaded and checked.

    python -m tests.robots.census FOLDER... --most 8 --pairs 40 --write docs/measured/census.json

Each folder of a FOLDER is a repository. Of each, at most `--most` of its files of a whole robot
(URDF, xacro, MJCF) are loaded and go through check-robot, in a process with a time limit, first
without any option, then with the one that the refusal names. `--pairs` of them are asked for a
scenario too.
"""

from __future__ import annotations

import argparse
import multiprocessing
import re
import resource
import sys
import tempfile
import time
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from benchmarks.measured import Measured
from sphshell_pin import robots
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.study.robot_check import QUICK, check_robot

PARTS = Path(__file__).parents[1] / "data" / "corpus"
LIMIT = 60
"""Of the processor, for a file [s]."""

_XACRO = (
    "{http://www.ros.org/wiki/xacro}",
    "{http://wiki.ros.org/xacro}",
    "{http://ros.org/wiki/xacro}",
)
_BUILT_IN = {
    "include",
    "property",
    "arg",
    "macro",
    "if",
    "unless",
    "insert_block",
    "call",
    "element",
    "attribute",
}
_INCLUDED = re.compile(r"<xacro:include\s+filename=[\"'](?:[^\"']*/)?([^/\"']+)[\"']")
# What a refusal says to do, and how.
_ADVICE: dict[str, dict[str, object]] = {
    "--density 2700": {"density": 2700.0},
    "--no-mimic": {"mimic": False},
    "mimic = false": {"mimic": False},
    "--free-flyer": {"free_flyer": True},
}


@dataclass
class Row:
    """A robot's file: why each command refused it, "" where it did not, None: not asked."""

    repository: str
    file: str
    options: dict[str, object] = field(default_factory=dict)
    """What the refusals of the first attempts said to add."""
    load: str | None = None
    check: str | None = None
    new: str | None = None
    seconds: float = 0.0
    """Of `new`."""


def robot_files(folder: Path) -> Iterator[Path]:
    """Yield the files in `folder` that describe a whole robot, not macros, poses or parts."""
    files = [
        one
        for one in sorted(folder.rglob("*"))
        if one.suffix in (".urdf", ".xacro", ".xml") and one.is_file()
    ]
    parts = {
        (one.parent, name)
        for one in files
        if one.suffix == ".xacro"
        for name in _INCLUDED.findall(one.read_text(errors="replace"))
    }
    for file in files:
        if (file.parent, file.name) in parts or re.search(r"\.(srdf|gazebo)\b", file.name):
            continue
        try:
            root = ET.parse(file).getroot()
        except (ET.ParseError, OSError, ValueError, LookupError):
            if file.suffix != ".xml":
                yield file  # its reader has to say so
            continue
        if root.tag == "mujoco":
            if (
                root.find("worldbody//joint") is not None
                or root.find("worldbody//freejoint") is not None
            ):
                yield file
        elif root.tag == "robot" and root.get("name") and any(_makes(one) for one in root):
            yield file


def _makes(element: ET.Element) -> bool:
    """Whether an element of a <robot> makes links: a joint, or a call of a macro."""
    space, _, name = element.tag.rpartition("}")
    return name == "joint" if not space else space + "}" in _XACRO and name not in _BUILT_IN


def ask(file: Path, part: Path | None, row: Row) -> Row:
    """Load, check and draft, each until a refusal names no option that was not tried."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        row = _advised(row, "load", lambda row: _load(file, row))
        if row.load:
            return row
        row = _advised(row, "check", lambda row: _check(file, row))
        if part is not None:
            began = time.perf_counter()
            row = _advised(row, "new", lambda row: _new(file, part, row))
            row.seconds = time.perf_counter() - began
    return row


def _advised(row: Row, step: str, way) -> Row:
    while True:
        try:
            reason = way(row)
        except SphshellError as error:
            reason = str(error)
        except Exception as error:
            reason = f"FOREIGN {type(error).__name__}: {error}"
        setattr(row, step, reason)
        more = {k: v for word, one in _ADVICE.items() if word in reason for k, v in one.items()}
        if not more or row.options.items() >= more.items():
            return row
        row = replace(row, options=row.options | more)


def _load(file: Path, row: Row) -> str:
    options = {"mimic": True} | row.options
    robots.load_file(file, **options)
    return ""


def _check(file: Path, row: Row) -> str:
    report = check_robot(file, sizes=QUICK, **row.options)
    return "" if report.verdict == "pass" else "; ".join(report.remarks)


def _new(file: Path, part: Path, row: Row) -> str:
    with tempfile.TemporaryDirectory() as folder:
        unit = None if part.suffix.lower() in (".step", ".iges") else "mm"
        options = dict(row.options)
        base = "floating" if options.pop("free_flyer", False) else None
        new_scenario(file, part, unit=unit, base=base, out=Path(folder) / "made.toml", **options)
    return ""


def _child(pipe: Connection, file: Path, part: Path | None, row: Row) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT))
    pipe.send(ask(file, part, row))


def main() -> int:
    """Ask for each file, print, and write the tables of the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--most", type=int, default=8, help="files of a repository")
    parser.add_argument("--pairs", type=int, default=0, help="files that `new` is asked for")
    parser.add_argument("--only", default="", help="repositories with this in their name")
    parser.add_argument("--write", action="store_true", help="write docs/measured/census.json")
    asked = parser.parse_args()
    questions = []
    for repository in sorted(
        one for folder in asked.folders for one in folder.iterdir() if one.is_dir()
    ):
        if asked.only not in repository.name:
            continue
        files = list(robot_files(repository))
        chosen = np.unique(np.linspace(0, len(files) - 1, min(asked.most, len(files))).astype(int))
        questions += [(rank, repository, files[k]) for rank, k in enumerate(chosen)]
    parts = sorted(
        one for one in PARTS.iterdir() if one.suffix.lower() in (".step", ".stl", ".obj", ".iges")
    )
    drafted = set(np.linspace(0, len(questions) - 1, asked.pairs).astype(int))
    context = multiprocessing.get_context("fork")
    rows = []
    for k, (_, repository, file) in enumerate(sorted(questions)):
        row = Row(repository.name.replace("+", "/"), str(file.relative_to(repository)))
        here, there = context.Pipe(duplex=False)
        part = parts[k % len(parts)] if k in drafted else None
        child = context.Process(target=_child, args=(there, file, part, row))
        child.start()
        there.close()
        try:
            row = here.recv()
        except EOFError:
            row = replace(row, load=f"FOREIGN: the process died, or took {LIMIT} s")
        child.join()
        rows.append(row)
        if row:
            said = [
                f"{step}: {getattr(row, step)}"
                for step in ("load", "check", "new")
                if getattr(row, step)
            ]
            print(
                row.repository,
                row.file,
                row.options or "",
                part or "",
                f"{row.seconds:.0f} s",
                "; ".join(said) or "right",
                flush=True,
            )
    found = sections(rows)
    print(*found[0].text.split("\n"), sep="\n")
    print(*(" | ".join(map(str, one)) for section in found for one in section.table), sep="\n")
    return 0


def sections(rows: Sequence[Row]) -> list[Measured]:
    repositories = list(dict.fromkeys(row.repository for row in rows))
    loaded = [row for row in rows if row.load == ""]
    passed = [row for row in loaded if row.check == ""]
    text = f"{len(rows)} files: {len(loaded)} load, {len(passed)} pass"
    table = [["repository", "files", "load", "pass check-robot"]]
    for name in repositories:
        of = [row for row in rows if row.repository == name]
        table.append([name, len(of), sum(r.load == "" for r in of), sum(r.check == "" for r in of)])
    return [Measured(text=text, table=table)]


if __name__ == "__main__":
    sys.exit(main())
