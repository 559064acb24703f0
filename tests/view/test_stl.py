"""STL files of robots, packed and restored."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np
import pytest
import umsgpack

import sphshell_pin.view.page as page_module
from sphshell_pin.view.collada import LEVELS
from sphshell_pin.view.nodes import Command
from sphshell_pin.view.page import FilmWindow
from sphshell_pin.view.stl import pack_facets
from tests.view.test_collada import restored
from tests.view.test_recording_in_browser import browser  # noqa: F401


def ball(rings=24):
    """Corners (f, 3, 3) of a ball of radius 0.2 about (1, 2, 3)."""
    u, v = np.meshgrid(np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, rings))
    points = np.stack((np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)), axis=-1)
    points = (0.2 * points + [1.0, 2.0, 3.0]).astype(np.float32)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    facets = [np.stack(one, axis=2).reshape(-1, 3, 3) for one in ((a, b, c), (a, c, d))]
    return np.concatenate(facets)


def stl(corners, title=b""):
    """A binary STL file of these facets, written field by field."""
    parts = [title.ljust(80, b" "), len(corners).to_bytes(4, "little")]
    for facet in corners:
        normal = np.cross(facet[1] - facet[0], facet[2] - facet[0])
        normal /= np.linalg.norm(normal) or 1.0
        parts += [np.vstack((normal, facet)).astype("<f4").tobytes(), b"\0\0"]
    return b"".join(parts)


@pytest.mark.parametrize("title", [b"", b"COLOR=abc"])
def test_facets_keep_their_corners(title):
    corners = ball()
    data = stl(corners, title)
    packed = pack_facets(data)
    points = restored(packed["points"]).reshape(-1, 3)
    again = points[restored(packed["corners"]).astype(int)].reshape(-1, 3, 3)
    assert np.abs(again - corners).max() <= 0.51 * np.ptp(corners) / LEVELS + 1e-7
    assert len(points) == len(np.unique(corners.reshape(-1, 3), axis=0))
    assert len(gzip.compress(umsgpack.packb(packed))) < 0.5 * len(gzip.compress(data))


def test_what_is_no_binary_stl_is_left_alone():
    data = stl(ball(5))
    for other in (b"", data[:-1], data + b"\0", b"solid ascii\nfacet normal 0 0 1\n" * 50):
        assert pack_facets(other) is None
    assert pack_facets(data.replace(data[96:100], np.float32(np.nan).tobytes(), 1)) is None


def test_a_file_of_several_links_is_stored_once():
    window = FilmWindow()
    data = umsgpack.Ext(0x12, stl(ball(30)))
    other = umsgpack.Ext(0x12, bytes(30_000))
    for name, file in (("left", data), ("right", data), ("other", other)):
        command = {"type": "set_object", "path": f"/{name}", "object": {"geometries": [file]}}
        window.send(Command(command))
    commands = window.commands(np.zeros(1))
    assert len([c for c in commands if c["type"] == "text"]) == 1
    files = {c["path"]: c["object"]["geometries"][0] for c in commands if c["type"] == "set_object"}
    assert files["/left"] == files["/right"] == {"$text": commands[0]["name"]}
    assert files["/other"] is other


@pytest.mark.slow
@pytest.mark.browser
def test_the_page_restores_the_file(browser):  # noqa: F811
    source = Path(page_module.__file__).with_name("recording.html").read_text(encoding="utf-8")
    functions = re.search(r"^function unfold.*?^function restore_facets.*?^}$", source, re.S | re.M)
    corners = ball(8)
    packed = {k: {**v, "bytes": list(v["bytes"])} for k, v in pack_facets(stl(corners)).items()}
    page = browser.new_page()
    script = f"facets => {{ {functions[0]}\nreturn Array.from(restore_facets(facets)); }}"
    again = bytes(page.evaluate(script, packed))
    page.close()
    assert len(again) == len(stl(corners))
    facets = np.frombuffer(again[84:], np.dtype([("f", "<f4", (4, 3)), ("a", "<u2")]))["f"]
    np.testing.assert_allclose(facets[:, 1:], corners, atol=0.52 * np.ptp(corners) / LEVELS)
    given = np.frombuffer(stl(corners)[84:], np.dtype([("f", "<f4", (4, 3)), ("a", "<u2")]))["f"]
    large = (
        np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        > 1e-4
    )
    np.testing.assert_allclose(facets[large, 0], given[large, 0], atol=0.02)
