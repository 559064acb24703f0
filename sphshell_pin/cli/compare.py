"""The command compare: finished runs over each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.base.tables import column
from sphshell_pin.cli import common
from sphshell_pin.cli.export import file_of, with_scene

if TYPE_CHECKING:
    from sphshell_pin.study.compare import Difference

# Rows of each printed table.
MOST_ROWS = 24


@common.command()
def compare(runs: list[Path], *, out: Path = Path("results/compare"), picture: bool = True) -> None:
    """Lay finished runs over each other: figures and curves, with their differences from the first.

    Contacts and joints are matched by name. Curves are compared within the time that both runs
    have, as lines between their recorded rows. Printed is what differs; the tables have all.

    Example: sphshell-pin compare results/soft results/stiff

    Options
    -------
    runs : Two or more finished runs: run.npz or results folders.
    out : Folder of figures.csv, curves.csv and compare.png.
    picture : Draw compare.png.
    """
    from sphshell_pin.base.atomic.files import write_folder
    from sphshell_pin.base.tables import csv_text
    from sphshell_pin.plot.compare import plot_compare
    from sphshell_pin.plot.figure import png
    from sphshell_pin.study.compare import compare as compare_runs
    from sphshell_pin.study.compare import measured, tables_of

    labels = labels_of(runs)
    taken = [measured(label, *with_scene(run)) for label, run in zip(labels, runs, strict=True)]
    differences = compare_runs(taken)
    files = {
        f"{name}.csv": csv_text(table).encode() for name, table in tables_of(differences).items()
    }
    if picture:
        with common.if_installed():
            files["compare.png"] = png(plot_compare(taken, differences))
    written = write_folder(out, files, ("figures.csv", "curves.csv", "compare.png"))
    for other in differences:
        _print(labels[0], other)
    common.say(f"files in {out}: {', '.join(path.name for path in written)}")


def labels_of(runs: list[Path]) -> list[str]:
    """Return a short name for each run: its folder's or its file's, with a number if it repeats."""
    paths = [file_of(run).absolute() for run in runs]
    short = [one.parent.name if one.name == "run.npz" else one.stem for one in paths]
    return [one if short.count(one) == 1 else f"{one} ({k})" for k, one in enumerate(short, 1)]


def _print(first: str, other: Difference) -> None:
    """Print what of `other` is not as in the run `first`."""
    common.say(f" beside {first}", bold=other.label)
    both = first, other.label
    figures = [one for one in other.figures if not one.same]
    curves = sorted((one for one in other.curves if one.largest), key=lambda one: -one.of_range)
    whole: dict[str, tuple[tuple[str, ...], list[tuple[object, ...]]]] = {
        "setting": (both, [(key, "", *values) for key, *values in other.settings]),
        "figure": ((*both, "difference", "relative"), [*figures]),
        "curve": (("largest difference", "at [s]", "rms", "over range"), [*curves]),
    }
    for title, (titles, rows) in whole.items():
        cells = [
            (column(str(name), str(unit)), *map(_shown, values[: len(titles)]))
            for name, unit, *values in rows[:MOST_ROWS]
        ]
        common.print_table((title, *titles), cells)
        if len(rows) > MOST_ROWS:
            common.say(f"{len(rows) - MOST_ROWS} more {title}s differ")
    same = len(other.figures) - len(figures), len(other.curves) - len(curves)
    common.say(f"equal to the last bit: {same[0]} figures, {same[1]} curves")


def _shown(value: object) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    text = "-" if text in ("nan", "None") else text
    return text if len(text) <= 40 else f"{text[:37]}..."
