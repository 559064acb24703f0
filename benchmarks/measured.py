"""What a command measured, as data of the documentation site: docs/measured/NAME.json.

The site shows it where a page has the line `[data](measured/NAME.json)`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import sphshell_pin
from sphshell_pin.base.atomic import write_whole
from sphshell_pin.base.texts import json_text
from sphshell_pin.study.report.contents import Table

FOLDER = Path(sphshell_pin.__file__).parent.parent / "docs" / "measured"


@dataclass(frozen=True)
class Measured:
    """A section: heading, Markdown above its pictures and table, and a list of notes below.

    `pictures` are files of docs/pictures with their captions; `table` has the headings as first
    row, and cells of plain text.
    """

    title: str = ""
    text: str = ""
    pictures: Sequence[tuple[str, str]] = ()
    table: Sequence[Sequence[str]] = ()
    notes: Sequence[str] = ()

    @classmethod
    def of(cls, table: Table, title: str = "", text: str = "") -> Measured:
        """Return a table of a report as a section."""
        headings = [column.heading for column in table.columns]
        return cls(title, text, table=[headings, *table.cells])


def write(name: str, command: str, sections: Sequence[Measured]) -> Path:
    """Write what `command` measured to NAME.json, and return its path."""
    kept = [{key: value for key, value in asdict(one).items() if value} for one in sections]
    data = {"command": command, "sections": kept}
    path = FOLDER / f"{name}.json"
    write_whole(path, json_text(data, ensure_ascii=False).encode())
    return path
