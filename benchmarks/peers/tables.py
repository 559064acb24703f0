"""The page of the documents: docs/peers.md."""

from __future__ import annotations

import platform
from pathlib import Path

from sphshell_pin.benchmarks.peers.measuring import Ratio, Row
from sphshell_pin.benchmarks.peers.scenes import SCENES
from sphshell_pin.study.report import peers as report

PAGE = Path(__file__).parent.parent.parent / "docs" / "peers.md"
TITLES = {name: make().title for name, make in SCENES.items()}


def machine_line() -> str:
    """Return one line on what this runs on."""
    return f"{platform.machine()}, Python {platform.python_version()}; every engine on one core"


def page(rows: list[Row], ratios: list[Ratio], quick: bool = False) -> str:
    """Return docs/peers.md: the tables of the report, with what each scene is."""
    command = f"python -m benchmarks.peers{' --quick' if quick else ''} --write"
    parts = [
        INTRODUCTION.replace("COMMAND", command),
        f"{machine_line()}. {report.notes_of(rows)[0]}",
        "## How much more a peer costs",
        report.ratios_table(ratios).markdown(),
    ]
    for scene in dict.fromkeys(row.scene for row in rows):
        about = " ".join((type(SCENES[scene]()).__doc__ or "").split())
        table = report.scene_table(rows, scene, TITLES[scene])
        parts += [f"## {TITLES[scene]}", about, table.markdown()]
    parts += ["## Settings", report.settings_table(rows).markdown()]
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


INTRODUCTION = """# The same scenes in other engines

Written by `COMMAND` (`--quick`: fewer settings and swings; the engines
come with the extra `peers`). Each scene has a truth that no engine computes; each engine runs in a
process of its own, with the settings that its documentation recommends, listed at the end.
The errors are worked out from the motion of the ball, in the same way for all. Costs are CPU time
of stepping, without building and reading; ratios are measured in turns.

- On a height field or a mesh of flat elements several contacts push at one place, and with linear
  springs they add up: that is why some peers sink less than they should on the plate.
- The law is a linear spring and dashpot. Where an engine has another one, the nearest was taken:
  see the settings.
- In the swing each peer is taken at its best error (of period and energy together, over all its
  settings), and this package at its cheapest setting that is at least as good in both. For the
  energy each engine gets the account that favours it. At a peer's coarser settings the ratio is
  smaller, as the tables show.
- Settings go from coarse to fine until the time for an engine is used up.
- Rolling: the point of contact counts as on the surface; an engine that puts it midway in the
  overlap is off by the depth, some 1e-3 here.
"""
