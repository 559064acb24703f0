"""Section 4: what a step costs, by its parts."""

from __future__ import annotations

import numpy as np

from sphshell_pin.benchmarks import step, timing
from sphshell_pin.study.report.contents import (
    TIME_COLUMNS,
    TIMES,
    Finding,
    Picture,
    Progress,
    Section,
    Table,
    columns,
    quartiles,
)
from sphshell_pin.study.report.drawing import (
    BLUE,
    DASHED,
    GREY,
    INK,
    ORANGE,
    PAPER,
    SMALL,
    drawing,
    png_of,
)
from sphshell_pin.study.report.drawing import TEXT as SIZE

Times = dict[str, np.ndarray]
KEY, TITLE = "steps", "Cost of a step"
PARTS = {
    "aba": ("ABA and integrate", GREY),
    "stepping": ("stepping", BLUE),
    "contact": ("contact", ORANGE),
}
TEXT = """\
Semi-implicit Euler of a Panda with locked fingers and a 12 mm fingertip on a wavy sheet of 200 k
triangles, forces, losses and figures of every pair included, against Pinocchio's ABA and integrate
alone, in a compiled loop. The parts are differences: stepping is what a scene without contact takes
beyond ABA (the guard against tunnelling, the energy audit, summaries), contact is what the touching
sphere adds (kinematics, query, law and wrench)."""


def section(*, quick: bool, progress: Progress) -> Section:
    """Measure and return the section."""
    rounds = 8 if quick else 50
    steps = step.measure_step(rounds, timing.part(progress, 0.0, 0.6))
    added = step.measure_ingredients(rounds // 2, timing.part(progress, 0.6, 0.9))
    imports = timing.measure_import(5 if quick else 15, timing.part(progress, 0.9, 1.0))
    return assemble(steps, added, imports)


def assemble(steps: Times, added: Times, imports: Times) -> Section:
    """Return the section of what was measured."""
    parts = step.parts_of(steps)
    bare, control = steps[step.BARE], steps[step.CONTROL_TOUCHING]
    return Section(
        KEY,
        TITLE,
        TEXT,
        findings=[
            Finding.of_rounds(
                "step_touching",
                "Panda and fingertip touching 200 k triangles: whole step / bare ABA + integrate",
                steps[step.TOUCHING] / bare,
                aim=1.8,
                headline=True,
            ),
            Finding.of_rounds(
                "step_far", "the same with the sphere far away", steps[step.FAR] / bare
            ),
            Finding.of_rounds(
                "step_control",
                "Panda with joint PD and gravity compensation: step touching / without any contact",
                control / steps[step.CONTROL_FREE],
                aim=1.35,
                headline=True,
            ),
            Finding.of_rounds(
                "import",
                "import sphshell_pin / import pinocchio, whole interpreter",
                imports["sphshell_pin"] / imports["pinocchio"],
                aim=1.2,
            ),
        ],
        pictures=[picture(parts)],
        tables=[steps_table(steps), parts_table(parts), ingredients_table(added)],
    )


def steps_table(steps: Times) -> Table:
    """Return the times of whole steps."""
    bare = steps[step.BARE]
    return Table(
        "steps",
        "Whole steps, in turn in one process.",
        columns("scene", *TIME_COLUMNS, f"over_bare: over ABA + integrate [{TIMES}]"),
        [(name, *quartiles(t), float(np.median(t / bare))) for name, t in steps.items()],
    )


def parts_table(parts: dict[str, Times]) -> Table:
    """Return the medians of the parts."""
    return Table(
        "steps_parts",
        "Parts of a step, medians.",
        columns(
            "scene",
            *(f"{key}_s: {name} [us]" for key, (name, _) in PARTS.items()),
            "whole_s: whole [us]",
        ),
        [
            (
                name,
                *(float(np.median(times[key])) for key in PARTS),
                float(np.median(sum(times.values()))),
            )
            for name, times in parts.items()
        ],
    )


def ingredients_table(added: Times) -> Table:
    """Return what each ingredient of a scene adds."""
    base = added["no contact"]
    return Table(
        "steps_ingredients",
        "What an ingredient adds to the step; a scene without it does not pay.",
        columns("scene", *TIME_COLUMNS, "added_s: added [us]"),
        [(name, *quartiles(t), float(np.median(t - base))) for name, t in added.items()],
    )


def picture(parts: dict[str, Times]) -> Picture:
    """Draw the parts of each scene's step as a bar, and the bare dynamics as a line."""
    with drawing(7.8, 0.62 * len(parts) + 1.15) as figure:
        axis = figure.subplots()
        rows = np.arange(len(parts))
        left = np.zeros(len(parts))
        for key, (label, color) in PARTS.items():
            widths = [max(float(np.median(times[key])) * 1e6, 0.0) for times in parts.values()]
            bars = axis.barh(
                rows, widths, 0.62, left=left, color=color, edgecolor=PAPER, label=label
            )
            texts = [f"{width:.2f}" if width > 0.2 else "" for width in widths]
            axis.bar_label(bars, texts, label_type="center", color=PAPER, fontsize=SMALL)
            left += widths
        axis.bar_label(bars, [f"{whole:.2f} us" for whole in left], padding=4, fontsize=SIZE)
        bare = float(np.median(next(iter(parts.values()))["aba"])) * 1e6
        axis.axvline(bare, color=INK, linewidth=1.0, linestyle=DASHED)
        axis.set_yticks(rows, list(parts))
        axis.invert_yaxis()
        axis.tick_params(axis="y", length=0)
        axis.spines["left"].set_visible(False)
        axis.set_xlabel("time of a step [us]; dashed: ABA and integrate alone")
        axis.margins(x=0.1)
        figure.legend(loc="outside upper center", ncols=len(PARTS), frameon=False, fontsize=SMALL)
        png = png_of(figure)
    return Picture(
        "steps",
        png,
        "Bars of the parts of a step for three scenes, and the time of the bare dynamics.",
        "Medians of the parts of a step; dashed: ABA and integrate alone.",
    )
