"""What the documentation site shows of the other engines: docs/measured/peers.json."""

from __future__ import annotations

import platform

from sphshell_pin.benchmarks.measured import Measured
from sphshell_pin.benchmarks.peers.measuring import Ratio, Row
from sphshell_pin.benchmarks.peers.scenes import SCENES
from sphshell_pin.study.report import peers as report

TITLES = {name: make().title for name, make in SCENES.items()}


def machine_line() -> str:
    """Return one line on what this runs on."""
    return f"{platform.machine()}, Python {platform.python_version()}; every engine on one core"


def sections(rows: list[Row], ratios: list[Ratio]) -> list[Measured]:
    """Return what docs/peers.md shows: the tables of the report, with what each scene is."""
    found = [
        Measured(text=f"{machine_line()}. {report.notes_of(rows)[0]}"),
        Measured.of(report.ratios_table(ratios), "How much more a peer costs"),
    ]
    for scene in dict.fromkeys(row.scene for row in rows):
        about = " ".join((type(SCENES[scene]()).__doc__ or "").split())
        table = report.scene_table(rows, scene, TITLES[scene])
        found.append(Measured.of(table, TITLES[scene], about))
    return [*found, Measured.of(report.settings_table(rows), "Settings")]
