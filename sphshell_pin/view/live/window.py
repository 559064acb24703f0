"""The scene as browsers are to see it: what is drawn, where it is, and since when.

There is no queue between the simulation and a browser. Everything has the number of the frame in
which it last changed, and each browser is given what changed since the frame it saw last: a slow
one skips frames, a late one starts at frame zero and gets the whole scene.
"""

import threading

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.view.nodes import Json, Move, Sent, is_below

_FIRST_ROWS = 64


class LiveWindow:
    """Stands in for meshcat's window: `meshcat.Visualizer(window=LiveWindow())` draws into it.

    One thread draws and then calls `commit`; any thread reads with `news`.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frame = 0
        self._commands: dict[tuple[str, str, str], tuple[int, bytes]] = {}
        self._row_of: dict[str, int] = {}
        self._free: list[int] = []
        # One row a node: the matrix drawn now, the one committed, the frame of its last change.
        self._drawn = np.zeros((_FIRST_ROWS, 16), dtype=np.float32)
        self._matrices = self._drawn.copy()
        self._changed = np.zeros(_FIRST_ROWS, dtype=np.int64)
        self._paths: list[str] = []

    @property
    def frame(self) -> int:
        """Number of the last committed frame; 0 before the first."""
        return self._frame

    def send(self, command: Sent) -> None:
        """Take one meshcat command; it belongs to the frame that `commit` closes."""
        import umsgpack

        data: Json = command.lower()
        kind, path = data["type"], data.get("path", "")
        if kind == "set_transform":
            self._place(path, data["matrix"])
            return
        with self._lock:
            if kind == "delete":
                self._forget(path)
            key = (kind, path, data.get("property", ""))
            # What comes later is replayed later: an object first, then its properties.
            self._commands.pop(key, None)
            self._commands[key] = (self._frame + 1, umsgpack.packb(data))

    def mover(self, path: str) -> Move:
        """Return a routine that places the node at `path` without a command for each matrix."""
        return lambda matrix: self._place(path, matrix.T.reshape(16))

    def matrix(self, path: str) -> Array | None:
        """Return where the node at `path` was last placed (4, 4); None if it was not."""
        row = self._row_of.get(path)
        return None if row is None else self._drawn[row].reshape(4, 4).T.astype(float)

    def commit(self) -> int:
        """Close the frame, and return its number."""
        with self._lock:
            self._frame += 1
            differs = (self._drawn != self._matrices).any(axis=1)
            self._matrices[differs] = self._drawn[differs]
            self._changed[differs] = self._frame
            return self._frame

    def news(self, since: int) -> tuple[int, bytes | None]:
        """Return the last frame's number, and as one message what changed after frame `since`.

        The message is a msgpack list of meshcat commands, and of one "move" that holds many
        transforms: {"type": "move", "paths": [...], "matrices": float32 (n, 16) column by column}.
        None if nothing changed.
        """
        import umsgpack

        with self._lock:
            frame = self._frame
            if since >= frame:
                return frame, None
            messages = []
            for number, data in reversed(self._commands.values()):
                if number <= since:
                    break
                if number <= frame:
                    messages.append(data)
            messages.reverse()
            rows = np.flatnonzero(self._changed > since)
            if rows.size:
                move = {
                    "type": "move",
                    "paths": [self._paths[row] for row in rows],
                    "matrices": umsgpack.Ext(0x17, self._matrices[rows].tobytes()),
                }
                messages.append(umsgpack.packb(move))
        if not messages:
            return frame, None
        return frame, b"\xdd" + len(messages).to_bytes(4, "big") + b"".join(messages)

    def _place(self, path: str, matrix: Array | list[float]) -> None:
        """Place the node at `path` at `matrix` (16,), column by column."""
        row = self._row_of.get(path)
        if row is None:
            row = self._add(path)  # before self._drawn is looked up, which it may replace
        self._drawn[row] = matrix

    def _add(self, path: str) -> int:
        with self._lock:
            if self._free:
                row = self._free.pop()
                self._paths[row] = path
            else:
                row = len(self._paths)
                self._paths.append(path)
                if row == len(self._drawn):
                    self._drawn = np.vstack((self._drawn, np.zeros_like(self._drawn)))
                    self._matrices = np.vstack((self._matrices, np.zeros_like(self._matrices)))
                    self._changed = np.append(self._changed, np.zeros_like(self._changed))
            self._row_of[path] = row
        return row

    def _forget(self, path: str) -> None:
        """Drop the node at `path` and all below it."""
        for key in [key for key in self._commands if is_below(key[1], path)]:
            del self._commands[key]
        for one in [one for one in self._row_of if is_below(one, path)]:
            row = self._row_of.pop(one)
            self._drawn[row] = self._matrices[row] = 0.0
            self._changed[row] = 0
            self._free.append(row)
