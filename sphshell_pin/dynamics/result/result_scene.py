"""What a result is shown with: the scene in which it moved, and its rows of finite numbers."""

import numpy as np

from sphshell_pin.base import upward
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter, ResultError


def find_scene(result: Result, scene: Scene | None = None) -> Scene | None:
    """Return `scene`, or the one that ran, or that of the scenario that `result` came from.

    None if there is none of them. Raises ResultError if the scenario's cannot be built again,
    InvalidParameter if `scene` is none.
    """
    scene = result.scene if scene is None else scene
    if scene is None and result.origin is not None:
        scene = upward.layers.rebuild_scene(result)
    if scene is not None and not isinstance(getattr(scene, "pairs", None), tuple):
        raise InvalidParameter("scene", scene, "must be a Scene")
    return scene


def scene_of(result: Result, scene: Scene | None = None) -> Scene:
    """Return what `find_scene` finds; ResultError where that is None."""
    found = find_scene(result, scene)
    if found is None:
        raise ResultError("the result", "has no scene, as it was loaded: give scene=...")
    return found


def check_scene(result: Result, scene: Scene, name: str) -> None:
    """Raise ResultError, about `name`, where `scene` has other coordinates or contacts."""
    ran, now = (result.q.shape[1], result.v.shape[1]), (scene.model.nq, scene.model.nv)
    if ran != now:
        raise ResultError(
            name,
            f"its model had nq = {ran[0]}, nv = {ran[1]}, that of the scene has nq = {now[0]}, "
            f"nv = {now[1]}: the robot or its locked joints have changed since",
        )
    pairs = tuple(pair.name for pair in scene.pairs)
    if pairs != tuple(result.pairs):
        raise ResultError(
            name,
            f"its contacts were {', '.join(result.pairs) or 'none'}, the scene has "
            f"{', '.join(pairs) or 'none'}: it is another one, or has changed since",
        )


def sound_rows(name: str, *states: Array, limit: float = np.inf) -> int:
    """Return how many rows of `states`, (n, k) each, there are up to where their numbers end.

    That is where a run diverged: a number is not finite, or its size not below `limit`. Raises
    ResultError, about `name`, if there is no row.
    """
    sound = np.all(np.abs(np.hstack(states)) < limit, axis=1)
    count = len(sound) if sound.all() else int(np.argmin(sound))
    if not count:
        raise ResultError(name, "has no row of finite numbers")
    return count
