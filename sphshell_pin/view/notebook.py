"""A recording as the value of a notebook's cell."""

from __future__ import annotations

import html
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sphshell_pin.errors import InvalidParameter, ResultError
from sphshell_pin.view.recording import render_recording, write_page

if TYPE_CHECKING:
    from os import PathLike

    from sphshell_pin.dynamics.result import Result
    from sphshell_pin.dynamics.scene import Scene


@dataclass(frozen=True)
class RecordingView:
    """A recording: `page`, a whole HTML page, to be shown `height` [pixels] high."""

    page: str
    height: int = 480

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the page at `path` and return it; ResultError if it cannot be written."""
        return write_page(path, self.page)

    def __repr__(self) -> str:
        return f"RecordingView({len(self.page) / 1e6:.1f} MB; .save(path) writes the page)"

    def _repr_html_(self) -> str:
        """Return a frame with the page inside, which needs no server and no network."""
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" width="100%" height="{self.height}" '
            'style="border: 1px solid #c8d0d8; border-radius: 4px" allowfullscreen></iframe>'
        )


def view_result(
    result: Result,
    scene: Scene | None = None,
    visual_model: Any = None,
    *,
    speed: float | None = None,
    height: int = 480,
) -> RecordingView:
    """Return the recording of `result`: see `Result.view`."""
    if isinstance(height, bool) or not isinstance(height, int) or height <= 0:
        raise InvalidParameter("height", height, "must be a positive number of pixels")
    title = "A finished run"
    if scene is None and result.origin is not None:
        from sphshell_pin.scenario.replay import Replay

        replay = Replay(result)
        scene, title = replay.scene, replay.title
        visual_model = replay.visual_model if visual_model is None else visual_model
        speed = replay.speed if speed is None else speed
    scene = result.scene if scene is None else scene
    if scene is None:
        raise ResultError("the result", "has no scene to be drawn in: give view(scene=...)")
    page = render_recording(
        result, scene, visual_model, speed=1.0 if speed is None else speed, title=title
    )
    return RecordingView(page, height)
