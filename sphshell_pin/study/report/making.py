"""Measure the sections one after another, and write the page and its tables."""

import dataclasses
import json
import os
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sphshell_pin.base.atomic import AtomicFolder
from sphshell_pin.base.atomic.files import held_folder
from sphshell_pin.base.regular_file import read_text
from sphshell_pin.base.texts import json_text
from sphshell_pin.errors import SetupWarning, SphshellError, WeakLawWarning
from sphshell_pin.study.report import convergence, integrators, queries, steps, timing
from sphshell_pin.study.report.contents import Progress, Section, findings_table
from sphshell_pin.study.report.machine import caution_of, describe
from sphshell_pin.study.report.page import render

PAGE, DATA = "report.md", "report.json"
_STATED = ("key", "title", "error", "seconds", "notes")
Tell = Callable[[str, float], None]
"""Called with the section's title and the share of all that is done."""


@dataclass(frozen=True)
class Part:
    """A section to be, of measure(quick=, progress=).

    `seconds` it takes, about, with --quick and in full.
    """

    key: str
    title: str
    measure: Callable[..., Section]
    seconds: tuple[float, float]


PARTS = (
    Part(convergence.KEY, convergence.TITLE, convergence.section, (8.0, 20.0)),
    Part(queries.KEY, queries.TITLE, queries.section, (30.0, 240.0)),
    Part(integrators.KEY, integrators.TITLE, integrators.section, (10.0, 60.0)),
    Part(steps.KEY, steps.TITLE, steps.section, (15.0, 60.0)),
)


@dataclass(frozen=True)
class Report:
    """What was measured, on which machine."""

    sections: list[Section]
    machine: dict[str, str]
    caution: str = ""
    """A sentence about a machine that was busy."""

    @property
    def failed(self) -> list[Section]:
        """The sections that could not be measured."""
        return [section for section in self.sections if section.error is not None]


def make_report(
    out: Path,
    *,
    quick: bool = False,
    command: str = "",
    tell: Tell | None = None,
    parts: Sequence[Part] | None = None,
) -> Report:
    """Measure everything, then write the page and its tables to the folder `out`.

    An error of one section is stated in that section. Nothing is written before all is measured, so
    that an interrupted run leaves what was there. `tell` is called with the progress. `parts` take
    the place of all that is measured else.

    Raises
    ------
    ResultError
        Where the folder cannot be written.
    """
    with held_folder(out, DATA) as place:
        report = _measure(parts or PARTS, quick, command, tell or (lambda title, share: None))
        _write(report, out, place)
    return report


def _measure(parts: Sequence[Part], quick: bool, command: str, tell: Tell) -> Report:
    begin, load = time.perf_counter(), os.getloadavg()[0]
    machine = describe(command)
    whole = sum(part.seconds[not quick] for part in parts)
    sections, done = [], 0.0
    for part in parts:
        begun, done = done, done + part.seconds[not quick] / whole
        progress = timing.part(partial(tell, part.title), begun, done)
        progress(0.0)
        sections.append(measured(part, quick=quick, progress=progress))
    machine["measured in"] = f"{time.perf_counter() - begin:.0f} s{', quick' if quick else ''}"
    machine["load before"] = f"{load:.2f}"
    return Report(sections, machine, caution=caution_of(load))


def measured(part: Part, *, quick: bool, progress: Progress) -> Section:
    """Return the section, or one that says what went wrong."""
    begin = time.perf_counter()
    try:
        with warnings.catch_warnings():
            # Steps are timed with a soft sheet, which fast robots might fall through; integrators
            # are measured with steps that are too long, too.
            for kind in (WeakLawWarning, SetupWarning):
                warnings.simplefilter("ignore", kind)
            with timing.on_one_core():
                section = part.measure(quick=quick, progress=progress)
    except KeyboardInterrupt:  # Interrupted is an Exception, too
        raise
    except Exception as error:
        known = isinstance(error, SphshellError)
        text = str(error) if known else f"{type(error).__name__}: {error}"
        section = Section(part.key, part.title, error=text)
    return dataclasses.replace(section, seconds=time.perf_counter() - begin)


def _write(report: Report, out: Path, place: AtomicFolder) -> None:
    """Write page, tables and data; all of them take the place of an earlier report's at once."""
    files = {f"{t.name}.csv": t.csv().encode() for s in report.sections for t in s.tables}
    files[DATA] = report_json(report, sorted(files)).encode()
    files[PAGE] = render(report.sections, report.machine, report.caution).encode()
    place.write(files.items(), [PAGE, DATA, *_files_of_old(out)])


def _files_of_old(out: Path) -> list[str]:
    """Return the tables of the report that is in the folder."""
    try:
        names = json.loads(read_text(out / DATA))["files"]
        return [name for name in names if Path(name).name == name and name.endswith(".csv")]
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return []


def report_json(report: Report, files: list[str]) -> str:
    """Return the report's data; its tables as Markdown, with all digits they are in `files`."""
    data = {
        "machine": report.machine,
        "caution": report.caution,
        "files": files,
        "sections": [
            {key: getattr(section, key) for key in _STATED}
            | {
                "findings": [
                    dataclasses.asdict(f) | {"met": f.met, "row": row}
                    for f, row in zip(
                        section.findings, findings_table(section.findings).cells, strict=True
                    )
                ],
                "tables": {table.name: table.markdown() for table in section.tables},
            }
            for section in report.sections
        ],
    }
    return json_text(data, ensure_ascii=False)
