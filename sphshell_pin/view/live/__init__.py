"""The live page: a running scene to look at, with its parameters to change and bodies to push."""

from sphshell_pin.view.live.loop import Live
from sphshell_pin.view.live.opening import preview
from sphshell_pin.view.live.player import Interactive, Player

__all__ = ["Interactive", "Live", "Player", "preview"]
