"""The same scenes in other engines: findings and tables.

The same scenes, each with a truth that no engine computes, in other engines. Every engine runs in a
process of its own on one core, with the settings that its documentation recommends; the errors are
worked out from the motion of the ball alone, in the same way for all. Costs are CPU time of
stepping. In the swing each peer is taken at its best error and this package at its cheapest setting
that is at least as good in period and energy; ratios are measured in turns.
"""

import math

from benchmarks.measured import Measured
from benchmarks.peers.measuring import Ratio, Row, errors_text, params_text
from benchmarks.peers.scenes import SCENES
from benchmarks.peers.workers import engine_called
from sphshell_pin.study.report.contents import (
    TIMES,
    Finding,
    Section,
    Table,
    about,
    columns,
)
from sphshell_pin.study.report.machine import machine

KEY, TITLE = "peers", "Other engines"
SWING = "bowl"
TITLES = {name: make().title for name, make in SCENES.items()}
TEXT = about(__doc__)
AIMED = (
    "Panda press with control on 200 k triangles, time of a step: fastest peer",
    "bowl swing, CPU time at equal errors of period and energy: peer of the best error",
)
MISSING = "Engines that are not installed have no figures here: pip install -e benchmarks."


def assemble(rows: list[Row], ratios: list[Ratio]) -> Section:
    """Return the section of what was measured."""
    names = list(dict.fromkeys(row.scene for row in rows))
    return Section(
        KEY,
        TITLE,
        TEXT,
        findings=findings_of(ratios),
        tables=[
            ratios_table(ratios),
            *(scene_table(rows, scene, TITLES.get(scene, scene)) for scene in names),
            settings_table(rows),
        ],
        notes=notes_of(rows),
    )


def name_of(engine: str) -> str:
    """Return the name of an engine on the page."""
    return engine_called(engine).name


def notes_of(rows: list[Row]) -> list[str]:
    """Return versions, and who is missing."""
    versions = dict.fromkeys(row.version for row in rows if row.version)
    absent = any(row.note.startswith("not installed") for row in rows)
    return [f"Versions: {', '.join(versions)}.", *([MISSING] if absent else [])]


def findings_of(ratios: list[Ratio]) -> list[Finding]:
    """Return the ratios that count: the fastest peer at the press, the best at the swing."""
    press = [r for r in ratios if r.peer.scene == "press"]
    swings = [r for r in ratios if r.peer.scene.startswith(SWING)]
    chosen = []
    if press:
        chosen.append(("peers_press", AIMED[0], min(press, key=lambda r: r.median), 1.6))
    if swings:
        best = min(swings, key=lambda r: r.peer.errors["period"] * r.peer.errors["energy"])
        chosen.append(("peers_swing", AIMED[1], best, 100.0))
    return [
        Finding(
            key, f"{what} ({name_of(one.peer.engine)}) / ours", one.median, TIMES, one.low,
            one.high, aim, sense=">=",
        )
        for key, what, one, aim in chosen
    ]  # fmt: skip


def ratios_table(ratios: list[Ratio]) -> Table:
    """Return every peer's ratio."""
    return Table(
        "peers_ratios",
        "Cost of a peer over ours, in turns.",
        columns(
            "scene",
            "peer",
            f"ratio: peer / ours [{TIMES}]",
            "low: lower quartile",
            "high: upper quartile",
            "peer_errors: its errors",
            "our_errors: ours",
            "peer_setting: its setting",
            "our_setting: ours",
        ),
        [
            (r.what, name_of(r.peer.engine), r.median, r.low, r.high)
            + (errors_text(r.peer.errors), errors_text(r.ours.errors))
            + (params_text(r.peer.params), params_text(r.ours.params))
            for r in ratios
        ],
    )


def scene_table(rows: list[Row], scene: str, title: str) -> Table:
    """Return all settings of all engines in one scene."""
    found = [row for row in rows if row.scene == scene]
    names = list(dict.fromkeys(name for row in found for name in row.errors))
    unit = next((row.unit for row in found if row.unit), "")
    return Table(
        f"peers_{scene.replace(' ', '_')}",
        f"{title}.",
        columns(
            "engine",
            "setting",
            *(f"{name.replace(' ', '_')}: {name}" for name in names),
            f"cost: {unit}",
            "low: lower quartile",
            "high: upper quartile",
            "note",
        ),
        [
            (name_of(row.engine), params_text(row.params))
            + tuple(row.errors.get(name, math.nan) for name in names)
            + (row.cost, row.low, row.high, row.note)
            for row in found
        ],
    )


def settings_table(rows: list[Row]) -> Table:
    """Return what was set in each engine, and who recommends it."""
    settings = dict.fromkeys(
        (name_of(row.engine), row.scene, name, str(text))
        for row in rows
        for name, text in row.settings.items()
    )
    return Table(
        "peers_settings",
        "Settings, and where they are recommended.",
        columns("engine", "scene", "setting", "text: value and source"),
        list(settings),
    )


def site_sections(rows: list[Row], ratios: list[Ratio]) -> list[Measured]:
    """Return what docs/peers.md shows: the tables, with what each scene is."""
    found = [
        Measured(text=f"{machine()}; every engine on one core. {notes_of(rows)[0]}"),
        Measured.of(ratios_table(ratios), "How much more a peer costs"),
    ]
    for scene in dict.fromkeys(row.scene for row in rows):
        about = " ".join((type(SCENES[scene]()).__doc__ or "").split())
        table = scene_table(rows, scene, TITLES[scene])
        found.append(Measured.of(table, TITLES[scene], about))
    return [*found, Measured.of(settings_table(rows), "Settings")]
