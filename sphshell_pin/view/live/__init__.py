"""The live page: a scene that keeps running while one looks at it, pushes it, turns its knobs."""

from sphshell_pin.view.live.loop import Live
from sphshell_pin.view.live.opening import preview
from sphshell_pin.view.live.player import Player

__all__ = ["Live", "Player", "preview"]
