"""The scene that a figure is drawn in."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result import Result
    from sphshell_pin.dynamics.scene import Scene


def scene_of(result: Result, scene: Scene | None = None) -> Scene | None:
    """Return `scene`, or the one that ran, or that of the scenario that `result` came from.

    None if there is none of them; ResultError if the scenario cannot be built again.
    """
    scene = result.scene if scene is None else scene
    if scene is not None or result.origin is None:
        return scene
    from sphshell_pin.scenario.replay import Replay

    return Replay(result).scene
