"""Robot meshes, packed and restored: as good as they were, in less room."""

import gzip
import re
import struct
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import umsgpack

import sphshell_pin.view.page as page_module
from sphshell_pin.view import meshes
from sphshell_pin.view.meshes import LEVELS, MARK, STL_HEADER, STL_RECORD, lit_facets
from sphshell_pin.view.robot import GeometryRobot
from tests import urdf
from tests.view.drawn import Film

PAGE = Path(page_module.__file__).parent / "recording_page" / "replay.js"


def restored(packed):
    """What the page makes of a packed list, written down from its description, number by number."""
    count, stride, rows = packed["count"], packed["stride"], packed["count"] // packed["stride"]
    values = np.zeros(count)
    for component in range(stride):
        whole = 0
        for row in range(rows):
            place = component * rows + row
            planes = [packed["bytes"][p * count + place] for p in range(packed["width"])]
            (folded,) = struct.unpack("<Q", bytes(planes).ljust(8, b"\0"))
            whole += -(folded + 1) // 2 if folded % 2 else folded // 2
            values[row * stride + component] = packed["low"] + packed["step"] * whole
    return values


def sphere_points(count):
    points = np.random.default_rng(1).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


@pytest.mark.parametrize("count", [100, 99, 98, 97])
def test_indices_are_exact(count):
    indices = np.random.default_rng(count).integers(0, 2_000_000, count)
    indices[:20] = np.arange(20)
    packed = meshes.pack_numbers(indices.astype(float), exact=True)
    np.testing.assert_array_equal(restored(packed), indices)


def test_coordinates_keep_a_part_of_the_meshs_size_and_equal_ones_stay_equal():
    points = 0.3 * sphere_points(300).reshape(-1) + 0.1
    error = restored(meshes.pack_numbers(points, exact=False)) - points
    assert np.abs(error).max() <= 0.5001 * np.ptp(points) / LEVELS
    np.testing.assert_array_equal(
        restored(meshes.pack_numbers(np.full(90, 0.25), exact=False)), 0.25
    )


MESH = """<COLLADA><asset><unit meter="0.001"/></asset>
<float_array id="p" count="1200">{points}</float_array>
<p>{indices}</p><p>0 1 2</p><float_array id="odd">{odd}</float_array></COLLADA>"""


def a_mesh():
    points, indices = 100.0 * sphere_points(400).reshape(-1), np.arange(1200) // 2
    listed = " ".join(f"{x:.6f}" for x in points)
    text = MESH.format(points=listed, indices=" ".join(map(str, indices)), odd="1.0 NaN " * 50)
    return text, points, indices


def test_only_long_lists_of_numbers_are_taken_out():
    text, points, indices = a_mesh()
    rest, numbers = meshes.take_out_numbers(text)
    assert len(numbers) == rest.count(MARK) == 2
    assert "<p>0 1 2</p>" in rest
    assert "NaN" in rest
    assert '<unit meter="0.001"/>' in rest
    np.testing.assert_allclose(restored(numbers[0]), points, atol=2e-3)
    np.testing.assert_array_equal(restored(numbers[1]), indices)
    small = len(gzip.compress(rest.encode() + umsgpack.packb(numbers)))
    assert small < 0.5 * len(gzip.compress(text.encode()))
    # A text with the mark is left alone.
    marked = text.replace("NaN", MARK)
    assert meshes.take_out_numbers(marked) == (marked, [])


def ball(rings=24):
    """Corners (f, 3, 3) of a ball of radius 0.2 about (1, 2, 3)."""
    u, v = np.meshgrid(np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, rings))
    points = np.stack((np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)), axis=-1)
    points = (0.2 * points + [1.0, 2.0, 3.0]).astype(np.float32)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    facets = [np.stack(one, axis=2).reshape(-1, 3, 3) for one in ((a, b, c), (a, c, d))]
    return np.concatenate(facets)


def normals_of(corners):
    """Unit normals (f, 3) of facets; nan of those without an area."""
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return doubled / np.linalg.norm(doubled, axis=1, keepdims=True)


def stl(corners, title=b"", normals=None):
    """A binary STL file of these facets, written field by field."""
    parts = [title.ljust(80, b" "), len(corners).to_bytes(4, "little")]
    normals = normals_of(corners) if normals is None else normals
    for normal, facet in zip(normals, corners, strict=True):
        parts += [np.vstack((normal, facet)).astype("<f4").tobytes(), b"\0\0"]
    return b"".join(parts)


@pytest.mark.parametrize("title", [b"", b"COLOR=abc"])
def test_facets_keep_their_corners(title):
    corners = ball()
    data = stl(corners, title)
    packed = meshes.pack_facets(data)
    points = restored(packed["points"]).reshape(-1, 3)
    again = points[restored(packed["corners"]).astype(int)].reshape(-1, 3, 3)
    assert np.abs(again - corners).max() <= 0.51 * np.ptp(corners) / LEVELS + 1e-7
    assert len(points) == len(np.unique(corners.reshape(-1, 3), axis=0))
    assert len(gzip.compress(umsgpack.packb(packed))) < 0.5 * len(gzip.compress(data))


@pytest.mark.browser
def test_the_page_restores_collada_and_stl(browser):
    wanted = r"^function unfold.*?^function restore_facets.*?^}$"
    functions = re.search(wanted, PAGE.read_text("utf-8"), re.S | re.M)[0]
    text, points, indices = a_mesh()
    rest, numbers = meshes.take_out_numbers(text)
    page = browser.new_page()

    def call(name, *arguments):
        script = f"given => {{ {functions}\nreturn Array.from({name}(...given)); }}"
        return page.evaluate(script, plain(arguments))

    again = "".join(call("restore", rest, numbers))
    assert re.sub(r">[^<]{200,}<", "><", again) == re.sub(r">[^<]{200,}<", "><", text)
    bodies = re.findall(r"<(?:float_array|p)\b[^>]*>([^<]*)<", again)
    np.testing.assert_allclose(np.array(bodies[0].split(), float), points, atol=2e-3)
    np.testing.assert_array_equal(np.array(bodies[1].split(), int), indices)
    corners = ball(8)
    given = stl(corners)
    again = bytes(call("restore_facets", meshes.pack_facets(given)))
    page.close()
    row = np.dtype([("f", "<f4", (4, 3)), ("a", "<u2")])
    facets, wanted = (np.frombuffer(file[84:], row)["f"] for file in (again, given))
    np.testing.assert_allclose(facets[:, 1:], corners, atol=0.52 * np.ptp(corners) / LEVELS)
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    large = np.linalg.norm(doubled, axis=1) > 1e-4
    np.testing.assert_allclose(facets[large, 0], wanted[large, 0], atol=0.02)


def plain(value):
    """Bytes as lists, which a browser takes."""
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    return [plain(one) for one in value] if isinstance(value, list | tuple) else value


def stl_of(normals, corners):
    """Return facets as a binary STL file, and as a text file."""
    text, normals, corners = "solid a\n", np.asarray(normals, "<f4"), np.asarray(corners, "<f4")
    for normal, three in zip(normals, corners, strict=True):
        text += f"facet normal {' '.join(map(repr, normal.tolist()))}\n outer loop\n"
        text += "".join(f"  vertex {' '.join(map(repr, one.tolist()))}\n" for one in three)
        text += " endloop\nendfacet\n"
    return stl(corners, b"a title", normals), (text + "endsolid a\n").encode()


@pytest.mark.parametrize("kind", [0, 1])
def test_facets_without_normals_are_lit(kind):
    corners = np.random.default_rng(3).normal(size=(40, 3, 3)).astype("<f4")
    expected = normals_of(corners)
    if kind == 0:
        expected[2] = (0.0, 0.0, 1.0)  # what a binary file says stays
    given = expected.copy()
    given[::3], given[1::7] = 0.0, np.nan
    made = np.frombuffer(lit_facets(stl_of(given, corners)[kind]), STL_RECORD, -1, STL_HEADER)
    np.testing.assert_allclose(made["normal"], expected, atol=2e-6)
    np.testing.assert_array_equal(made["corners"], corners)


def test_files_with_normals_and_what_is_none_stay_as_they_are():
    lit = stl_of(np.full((4, 3), 0.6), np.random.default_rng(3).normal(size=(4, 3, 3)))[0]
    for data in (lit, b"", b"solid a\nfacet normal 1\nendfacet"):
        assert lit_facets(data) is data
    # A facet without an area has no normal.
    flat = stl_of(np.zeros((1, 3)), np.zeros((1, 3, 3)))[0]
    assert np.isfinite(np.frombuffer(lit_facets(flat), STL_RECORD, -1, STL_HEADER)["normal"]).all()


def test_a_robot_s_mesh_is_sent_with_normals(tmp_path):
    corners = [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 1, 0], [0, 0, 1]]]
    (tmp_path / "dark.stl").write_bytes(stl_of(np.zeros((2, 3)), corners)[0])
    part = urdf.link("base", urdf.shape("visual", urdf.mesh(tmp_path / "dark.stl")))
    file = str(urdf.write(tmp_path / "dark.urdf", part))
    model = pin.buildModelFromUrdf(file)
    visual = pin.buildGeomFromUrdf(model, file, pin.GeometryType.VISUAL)
    film = Film()
    GeometryRobot(film.canvas, model, visual)
    (sent,) = [geometry for drawn in film.objects.values() for geometry in drawn["geometries"]]
    facets = np.frombuffer(sent["data"].data, STL_RECORD, -1, STL_HEADER)
    np.testing.assert_allclose(facets["normal"], [[0, 0, 1], [1, 0, 0]], atol=1e-7)
