"""The command taxels: tactile images of a finished run."""

import math
from pathlib import Path

from sphshell_pin.cli.common import command, echo, if_installed
from sphshell_pin.cli.export import file_of

SHOWN = 5
"""Rows in the picture."""


@command()
def taxels(
    run: Path,
    *,
    contact: str,
    shape: tuple[int, int] = (16, 16),
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0),
    up: tuple[float, float, float] | None = None,
    extent_deg: tuple[float, float] = (90.0, 90.0),
    out: Path | None = None,
) -> None:
    """Write what a grid of tactile sensors on a sphere felt: taxels.npz, and a picture.

    The run must have recorded patches (record in its table run).

    Example: sphshell-pin taxels results/polished_valve --contact tool --axis 0 0 1

    Options
    -------
    contact : Contact whose sphere has the taxels.
    shape : Numbers of taxels: rows and columns.
    axis : From the sphere's center to the middle of the grid, in its frame.
    up : Direction of the columns, in the same frame; by default any.
    extent_deg : Angles over which rows and columns reach.
    out : Folder to write into; by default that of the run.
    """
    from sphshell_pin.patches import TaxelGrid
    from sphshell_pin.plot.figure import write_figure
    from sphshell_pin.plot.taxels import plot_taxels
    from sphshell_pin.scenario.running.replay import Replay

    height, width = map(math.radians, extent_deg)
    grid = TaxelGrid(contact, shape, axis=axis, up=up, extent=(height, width))
    file = file_of(run)
    replay = Replay(file)
    images = grid.images(replay.result, replay.scene)
    folder = file.parent if out is None else out
    folder.mkdir(parents=True, exist_ok=True)
    echo(images.save(folder / "taxels.npz"))
    with if_installed():
        rows = [k * (len(images.t) - 1) // (SHOWN - 1) for k in range(SHOWN)]
        echo(write_figure(folder / "taxels.png", plot_taxels(images, rows)))
    felt, missed = float(images.forces.max()), float(abs(images.outside).max())
    echo(f"most on a taxel: {felt:.4g} N; beside the grid: {missed:.4g} N at most")
