"""One HTML file with a meshcat scene and its animation, without external requests."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import re
import struct
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.regular_file import read_text
from sphshell_pin.view.meshes import pack_facets, take_out_numbers
from sphshell_pin.view.nodes import HIDDEN_SCALE, Json, Sent, is_below, typed_array, viewer_script

if TYPE_CHECKING:
    from meshcat import Visualizer

PARTS = Path(__file__).with_name("recording_page")
STYLES = ("../live/page/palette.css", "style.css")
SHARED = tuple(f"../live/page/{one}.js" for one in ("events", "theme", "axes", "pane", "keys"))
SCRIPTS = ("replay.js", *SHARED, "cameras.js", "chart.js", "panel.js")
# A mesh file this long may well be used by several links: it is stored once.
SHARED_TEXT = 20_000


class FilmWindow:
    """Stands in for meshcat's window: keeps the scene, and films transforms instead of sending.

    While `frame` is None a transform is part of the still scene; else it is the pose of its node
    in that frame.
    """

    def __init__(self) -> None:
        self.frame: int | None = None
        self._commands: dict[tuple[str, str, str], Json] = {}
        self._texts: dict[str, Json] = {}
        self._frames: dict[str, dict[int, list[float]]] = {}
        self._switches: dict[str, tuple[Array, list[bool]]] = {}

    def send(self, command: Sent) -> None:
        """Take one meshcat command."""
        data = command.lower()
        kind, path = data["type"], data["path"]
        if kind == "set_transform" and self.frame is not None:
            self._frames.setdefault(path, {})[self.frame] = data["matrix"]
            return
        if kind == "delete":
            kept = {key: one for key, one in self._commands.items() if not is_below(key[1], path)}
            self._commands = kept
            return
        if kind == "set_object":
            data = self._share(data)
        # An object that replaces another comes first again, before its properties.
        self._commands[kind, path, data.get("property", "")] = data

    def switch(self, visualizer: Visualizer, times: Array, visible: list[bool]) -> None:
        """Show or hide the visualizer's node from each of `times` (k,) [s of the page] on."""
        self._switches[visualizer.path.lower()] = (times, visible)

    def _share(self, data: Json) -> Json:
        from umsgpack import Ext

        def shared(value: object) -> object:
            if isinstance(value, dict):
                return {key: shared(item) for key, item in value.items()}
            if isinstance(value, list):
                return [shared(item) for item in value]
            if isinstance(value, str) and len(value) > SHARED_TEXT:
                name = hashlib.sha256(value.encode()).hexdigest()[:16]
                if name not in self._texts:
                    text, numbers = take_out_numbers(value)
                    stored = {"type": "text", "name": name, "text": text, "numbers": numbers}
                    self._texts[name] = stored
                return {"$text": name}
            if isinstance(value, Ext) and len(value.data) > SHARED_TEXT:
                name = hashlib.sha256(value.data).hexdigest()[:16]
                facets = None if name in self._texts else pack_facets(value.data)
                if facets is not None:
                    self._texts[name] = {"type": "text", "name": name, "facets": facets}
                return {"$text": name} if name in self._texts else value
            return value

        return {key: shared(item) for key, item in data.items()}

    def commands(self, times: Array) -> list[Json]:
        """Return every command of the page; frame k is shown at `times[k]` [s of the page]."""
        moving: list[Json] = []
        stills: list[Json] = []
        for path, frames in self._frames.items():
            matrices = np.array([frames[frame] for frame in sorted(frames)])
            matrices = matrices.reshape(-1, 4, 4).transpose(0, 2, 1)
            still = matrices[0].T.reshape(-1).tolist()
            stills.append({"type": "set_transform", "path": path, "matrix": still})
            tracks = _pose_tracks(times[sorted(frames)], matrices)
            if tracks:
                moving.append(_clip(path, tracks, times))
        for path, (instants, visible) in self._switches.items():
            track = {"type": "bool", "times": instants.tolist(), "values": visible}
            moving.append(_clip(path, [{"name": ".visible", **track}], times))
        kinds = ("set_object", "set_transform", "set_property", "set_target")
        scene = sorted(self._commands.values(), key=lambda data: kinds.index(data["type"]))
        # The clips are loaded at rest; the page starts them once it has drawn the first frame.
        animation = {
            "type": "set_animation",
            "path": "",
            "animations": moving,
            "options": {"play": False, "repetitions": 1},
        }
        return [*self._texts.values(), *scene, *stills, *([animation] if moving else [])]


def _clip(path: str, tracks: list[Json], times: Array) -> Json:
    duration = max(float(times[-1]), 1e-3)
    clip = {"name": "default", "fps": 1, "duration": duration, "tracks": tracks}
    return {"path": path, "clip": clip}


def _pose_tracks(times: Array, matrices: Array) -> list[Json]:
    """Split `matrices` (n, 4, 4) into position, quaternion and scale tracks, those that change."""
    scale = np.linalg.norm(matrices[:, :3, :3], axis=1)
    # A mirror goes into x, as three.js has it when it decomposes a matrix.
    scale[np.linalg.det(matrices[:, :3, :3]) < 0.0, 0] *= -1.0
    quaternion = np.array(
        [
            pin.Quaternion(matrix[:3, :3] / size[None, :]).coeffs()
            for matrix, size in zip(matrices, scale, strict=True)
        ]
    )
    flips = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0.0
    quaternion[1:][np.cumsum(flips) % 2 == 1] *= -1.0
    position = matrices[:, :3, 3].copy()
    hidden = np.abs(scale).max(axis=1) <= 1.5 * HIDDEN_SCALE
    # A node that appears grows where it will be, instead of flying in from where it last was.
    appears = np.flatnonzero(hidden[:-1] & ~hidden[1:])
    position[appears], quaternion[appears] = position[appears + 1], quaternion[appears + 1]
    tracks = []
    for name, kind, values in (
        ("position", "vector3", position),
        ("quaternion", "quaternion", quaternion),
        ("scale", "vector3", scale),
    ):
        step = np.abs(np.diff(values, axis=0)).max(axis=1, initial=0.0)
        if np.ptp(values, axis=0).max(initial=0.0) <= 1e-9:
            continue
        # Keys within a standstill are not needed.
        moves = step > 1e-9
        kept = np.ones(len(values), dtype=bool)
        kept[1:-1] = moves[:-1] | moves[1:]
        at, to = (typed_array(one)["array"] for one in (times[kept], values[kept].reshape(-1)))
        tracks.append({"name": f".{name}", "type": kind, "times": at, "values": to})
    return tracks


def render_page(commands: list[Json], title: str, legend: list[tuple[str, str]]) -> str:
    """Return the HTML of a page that replays `commands`.

    `legend` holds (color, sentence) pairs.
    """
    import umsgpack

    packed = bytearray()
    for command in commands:
        data = umsgpack.packb(command)
        packed += struct.pack("<I", len(data)) + data
    rows = "".join(
        f'<div><span class="swatch" style="background:{html.escape(color)}"></span>'
        f"{html.escape(text)}</div>"
        for color, text in legend
    )
    parts = {
        "title": html.escape(title),
        "legend": rows,
        "style": _joined(STYLES),
        "script": re.sub(r"^import .*\n", "", _joined(SCRIPTS), flags=re.MULTILINE),
        "viewer": _compressed(viewer_script().read_bytes()),
        "scene": _compressed(bytes(packed)),
        "licenses": html.escape(_licenses()).replace("--", "- -"),
    }
    page = (PARTS / "page.html").read_text(encoding="utf-8")
    pieces = page.split("@@")
    return "".join(parts[piece] if index % 2 else piece for index, piece in enumerate(pieces))


@cache
def _licenses() -> str:
    """Return the notices of the viewer and of what is built into it, such as three.js."""
    script = viewer_script()
    texts = [f"meshcat\n\n{read_text(script.parent.parent / 'LICENSE')}"]
    for one in json.loads(read_text(script.with_name(f"{script.name}.THIRD_PARTY_LICENSES.json"))):
        head = f"{one['name']} {one['version']}, {one['author']}, license {one['license']}"
        texts.append(f"{head}\n\n{one['licenseText'] or ''}")
    return "\n\n".join(texts)


def _joined(names: tuple[str, ...]) -> str:
    return "".join((PARTS / name).read_text(encoding="utf-8") for name in names)


def _compressed(data: bytes) -> str:
    return base64.b64encode(gzip.compress(data, compresslevel=9, mtime=0)).decode()
