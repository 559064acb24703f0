"""Functions of the layers of pictures and files that a result offers as methods.

The package registers them in `base/upward.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene
    from sphshell_pin.view.recording import RecordingView


class UpperLayers:
    """Each property is a function, imported at its first use."""

    @property
    def plot_result(self) -> Callable[[Result, str, Scene | None], Figure]:
        """`Result.plot`."""
        from sphshell_pin.plot import plot_result

        return plot_result

    @property
    def save_figures(self) -> Callable[..., list[Path]]:
        """`Result.save_figures`."""
        from sphshell_pin.plot import save_figures

        return save_figures

    @property
    def view_result(self) -> Callable[..., RecordingView]:
        """`Result.view`."""
        from sphshell_pin.view.recording import view_result

        return view_result

    @property
    def render_film(self) -> Callable[..., Path]:
        """`Result.render`."""
        from sphshell_pin.view.film import render_film

        return render_film

    @property
    def write_mcap(self) -> Callable[..., Path]:
        """`Result.to_mcap`."""
        from sphshell_pin.export.mcap import write_mcap

        return write_mcap

    @property
    def rebuild_scene(self) -> Callable[[Result], Scene]:
        """Returns the scene of the scenario that a result came from."""
        from sphshell_pin.scenario.running.replay import Replay

        return lambda result: Replay(result).scene
