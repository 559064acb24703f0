"""The tables: on the screen, in docs/peers.md, and as CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import platform
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sphshell_pin.benchmarks.peers.engine import Knob
from sphshell_pin.benchmarks.peers.measuring import Ratio, Row
from sphshell_pin.benchmarks.peers.scenes import SCENES

PAGE = Path(__file__).parent.parent.parent / "docs" / "peers.md"


def machine_line() -> str:
    """Return one line on what this runs on."""
    return f"{platform.machine()}, Python {platform.python_version()}; every engine on one core"


def knob_text(knob: Knob) -> str:
    """Return a setting in a few words."""
    return ", ".join(
        f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in knob.items()
    )


def short_text(knob: Knob) -> str:
    """Return the values of a setting."""
    return " ".join(
        f"{value:.3g}" if isinstance(value, float) else str(value) for value in knob.values()
    )


def cost_text(row: Row) -> str:
    """Return the cost with its quartiles."""
    return f"{row.cost:.3g} [{row.low:.3g}, {row.high:.3g}]"


def of_scene(rows: list[Row], scene: str) -> tuple[list[Row], list[str]]:
    """Return the rows of a scene and the names of their errors."""
    found = [row for row in rows if row.scene == scene]
    return found, list(dict.fromkeys(name for row in found for name in row.errors))


def text_tables(rows: list[Row], ratios: list[Ratio]) -> str:
    """Return all tables as text."""
    lines: list[str] = []
    for scene in dict.fromkeys(row.scene for row in rows):
        found, names = of_scene(rows, scene)
        unit = SCENES[scene]().unit
        head = f"{'engine':10s} {'setting':62s}" + "".join(f"{name:>16s}" for name in names)
        lines += ["", SCENES[scene]().title, f"  {head}   {unit}, median [quartiles]"]
        for row in found:
            if row.note and not row.errors:
                lines.append(f"  {row.engine:10s} {short_text(row.knob)} {row.note}".rstrip())
                continue
            errors = "".join(f"{row.errors.get(name, math.nan):16.1e}" for name in names)
            cost = row.note or cost_text(row)
            lines.append(f"  {row.engine:10s} {short_text(row.knob):62s}{errors}   {cost}")
    return "\n".join([*lines, "", *map(ratio_text, ratios)])


def ratio_text(ratio: Ratio) -> str:
    """Return a ratio as a line."""
    errors = ", ".join(
        f"{name} {value:.1e} / {ratio.ours.errors[name]:.1e}"
        for name, value in ratio.peer.errors.items()
    )
    return (
        f"{ratio.what}: {ratio.peer.engine} / ours = {ratio.median:.3g} [{ratio.low:.3g}, "
        f"{ratio.high:.3g}] x in {ratio.peer.unit} ({errors}; {knob_text(ratio.peer.knob)} / "
        f"{knob_text(ratio.ours.knob)})"
    )


def page(rows: list[Row], ratios: list[Ratio], quick: bool = False) -> str:
    """Return docs/peers.md."""
    command = f"python -m benchmarks.peers{' --quick' if quick else ''} --write"
    versions = ", ".join(dict.fromkeys(row.version for row in rows if row.version))
    parts = [
        INTRODUCTION.replace("COMMAND", command),
        f"{machine_line()}: {versions}.\n",
        "## How much more a peer costs\n",
    ]
    parts.append(
        "| what | peer | peer's cost / ours | errors, or depth pressed, peer / ours "
        "| settings, peer / ours |"
    )
    parts.append("|---|---|---|---|---|")
    for ratio in ratios:
        errors = ", ".join(
            f"{name} {value:.1e} / {ratio.ours.errors[name]:.1e}"
            for name, value in ratio.peer.errors.items()
        )
        settings = f"{knob_text(ratio.peer.knob)} / {knob_text(ratio.ours.knob)}"
        middle = f"{ratio.median:.3g} [{ratio.low:.3g}, {ratio.high:.3g}]"
        parts.append(f"| {ratio.what} | {ratio.peer.engine} | {middle} | {errors} | {settings} |")
    for scene in dict.fromkeys(row.scene for row in rows):
        parts.append(scene_part(rows, scene))
    return "\n".join(parts) + "\n"


def scene_part(rows: list[Row], scene: str) -> str:
    """Return the section of a scene."""
    found, names = of_scene(rows, scene)
    built = SCENES[scene]()
    told = " ".join((type(built).__doc__ or "").split())
    table = io.StringIO()
    print(f"\n## {built.title}\n\n{told}\n", file=table)
    print(f"| engine | setting | {' | '.join(names)} | {built.unit} |", file=table)
    print("|" + "---|" * (len(names) + 3), file=table)
    for row in found:
        if row.note and not row.errors:
            empty = " |" * len(names)
            print(f"| {row.engine} | {knob_text(row.knob)} {row.note} |{empty} |", file=table)
            continue
        errors = " | ".join(f"{row.errors[n]:.1e}" if n in row.errors else "" for n in names)
        cost = row.note or cost_text(row)
        print(f"| {row.engine} | {knob_text(row.knob)} | {errors} | {cost} |", file=table)
    print(file=table)
    for engine in dict.fromkeys(row.engine for row in found if row.settings):
        settings = next(row.settings for row in found if row.engine == engine and row.settings)
        text = "; ".join(f"{name}: {value}" for name, value in settings.items())
        print(f"- {engine}: {text}", file=table)
    return table.getvalue().rstrip("\n")


def write_files(folder: Path, rows: list[Row], ratios: list[Ratio]) -> None:
    """Write results.csv and results.json into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    names = list(dict.fromkeys(name for row in rows for name in row.errors))
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    fields = ["scene", "engine", "version", "knob", "unit", "cost", "low", "high", "steps", "note"]
    writer.writerow(fields + names)
    for row in rows:
        values: list[Any] = [getattr(row, name) for name in fields]
        values[3] = knob_text(row.knob)
        writer.writerow(values + [row.errors.get(name, "") for name in names])
    replace(folder / "results.csv", table.getvalue())
    content = {
        "machine": machine_line(),
        "rows": [row.as_dict() for row in rows],
        "ratios": [asdict(ratio) for ratio in ratios],
    }
    # JSON has no NaN: what was not measured is null.
    text = json.dumps(finite(content), indent=1, allow_nan=False)
    replace(folder / "results.json", text + "\n")


def finite(content: Any) -> Any:
    """Return the content with None for numbers that are not finite."""
    if isinstance(content, dict):
        return {key: finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def replace(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    beside = path.with_name(path.name + ".part")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, path)


INTRODUCTION = """# The same scenes in other engines

Written by `COMMAND` (`--quick`: fewer settings and swings; the engines
come with the extra `peers`). Each scene has a truth that no engine computes; each engine runs in a
process of its own, with the settings that its documentation recommends, printed below each table.
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
