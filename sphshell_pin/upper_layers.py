"""Functions of the layers of pictures and files that a result offers as methods.

The package registers them in `base/upward.py`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene
    from sphshell_pin.view.recording import RecordingView


class UpperLayers:
    """Each method imports what it calls when it is called."""

    def plot_result(self, result: Result, kind: str, scene: Scene | None) -> Figure:
        """`Result.plot`."""
        from sphshell_pin.plot import plot_result

        return plot_result(result, kind, scene)

    def save_figures(self, *arguments: Any) -> list[Path]:
        """`Result.save_figures`."""
        from sphshell_pin.plot import save_figures

        return save_figures(*arguments)

    def view_result(self, *arguments: Any, **options: Any) -> RecordingView:
        """`Result.view`."""
        from sphshell_pin.view.recording import view_result

        return view_result(*arguments, **options)

    def render_film(self, *arguments: Any, **options: Any) -> Path:
        """`Result.render`."""
        from sphshell_pin.view.film import render_film

        return render_film(*arguments, **options)

    def write_mcap(self, *arguments: Any, **options: Any) -> Path:
        """`Result.to_mcap`."""
        from sphshell_pin.export.mcap import write_mcap

        return write_mcap(*arguments, **options)

    def rebuild_scene(self, result: Result) -> Scene:
        """Return the scene of the scenario that a result came from."""
        from sphshell_pin.scenario.running.replay import Replay

        return Replay(result).scene
