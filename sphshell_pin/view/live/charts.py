"""The curves of the page's charts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import NameNotFound
from sphshell_pin.view.nodes import Json

if TYPE_CHECKING:
    from sphshell_pin.scenario.running.rows import Rows, Series
    from sphshell_pin.view.live.player import Player

Point = list[float]
"""Time [s] and the value of each curve there."""

MOST_KEPT = 40_000  # rows of a run in memory: at 5 ms, those of 200 s
MOST_PIECES = 100  # in which they are: joining copies all


class History:
    """The rows of a run, the newest ones of them, as they were recorded."""

    def __init__(self) -> None:
        self._pieces: list[Rows] = []

    def add(self, rows: Rows) -> None:
        """Keep `rows`, which follow the others."""
        if len(rows):
            self._pieces.append(rows)
        if len(self._pieces) > MOST_PIECES:
            self._join()

    def since(self, t: float) -> Rows | None:
        """Return the rows from time `t` [s] on; None where there are none."""
        if not self._pieces:
            return None
        rows = self._join()
        first = int(np.searchsorted(rows.t, t))
        return rows.select(slice(first, None)) if first < len(rows) else None

    def _join(self) -> Rows:
        rows = self._pieces[0].joined(self._pieces).select(slice(-MOST_KEPT, None))
        self._pieces = [rows]
        return rows


class Thinner:
    """Thins curves to the points that a chart can show.

    Of each piece of time every curve keeps its value of largest size, so that no peak is lost; the
    point stands at the piece's last row.
    """

    def __init__(self) -> None:
        self._piece, self._time, self._spacing = -math.inf, 0.0, 0.0
        self._values: Array | None = None

    def add(self, t: Array, values: Array, spacing: float) -> list[Point]:
        """Take rows at `t` (n,) [s] of `values` (n, k); return the points of finished pieces.

        A piece is `spacing` [s] long.
        """
        finished: list[Point] = []
        if not len(t):
            return finished
        if spacing != self._spacing:
            finished += self.end()
            self._piece, self._spacing = -math.inf, spacing
        piece = np.floor(t / spacing)
        starts = np.flatnonzero(np.diff(piece, prepend=-math.inf))
        for start, end in zip(starts, [*starts[1:], len(piece)], strict=True):
            # What is no number, as of a run that diverges, is a peak, too.
            size = np.abs(values[start:end])
            rows = np.where(np.isnan(size), math.inf, size).argmax(axis=0)
            largest = values[start:end][rows, np.arange(values.shape[1])]
            if piece[start] == self._piece and self._values is not None:
                kept = ~(np.abs(largest) > np.abs(self._values)) & ~np.isnan(largest)
                largest = np.where(kept, self._values, largest)
            else:
                finished += self.end()
            self._piece, self._time, self._values = piece[start], float(t[end - 1]), largest
        return finished

    def end(self) -> list[Point]:
        """Return the point of the piece under way, if there is one."""
        if self._values is None:
            return []
        point = [self._time, *map(float, self._values)]
        self._values = None
        return [point]

    def clear(self) -> None:
        """Forget the piece that is not finished."""
        self._piece, self._values = -math.inf, None


class Charts:
    """What the browsers' charts show of `player`: only what one of them asks for is computed.

    Used by one thread. `keys` are the curves that are sent.
    """

    def __init__(self, player: Player) -> None:
        from sphshell_pin.scenario.running.rows import force_series  # loads pydantic

        own: Sequence[Series] | None = getattr(player, "series", None)
        self.series = {
            one.key: one for one in own or force_series([pair.name for pair in player.scene.pairs])
        }
        self.keys: tuple[str, ...] = ()
        self._asked: dict[object, tuple[str, ...]] = {}
        self._history = History()
        self._thinner = Thinner()

    @property
    def sources(self) -> frozenset[str]:
        """The blocks of Rows that the curves follow from."""
        return frozenset(self.series[key].source for key in self.keys)

    def descriptions(self) -> list[Json]:
        """Return what a page needs to know of each curve to offer it."""
        names = ("key", "quantity", "name", "unit", "color", "from_zero")
        return [{name: getattr(one, name) for name in names} for one in self.series.values()]

    def ask(self, client: object, keys: Iterable[str]) -> bool:
        """Note which curves `client` shows; return whether others than before are sent now.

        Raises NameNotFound for one that there is not.
        """
        wanted = tuple(dict.fromkeys(keys))
        for key in wanted:
            if key not in self.series:
                raise NameNotFound("curve", key, "this run", list(self.series))
        self._asked[client] = wanted
        return self._choose()

    def forget(self, client: object) -> bool:
        """Forget a browser that has gone; return whether fewer curves are sent now."""
        self._asked.pop(client, None)
        return self._choose()

    def _choose(self) -> bool:
        shown = {key for keys in self._asked.values() for key in keys}
        keys = tuple(key for key in self.series if key in shown)
        changed = keys != self.keys
        self.keys = keys
        return changed

    def add(self, rows: Rows, spacing: float) -> list[Point]:
        """Take new rows of the run; return the points that they finish, `spacing` [s] apart."""
        self._history.add(rows)
        return self._thinner.add(rows.t, self._values(rows), spacing)

    def again(self, since: float, spacing: float) -> list[Point]:
        """Return the points of the run from time `since` [s] on, `spacing` [s] apart."""
        self._thinner.clear()
        rows = self._history.since(since)
        return [] if rows is None else self._thinner.add(rows.t, self._values(rows), spacing)

    def clear(self) -> None:
        """Forget the rows of the run, as where it goes on at another time."""
        self._history = History()
        self._thinner.clear()

    def _values(self, rows: Rows) -> Array:
        values = np.empty((len(rows), len(self.keys)))
        for k, key in enumerate(self.keys):
            values[:, k] = self.series[key].values(rows)
        return values
