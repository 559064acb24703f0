"""Section 4: what a step costs, by its parts."""

from __future__ import annotations

from typing import Any

import numpy as np

from sphshell_pin.study.report.contents import (
    TIMES,
    Column,
    Picture,
    Progress,
    Section,
    Table,
    benchmark,
    microseconds,
)
from sphshell_pin.study.report.drawing import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PAPER,
    RED,
    SMALL,
    VIOLET,
    drawing,
    pictured,
)
from sphshell_pin.study.report.drawing import (
    TEXT as SIZE,
)
from sphshell_pin.study.report.queries import finding, spread, times_columns

KEY, TITLE = "steps", "Cost of a step"
PARTS = {
    "aba": ("ABA", GREY),
    "integrate": ("integrate", VIOLET),
    "kinematics": ("kinematics", BLUE),
    "query": ("query", GREEN),
    "law": ("law and wrench", ORANGE),
    "rest": ("the rest", RED),
}
TEXT = """\
Semi-implicit Euler of a Panda with locked fingers and a 12 mm fingertip on a wavy sheet of 200 k
triangles, forces, losses and figures of every pair included, against nothing but Pinocchio's ABA
and integrate in a compiled loop. The parts are timed one by one at the first state, the whole in a
run that records two rows; the rest is what the whole takes beyond the parts: the guard against
tunnelling, the energy audit, summaries. It may come out below zero, as parts timed alone lose what
a step finds in the caches."""


def section(*, quick: bool, progress: Progress) -> Section:
    """Measure and return the section."""
    step, timing = benchmark("step"), benchmark("timing")
    rounds = 8 if quick else 50
    steps = step.measure_step(rounds, timing.part(progress, 0.0, 0.4))
    parts = step.measure_parts(rounds, timing.part(progress, 0.4, 0.7))
    added = step.measure_ingredients(rounds // 2, timing.part(progress, 0.7, 0.9))
    imports = timing.measure_import(5 if quick else 15, timing.part(progress, 0.9, 1.0))
    return assemble(steps, parts, added, imports)


def assemble(
    steps: dict[str, Any],
    parts: dict[str, dict[str, Any]],
    added: dict[str, Any],
    imports: dict[str, Any],
) -> Section:
    """Return the section of what was measured."""
    step = benchmark("step")
    scenes = {name: times for name, times in parts.items() if name != step.BARE}
    whole, control = steps[step.TOUCHING] / steps[step.BARE], steps[step.CONTROL_TOUCHING]
    return Section(
        KEY,
        TITLE,
        TEXT,
        findings=[
            finding(
                "step_touching",
                "Panda and fingertip touching 200 k triangles: whole step / bare ABA + integrate",
                whole,
                aim=1.8,
                headline=True,
            ),
            finding(
                "step_far",
                "the same with the sphere far away",
                steps[step.FAR] / steps[step.BARE],
            ),
            finding(
                "step_control",
                "with joint PD and gravity compensation: touching / no contact at all",
                control / steps[step.CONTROL_FREE],
                aim=1.35,
                headline=True,
            ),
            finding(
                "import",
                "import sphshell_pin / import pinocchio, whole interpreter",
                imports["sphshell_pin"] / imports["pinocchio"],
                aim=1.2,
            ),
        ],
        pictures=[picture(scenes, parts[step.BARE]["whole"])],
        tables=[steps_table(steps), parts_table(scenes), ingredients_table(added)],
    )


def with_rest(times: dict[str, Any]) -> dict[str, float]:
    """Return the medians of the parts [s], and what the whole takes beyond them."""
    medians = {name: float(np.median(t)) for name, t in times.items()}
    whole = medians.pop("whole")
    return {**medians, "rest": whole - sum(medians.values())}


def steps_table(steps: dict[str, Any]) -> Table:
    """Return the times of whole steps."""
    bare = steps[benchmark("step").BARE]
    return Table(
        "steps",
        "Whole steps, in turn in one process.",
        (
            *times_columns(Column("scene", "scene")),
            Column("over_bare", f"over ABA + integrate [{TIMES}]"),
        ),
        [(name, *spread(t), float(np.median(t / bare))) for name, t in steps.items()],
    )


def parts_table(parts: dict[str, dict[str, Any]]) -> Table:
    """Return the medians of the parts."""
    headings = {key: f"{label} [us]" for key, (label, _) in PARTS.items()}
    return Table(
        "steps_parts",
        "Parts of a step, medians.",
        (
            Column("scene", "scene"),
            *(Column(f"{key}_s", text, microseconds) for key, text in headings.items()),
            Column("whole_s", "whole [us]", microseconds),
        ),
        [
            (
                name,
                *(with_rest(times).get(key, 0.0) for key in PARTS),
                float(np.median(times["whole"])),
            )
            for name, times in parts.items()
        ],
    )


def ingredients_table(added: dict[str, Any]) -> Table:
    """Return what each ingredient of a scene adds."""
    base = added["no contact"]
    return Table(
        "steps_ingredients",
        "What an ingredient adds to the step; a scene without it does not pay.",
        (*times_columns(Column("scene", "scene")), Column("added_s", "added [us]", microseconds)),
        [(name, *spread(t), float(np.median(t - base))) for name, t in added.items()],
    )


def picture(parts: dict[str, dict[str, Any]], bare: Any) -> Picture:
    """Draw the parts of each scene's step as a bar, and the bare dynamics as a line."""
    with drawing(7.8, 0.62 * len(parts) + 1.15) as figure:
        axis = figure.subplots()
        named: set[str] = set()
        total = max(float(np.median(t["whole"])) for t in parts.values()) * 1e6
        for row, times in enumerate(parts.values()):
            left = 0.0
            for key, seconds in with_rest(times).items():
                color = PARTS[key][1]
                width = seconds * 1e6
                if width <= 0:
                    continue
                axis.barh(row, width, 0.62, left=left, color=color, edgecolor=PAPER, linewidth=0.8)
                if width > 0.055 * total:
                    axis.text(
                        left + width / 2, row, f"{width:.2f}", color=PAPER, fontsize=SMALL,
                        ha="center", va="center",
                    )  # fmt: skip
                left += width
                named.add(key)
            axis.text(left + 0.01 * total, row, f"{left:.2f} us", va="center", fontsize=SIZE)
        line = float(np.median(bare)) * 1e6
        axis.axvline(line, color=INK, linewidth=1.0, linestyle=(0, (4, 3)))
        axis.annotate(
            f"ABA + integrate alone {line:.2f} us", (line, -0.5), xytext=(5, 2),
            textcoords="offset points", fontsize=SMALL, va="bottom", annotation_clip=False,
        )  # fmt: skip
        axis.set_yticks(range(len(parts)), list(parts))
        axis.set_ylim(len(parts) - 0.5, -0.5)
        axis.tick_params(axis="y", length=0)
        axis.spines["left"].set_visible(False)
        axis.set_xlabel("time of a step [us]")
        axis.margins(x=0.1)
        handles = [
            axis.barh(0, 0, color=color, label=label)
            for key, (label, color) in PARTS.items()
            if key in named
        ]
        figure.legend(
            handles=handles, loc="outside upper center", ncols=len(handles), frameon=False,
            fontsize=SMALL, handlelength=1.0, handleheight=1.0,
        )  # fmt: skip
        made = pictured(figure, "steps")
    return Picture(
        *made,
        "Bars of the parts of a step for three scenes, and the time of the bare dynamics.",
        "Medians of the parts of a step; dashed: nothing but ABA and integrate.",
    )
