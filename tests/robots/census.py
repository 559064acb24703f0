"""What strangers' robot files come to: those of clones of repositories, loaded and checked.

    python -m tests.robots.census CLONES --most 4 --pairs 40 --write

Each folder in CLONES is a repository (a link is another name of one). Up to `--most` of its files
of a whole robot (URDF, xacro, MJCF) are loaded and go through check-robot, in a process with a time
limit, first without options, then with those that the refusals name. `--pairs` of them are asked
for a scenario, too.
"""

import argparse
import multiprocessing
import re
import resource
import signal
import sys
import tempfile
import time
import warnings
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measured import Measured, write
from sphshell_pin import robots
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots.packages import Folders
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.study.robot_check import QUICK, check_robot
from tests.tables import cases_of

PARTS = Path(__file__).parents[1] / "data" / "corpus"
LIMIT = 60
"""Of the processor, for a file [s]."""

_LATE = f"it takes more than {LIMIT} s of the processor"
_ENDS = (".urdf", ".xacro", ".xml")
_BUILT_IN = {"include", "property", "arg", "macro", "if", "unless", "insert_block", "element"}
_INCLUDED = re.compile(r"<xacro:include\s+filename=[\"'](?:[^\"']*/)?([^/\"']+)[\"']")
_FOUND = re.compile(r"<xacro:include\s+filename=[\"']\$\(find (\w+)\)/([^\"']+)[\"']")
_ADVICE: dict[str, dict[str, Any]] = {
    "--density 2700": {"density": 2700.0},
    **{said: {"mimic": False} for said in ("--no-mimic", "mimic = false")},
    "--free-flyer": {"free_flyer": True},
}
_TABLES = cases_of("census")
_VALUES, _KINDS = _TABLES["values"], _TABLES["kinds"]
"""Values of arguments that files do not run without, and kinds of reasons by words in them."""


@dataclass
class Row:
    """One robot's file, and why each command refused it: "" where it did not, None: not asked."""

    repository: str
    file: str
    options: dict[str, Any] = field(default_factory=dict)
    """What refusals said to add."""
    load: str | None = None
    check: str | None = None
    new: str | None = None
    seconds: float = 0.0
    """Of the processor, for `new`."""

    @property
    def came_to(self) -> str:
        """What came of it."""
        return "not loaded" if self.load else "fails a check" if self.check else "right"


def robot_files(folder: Path) -> Iterator[Path]:
    """Yield the files in `folder` that describe a whole robot, not macros, poses or parts."""
    files = [one for one in sorted(folder.rglob("*")) if one.suffix in _ENDS and one.is_file()]
    texts = {one: one.read_text(errors="replace") for one in files if one.suffix == ".xacro"}
    parts = {(one.parent, name) for one in texts for name in _INCLUDED.findall(texts[one])}
    ends = tuple({"/".join(("", *one)) for text in texts.values() for one in _FOUND.findall(text)})
    for file in files:
        included = str(file).endswith(ends) or (file.parent, file.name) in parts
        if included or re.search(r"\.(srdf|gazebo)\b", file.name):
            continue
        try:
            root = ET.parse(file).getroot()
        except (ET.ParseError, OSError, ValueError, LookupError):
            if file.suffix != ".xml":
                yield file  # its reader has to say so
            continue
        moves = any(root.find(f"worldbody//{one}") is not None for one in ("joint", "freejoint"))
        if moves or (root.tag == "robot" and root.get("name") and any(map(_makes_links, root))):
            yield file


def _makes_links(element: ET.Element) -> bool:
    """Whether an element of a <robot> is a joint, or a call of a macro."""
    space, _, name = element.tag.rpartition("}")
    return ("xacro" in space and name not in _BUILT_IN) if space else name == "joint"


def ask(file: Path, part: Path | None, row: Row) -> Row:
    """Load, check and draft, each until a refusal names no option that was not tried."""
    unit = None if part is None or part.suffix.lower() in (".step", ".iges") else "mm"

    def load(row: Row) -> str:
        robots.load_file(file, **{"mimic": True, **row.options})
        return ""

    def check(row: Row) -> str:
        report = check_robot(file, sizes=QUICK, **row.options)
        return "" if report.verdict == "pass" else "; ".join(report.remarks)

    def new(row: Row) -> str:
        options = dict(row.options)
        base = "floating" if options.pop("free_flyer", False) else None
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder, "made.toml")
            new_scenario(file, str(part), unit=unit, base=base, out=out, **options)
        return ""

    warnings.simplefilter("ignore")
    row = _advised(file, row, "load", load)
    if not row.load:
        row = _advised(file, row, "check", check)
        began = time.process_time()
        row = row if part is None else _advised(file, row, "new", new)
        row.seconds = time.process_time() - began
    return row


def _advised(file: Path, row: Row, step: str, way: Callable[[Row], str]) -> Row:
    """Return `row` with the reason of a step's refusal, after what refusals say to add."""
    while True:
        try:
            reason = way(row)
        except SphshellError as error:
            reason = str(error)
        except Exception as error:
            reason = f"FOREIGN {type(error).__name__}: {error}"
        setattr(row, step, reason)
        more = {k: v for word, one in _ADVICE.items() if word in reason for k, v in one.items()}
        listed = reason.partition("sets:")[2]
        given = {name: _value(name, file) for name in _VALUES if f" {name}" in listed}
        if given:
            more["xacro_args"] = row.options.get("xacro_args", {}) | given
        if not more or row.options.items() >= more.items():
            return row
        row = replace(row, options=row.options | more)


def _value(name: str, file: Path) -> str:
    """Return the value of an argument of a xacro file, with the folders of packages."""
    place = Folders.of(file).package
    return re.sub(r"\{(\w+)\}", lambda found: str(place(found[1])), _VALUES[name])


def _asked(file: Path, part: Path | None, row: Row) -> Row:
    """Ask in a process of its own."""

    def answer(pipe: Connection) -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT + 5))
        pipe.send(ask(file, part, row))

    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)
    child = context.Process(target=answer, args=(there,))
    child.start()
    there.close()
    try:
        return here.recv()
    except EOFError:
        child.join()
        late = child.exitcode == -signal.SIGXCPU
        return replace(row, load="", check=_LATE) if late else replace(row, load="FOREIGN: died")
    finally:
        child.join()


def main() -> int:
    """Ask for each file, print, and write the tables of the documentation."""
    parser = argparse.ArgumentParser(prog="python -m tests.robots.census", description=__doc__)
    parser.add_argument("clones", type=Path)
    parser.add_argument("--most", type=int, default=4, help="files of a repository")
    parser.add_argument("--pairs", type=int, default=0, help="files that `new` is asked for")
    parser.add_argument("--write", action="store_true", help="write docs/measured/census.json")
    asked = parser.parse_args()
    questions = []
    for repository in sorted(asked.clones.iterdir()):
        if repository.is_dir() and not repository.is_symlink():
            files = list(robot_files(repository))
            chosen = np.linspace(0, len(files) - 1, min(asked.most, len(files))).astype(int)
            questions += [(rank, repository, files[k]) for rank, k in enumerate(chosen)]
    parts = [one for one in sorted(PARTS.iterdir()) if one.suffix.lower() in (".step", ".stl")]
    drafted = set(np.linspace(0, len(questions) - 1, asked.pairs).astype(int))
    rows = []
    for k, (_, repository, file) in enumerate(sorted(questions)):
        row = Row(repository.name.replace("+", "/"), str(file.relative_to(repository)))
        row = _asked(file, parts[k % len(parts)] if k in drafted else None, row)
        print(row, flush=True)
        if "but there is no such link" not in (row.load or ""):  # that is a tool for another robot
            rows.append(row)
    sections = tables(rows)
    for section in sections:
        print(section.text, *(" | ".join(one) for one in section.table), sep="\n")
    if asked.write:
        command = f"python -m tests.robots.census CLONES --most {asked.most}"
        command += f" --pairs {asked.pairs} --write" if asked.pairs else " --write"
        print(f"wrote {write('census', command, sections)}")
    return 1 if any("FOREIGN" in f"{row.load}{row.check}{row.new}" for row in rows) else 0


def tables(rows: Sequence[Row]) -> list[Measured]:
    """Return what the site shows: counts by repository, and the reasons of what fell."""
    drafts = [row for row in rows if row.new is not None]
    count = Counter(row.came_to for row in rows)
    loaded, times = len(rows) - count["not loaded"], [row.seconds for row in drafts]
    text = f"{len(rows)} files: {loaded} load ({loaded / len(rows):.0%}), {count['right']} pass "
    with_options = sum(bool(one.options) for one in rows)
    text += f"check-robot ({count['right'] / len(rows):.0%}), {with_options} with options that "
    text += "refusals named."
    if drafts:
        text += f" Of {len(drafts)} scenarios that `new` was asked for it wrote "
        text += f"{sum(not row.new for row in drafts)}; seconds of the processor: median "
        text += f"{np.median(times):.1f}, most {max(times):.1f}."
    table = [["repository", "files", "load", "pass check-robot"]]
    for name in dict.fromkeys(row.repository for row in rows):
        of = Counter(row.came_to for row in rows if row.repository == name)
        table.append([name, *map(str, (of.total(), of.total() - of["not loaded"], of["right"]))])
    fell = Counter((row.came_to, _kind(row.load or row.check or "")) for row in rows)
    fell.update(("no scenario", _kind(row.new)) for row in drafts if row.new)
    reasons = [[*what, str(number)] for what, number in fell.most_common() if what[0] != "right"]
    failures = [["outcome", "reason", "files"], *reasons]
    return [Measured(text=text, table=table), Measured("Failures", table=failures)]


def _kind(reason: str) -> str:
    """Return the kind of a reason, without what is of one file alone."""
    kinds = (kind for word, kind in _KINDS.items() if word in reason)
    return next(kinds, re.sub(r"/\S*/", "", reason)[:160])


if __name__ == "__main__":
    sys.exit(main())
