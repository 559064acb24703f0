"""An empty figure, and what every picture shares."""

from __future__ import annotations

import io
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from sphshell_pin.atomic import atomic_file
from sphshell_pin.errors import MissingExtra, ResultError

NO_CONTACT = "No contact in this run."
RESOLUTION = 130  # dots per inch of the files


def new_figure(
    width: float, height: float, layout: Literal["constrained", "compressed"] = "constrained"
) -> Any:
    """Return an empty Figure of `width` by `height` inches, made without pyplot.

    Raises MissingExtra without matplotlib.
    """
    try:
        import_module("matplotlib.figure")
    except ImportError as missing:
        raise MissingExtra("matplotlib", "view", "a figure") from missing
    from sphshell_pin.plot.shown import ShownFigure

    return ShownFigure(figsize=(width, height), layout=layout)


def write_figure(path: str | PathLike[str], figure: Any) -> Path:
    """Write `figure` as a .png file, whole or not at all; ResultError if it cannot be written."""
    path, picture = Path(path), io.BytesIO()
    figure.savefig(picture, format="png", dpi=RESOLUTION)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(path) as file:
            file.write(picture.getbuffer())
    except OSError as fault:
        raise ResultError(path, f"cannot be written ({fault.strerror})") from fault
    return path


def say(axis: Any, sentence: str) -> None:
    """Write `sentence` in the middle of an empty `axis`."""
    axis.text(
        0.5, 0.5, sentence, transform=axis.transAxes, ha="center", va="center", color="#555555"
    )
    axis.set_yticks([])


def count(number: int, one: str, many: str) -> str:
    """Return `number` with the word for one or for many."""
    return f"{number} {one if number == 1 else many}"
