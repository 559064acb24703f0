import base64
import gzip
import re
import struct

import meshcat
import numpy as np
import pinocchio as pin
import umsgpack

from sphshell_pin.view.nodes import HIDDEN_SCALE, Command, pose
from sphshell_pin.view.page import FilmWindow, render_page
from tests.view.test_meshes import ball, stl


def unpacked(page):
    """The commands of a page, as the browser reads them."""
    scene = re.search(r'id="scene">([^<]*)<', page).group(1)
    data = gzip.decompress(base64.b64decode(scene))
    commands, at = [], 0
    while at < len(data):
        (length,) = struct.unpack_from("<I", data, at)
        commands.append(umsgpack.unpackb(data[at + 4 : at + 4 + length]))
        at += 4 + length
    return commands


NO_CLIP = {"animations": [{"clip": {"tracks": []}}]}


def filmed(matrices, times):
    """Tracks by name, and the still transform, of one node with these poses."""
    window = FilmWindow()
    node = meshcat.Visualizer(window=window)["node"]
    for window.frame, matrix in enumerate(matrices):
        node.set_transform(matrix)
    told = {one["type"]: one for one in window.commands(np.asarray(times, dtype=float))}
    tracks, (clip,) = {}, told.get("set_animation", NO_CLIP)["animations"]
    for track in clip["clip"]["tracks"]:
        t, values = (np.frombuffer(track[name].data, "<f4") for name in ("times", "values"))
        tracks[track["name"]] = t, values.reshape(len(t), -1)
    return tracks, np.reshape(told["set_transform"]["matrix"], (4, 4)).T


def test_tracks_compose_to_the_poses_that_were_filmed():
    random = np.random.default_rng(0)
    times = np.linspace(0.0, 2.0, 40)
    matrices = []
    for k in range(40):
        rotation = pin.exp3(np.array([0.1, 0.2, 0.3]) * k)
        scale = random.uniform(0.1, 2.0, 3) * [(-1.0) ** (k > 20), 1.0, 1.0]
        matrices.append(pose(rotation, random.normal(size=3), scale))
    tracks, still = filmed(matrices, times)
    np.testing.assert_array_equal(still, matrices[0])
    for name in (".position", ".quaternion", ".scale"):
        np.testing.assert_allclose(tracks[name][0], times, rtol=1e-6)
    for k, matrix in enumerate(matrices):
        rotation = pin.Quaternion(tracks[".quaternion"][1][k].astype(float)).matrix()
        composed = pose(rotation, tracks[".position"][1][k], tracks[".scale"][1][k])
        np.testing.assert_allclose(composed, matrix, atol=2e-6)


def test_quaternions_take_the_short_way():
    turns = [pose(pin.exp3(np.array([0.0, 0.0, 0.5 * k])), np.zeros(3)) for k in range(60)]
    values = filmed(turns, np.arange(60))[0][".quaternion"][1]
    assert (np.sum(values[1:] * values[:-1], axis=1) > 0.0).all()


def test_what_stands_still_costs_no_track_and_a_pause_no_keys():
    still = [pose(np.eye(3), np.ones(3))] * 50
    assert filmed(still, np.arange(50))[0] == {}
    moved = [pose(np.eye(3), np.array([float(k >= 20), 0, 0])) for k in range(50)]
    tracks = filmed(moved, np.arange(50))[0]
    assert list(tracks) == [".position"]
    np.testing.assert_array_equal(tracks[".position"][0], [0, 19, 20, 49])


def test_a_node_appears_where_it_will_be():
    hidden, shown = np.array([9.0, 9.0, 9.0]), np.array([1.0, 2.0, 3.0])
    frames = [pose(np.eye(3), hidden, HIDDEN_SCALE)] * 5 + [pose(np.eye(3), shown, 1.0)] * 5
    tracks = filmed(frames, np.arange(10))[0]
    times, values = tracks[".position"]
    np.testing.assert_array_equal(values[list(times).index(4)], shown)
    assert tracks[".scale"][1].min() > 0.0


def test_a_long_text_or_file_is_stored_once():
    window = FilmWindow()
    text = "<COLLADA>" + "0.123 " * 10_000
    mesh = umsgpack.Ext(0x12, stl(ball(30)))
    other = umsgpack.Ext(0x12, bytes(30_000))
    files = {"text": text, "text again": text, "mesh": mesh, "mesh again": mesh, "other": other}
    for name, file in files.items():
        command = {"type": "set_object", "path": f"/{name}", "object": {"geometries": [file]}}
        window.send(Command(command))
    commands = window.commands(np.zeros(1))
    stored = [c for c in commands if c["type"] == "text"]
    assert [c.get("text") for c in stored] == [text, None]
    drawn = {c["path"]: c["object"]["geometries"][0] for c in commands if c["type"] == "set_object"}
    assert drawn["/text"] == drawn["/text again"] == {"$text": stored[0]["name"]}
    assert drawn["/mesh"] == drawn["/mesh again"] == {"$text": stored[1]["name"]}
    assert drawn["/other"] is other


def test_deleting_a_path_takes_what_is_below_and_no_more():
    window = FilmWindow()
    page = meshcat.Visualizer(window=window)
    for name in ("arm", "arm/hand", "armchair"):
        page[name].set_property("visible", False)
    page["arm"].delete()
    assert [c["path"] for c in window.commands(np.zeros(1))] == ["/meshcat/armchair"]


def test_a_page_needs_nothing_from_anywhere_and_escapes_what_it_is_told():
    window = FilmWindow()
    meshcat.Visualizer(window=window)["node"].set_property("visible", True)
    commands = window.commands(np.zeros(1))
    title = 'A <b>bold</b> & "quoted" title @@scene@@ </script>'
    page = render_page(commands, title, [("#ff0000", "5 < 6")])
    assert unpacked(page) == commands
    assert "A &lt;b&gt;bold&lt;/b&gt; &amp;" in page
    assert "5 &lt; 6" in page
    assert "<b>" not in page.split("<script>", maxsplit=1)[0]
    assert not re.search(r"<(script|link|img|iframe)[^>]*\b(src|href)=", page)
    # The notices of what is in the page go with it.
    notices = page.rpartition("<!--")[2]
    assert "three.js authors" in notices
    assert notices.count("Permission is hereby granted") >= 4
    # The same scene gives the same page, byte by byte.
    assert page == render_page(commands, title, [("#ff0000", "5 < 6")])
