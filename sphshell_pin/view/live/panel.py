"""What the page's panel shows beside the scene: numbers, switches, and the points of charts."""

from __future__ import annotations

import json
import secrets
import threading
from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.checks import check_finite
from sphshell_pin.base.texts import plain
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view.arrows import FRICTION_COLOR, NORMAL_COLOR
from sphshell_pin.view.nodes import Json, css
from sphshell_pin.view.patches import RAMP as PRESSURE_RAMP

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.scene import ContactPair, SceneContacts
    from sphshell_pin.scenario.running.rows import Rows
    from sphshell_pin.view.live.charts import Point
    from sphshell_pin.view.live.player import Player

SLOWEST, FASTEST = 0.01, 10.0  # speeds that the page offers
STRIP_SECONDS = 6.0  # of the clock on the wall, that the strip shows at the speed of now

_PARAMETER = ("key", "label", "unit", "low", "high", "log", "value")
_COLORS = {"normal": NORMAL_COLOR, "friction": FRICTION_COLOR}


def check_speed(speed: float) -> float:
    """Return `speed`, which must be one that the page offers; raise InvalidParameter else."""
    value = check_finite("speed", speed)
    if not SLOWEST <= value <= FASTEST:
        raise InvalidParameter("speed", speed, f"must be from {SLOWEST:g} to {FASTEST:g}")
    return value


def greeting(player: Player, offer: Json) -> Json:
    """Return what does not change while `player` runs.

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
        "planned": player.planned,
        "speeds": [SLOWEST, FASTEST],
        "window": STRIP_SECONDS,
        "pressure_ramp": list(PRESSURE_RAMP),
        "colors": {name: css(color) for name, color in _COLORS.items()},
        **offer,
    }


MOST_ROWS = 1_500  # points of the charts; the page shows the last seconds
MOST_LISTED = 40  # contacts
DIGITS = 9  # of the numbers that a browser gets
RESTING_SPEED = 5e-6  # [m/s]: slower, and the list of contacts shows 0.00 mm/s


class Panel:
    """Numbers for the browsers, each published with a number of its own.

    One thread publishes, any thread reads with `news`.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._number = 0
        self._posts: dict[str, tuple[int, str]] = {}
        self._state = (0, "")
        self._cleared = 0
        self._keys = "[]"
        self._rows: deque[tuple[int, str]] = deque(maxlen=MOST_ROWS)

    def post(self, name: str, message: Json) -> None:
        """Publish a `message` that holds until the next one of that `name`.

        A browser gets those that are new to it in the order of their first publication.
        """
        text = dump(message)
        with self._lock:
            self._number += 1
            self._posts[name] = (self._number, text)

    def publish(
        self, state: Json, rows: list[Point], keys: Sequence[str] = (), *, clear: bool = False
    ) -> None:
        """Publish the `state` of now, and new `rows` of the curves `keys`.

        `clear` drops the old ones, which may be of other curves.
        """
        with self._lock:
            self._number += 1
            self._state = (self._number, dump({"type": "state", **state}))
            if clear:
                self._keys = dump(keys)
                self._rows.clear()
                self._cleared = self._number
            self._rows.extend((self._number, dump(row)) for row in rows)

    def news(self, since: int) -> tuple[int, list[str]]:
        """Return the last number, and the texts that lead there from number `since`."""
        with self._lock:
            texts = [text for number, text in self._posts.values() if number > since]
            clear = self._cleared > since
            rows = [text for number, text in self._rows if number > since]
            if rows or clear:
                cleared = "true" if clear else "false"
                texts.append(
                    f'{{"type":"rows","keys":{self._keys},"clear":{cleared},'
                    f'"rows":[{",".join(rows)}]}}'
                )
            if self._state[0] > since:
                texts.append(self._state[1])
            return self._number, texts


def list_contacts(contacts: SceneContacts, pairs: tuple[ContactPair, ...]) -> tuple[Json, ...]:
    """Return the contacts as the page lists them: depth [mm], forces [N], slip [mm/s]."""
    friction = np.linalg.norm(contacts.friction_force_world, axis=1)
    slip = np.linalg.norm(contacts.slip_velocity_world, axis=1)
    return tuple(
        {
            "pair": int(contacts.pair[k]),
            "depth": 1e3 * contacts.depth[k],
            "normal": contacts.normal_force[k],
            "friction": friction[k],
            "slip": 1e3 * slip[k],
            "motion": motion(
                pairs[int(contacts.pair[k])], float(slip[k]), float(contacts.normal_force[k])
            ),
        }
        for k in range(min(len(contacts), MOST_LISTED))
    )


def rows_now(player: Player) -> Rows:
    """Return the state of now as one row."""
    from sphshell_pin.scenario.running.rows import Rows

    now: Rows | None = getattr(player, "now", None)
    if now is not None:
        return now
    return Rows.of(np.array([player.time]), len(player.scene.pairs), player.contacts, 0)


def motion(pair: ContactPair, slip: float, normal_force: float = 0.0) -> str | None:
    """Return the word for a contact that slips at `slip` [m/s]; None without friction.

    "saddle" for one that takes off what two others push too much: its `normal_force` [N] is
    negative. "slip" from the friction's `sticking_speed` on. Below it "stick" where the friction
    has a state: a stretch then holds the contact in place. Else the force follows from the slip
    speed, so that a contact under load goes on moving: "creep", or "rest" where the page lists the
    speed as zero.
    """
    if normal_force < 0.0:
        return "saddle"
    friction = pair.friction
    if friction is None:
        return None
    if slip >= friction.sticking_speed:
        return "slip"
    if friction.has_state:
        return "stick"
    return "creep" if slip >= RESTING_SPEED else "rest"


def dump(value: object) -> str:
    """Return `value` as JSON; numbers keep DIGITS, and null stands for what is no number."""
    return json.dumps(plain(value, DIGITS), separators=(",", ":"), allow_nan=False)
