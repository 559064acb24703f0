"""The first message to a browser: what there is to see, to change and to push."""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING

from sphshell_pin.base.checks import check_finite
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view.arrows import FRICTION_COLOR, NORMAL_COLOR
from sphshell_pin.view.distance import RAMP
from sphshell_pin.view.live.picture import CONE_COLOR
from sphshell_pin.view.nodes import Json, css
from sphshell_pin.view.patches import RAMP as PRESSURE_RAMP

if TYPE_CHECKING:
    from sphshell_pin.view.live.player import Player

SLOWEST, FASTEST = 0.01, 10.0  # speeds that the page offers
STRIP_SECONDS = 6.0  # of the clock on the wall, that the strip shows at the speed of now

_PARAMETER = ("key", "label", "unit", "low", "high", "log", "value")
_COLORS = {"normal": NORMAL_COLOR, "friction": FRICTION_COLOR, "cone": CONE_COLOR}


def check_speed(speed: float) -> float:
    """Return `speed`, which must be one that the page offers; raise InvalidParameter else."""
    value = check_finite("speed", speed)
    if not SLOWEST <= value <= FASTEST:
        raise InvalidParameter("speed", speed, f"must be from {SLOWEST:g} to {FASTEST:g}")
    return value


def greeting(player: Player, picture: str | None, offer: Json) -> Json:
    """Return what does not change while `player` runs; `picture` is the page of the scene, if any.

    `offer` is what there is to do with the mouse. The "session" differs from one run to the next on
    the same port.
    """
    return {
        "session": secrets.token_hex(8),
        "title": player.title,
        "pairs": [pair.name for pair in player.scene.pairs],
        "bodies": list(player.bodies),
        "parameters": [
            {name: getattr(one, name) for name in _PARAMETER}
            | {"restart": bool(getattr(one, "restart", False))}
            | {"choices": list(getattr(one, "choices", ()))}
            for one in player.parameters
        ],
        "start": player.start,
        "duration": player.duration,
        "planned": player.planned,
        "speeds": [SLOWEST, FASTEST],
        "window": STRIP_SECONDS,
        "picture": picture,
        "ramp": list(RAMP),
        "pressure_ramp": list(PRESSURE_RAMP),
        "colors": {name: css(color) for name, color in _COLORS.items()},
        **offer,
    }
