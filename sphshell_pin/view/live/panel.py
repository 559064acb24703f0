"""What the page's panel shows beside the scene: numbers, switches, and the strip of forces."""

from __future__ import annotations

import json
import math
import threading
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.view.nodes import FloatArray, Json

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene import ContactPair, SceneContacts
    from sphshell_pin.scenario.player import Rows
    from sphshell_pin.view.live.player import Player

StripRow = tuple[float, FloatArray, FloatArray]
"""Time [s], normal and friction forces (pairs,) [N]."""

MOST_ROWS = 1_500  # of the strip; the page shows the last seconds
MOST_LISTED = 40  # contacts


class Panel:
    """Numbers for the browsers, each published with a number of its own.

    One thread publishes, any thread reads with `news`.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._number = 0
        self._hello = (0, "")
        self._state = (0, "")
        self._cleared = 0
        self._rows: deque[tuple[int, str]] = deque(maxlen=MOST_ROWS)

    def greet(self, hello: Json) -> None:
        """Publish what does not change from frame to frame."""
        with self._lock:
            self._number += 1
            self._hello = (self._number, dump({"type": "hello", **hello}))

    def publish(self, state: Json, rows: list[StripRow], *, clear: bool = False) -> None:
        """Publish the `state` of now, and new `rows` of the strip; `clear` drops the old ones."""
        with self._lock:
            self._number += 1
            self._state = (self._number, dump({"type": "state", **state}))
            if clear:
                self._rows.clear()
                self._cleared = self._number
            self._rows.extend((self._number, dump(row)) for row in rows)

    def news(self, since: int) -> tuple[int, list[str]]:
        """Return the last number, and the texts that lead there from number `since`."""
        with self._lock:
            texts = []
            if self._hello[0] > since:
                texts.append(self._hello[1])
            clear = self._cleared > since
            rows = [text for number, text in self._rows if number > since]
            if rows or clear:
                cleared = "true" if clear else "false"
                texts.append(f'{{"type":"rows","clear":{cleared},"rows":[{",".join(rows)}]}}')
            if self._state[0] > since:
                texts.append(self._state[1])
            return self._number, texts


class Strip:
    """Thins the rows of a run to those that a strip chart can show.

    Of each piece of time the row with the largest force is kept, so that no peak is lost.
    """

    def __init__(self) -> None:
        self._spacing = 0.0
        self._row: StripRow | None = None
        self.clear()

    def add(self, rows: Rows, spacing: float) -> list[StripRow]:
        """Take `rows`, and return [t, normal forces, friction forces] of each finished piece.

        A piece is `spacing` [s] of simulated time long.
        """
        finished: list[StripRow] = []
        if not len(rows.t):
            return finished
        if spacing != self._spacing:
            self._piece, self._spacing = -math.inf, spacing
        total = np.abs(rows.normal_force).sum(axis=1) + rows.friction_force.sum(axis=1)
        total = np.where(np.isfinite(total), total, math.inf)
        piece = np.floor(rows.t / spacing)
        starts = np.flatnonzero(np.diff(piece, prepend=-math.inf))
        for start, end in zip(starts, [*starts[1:], len(piece)], strict=True):
            k = start + int(np.argmax(total[start:end]))
            if piece[start] != self._piece:
                finished += [] if self._row is None else [self._row]
                self._piece, self._largest = piece[start], -math.inf
            if total[k] > self._largest:
                self._largest = total[k]
                self._row = (float(rows.t[k]), rows.normal_force[k], rows.friction_force[k])
        return finished

    def clear(self) -> None:
        """Forget the piece that is not finished."""
        self._piece, self._largest = -math.inf, -math.inf
        self._row = None


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
            "motion": motion(pairs[int(contacts.pair[k])], float(slip[k])),
        }
        for k in range(min(len(contacts), MOST_LISTED))
    )


def rows_now(player: Player) -> Rows:
    """Return the state of now as one row."""
    from sphshell_pin.scenario.player import Rows

    return Rows.of(np.array([player.time]), len(player.scene.pairs), player.contacts, 0)


def motion(pair: ContactPair, slip: float) -> str | None:
    """Return the word for a contact that slips at `slip` [m/s]; None without friction.

    "slip" from the friction's `sticking_speed` on. Below it "stick" where the friction has a state:
    a stretch then holds the contact in place. Else "creep": the force follows from the slip speed,
    so that a contact under load goes on moving.
    """
    friction = pair.friction
    if friction is None:
        return None
    if slip >= friction.sticking_speed:
        return "slip"
    return "stick" if friction.has_state else "creep"


def dump(value: object) -> str:
    """Return `value` as JSON; numbers keep nine digits, and null stands for what is no number."""
    return json.dumps(_plain(value), separators=(",", ":"), allow_nan=False)


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, float):
        return float(f"{value:.9g}") if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value
