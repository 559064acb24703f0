"""Numbers of robot meshes, packed and restored: as good as they were, in less room."""

from __future__ import annotations

import gzip
import re
import struct

import numpy as np
import pytest
import umsgpack

from sphshell_pin.view.collada import LEVELS, MARK, pack_numbers, take_out_numbers
from tests.view.test_recording_in_browser import browser  # noqa: F401


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
    packed = pack_numbers(indices.astype(float), exact=True)
    np.testing.assert_array_equal(restored(packed), indices)


def test_coordinates_keep_a_part_of_the_meshs_size():
    points = 0.3 * sphere_points(300).reshape(-1) + 0.1
    error = restored(pack_numbers(points, exact=False)) - points
    assert np.abs(error).max() <= 0.5001 * np.ptp(points) / LEVELS


def test_normals_keep_their_direction():
    normals = sphere_points(300)
    packed = pack_numbers(normals.reshape(-1), exact=False)
    again = restored(packed).reshape(-1, 3)
    again /= np.linalg.norm(again, axis=1)[:, None]
    angle = np.linalg.norm(np.cross(again, normals), axis=1)
    assert np.rad2deg(angle.max()) < 0.12
    assert packed["width"] <= 2


def test_equal_numbers_stay_equal():
    packed = pack_numbers(np.full(90, 0.25), exact=False)
    np.testing.assert_array_equal(restored(packed), 0.25)


MESH = """<COLLADA><asset><unit meter="0.001"/></asset>
<float_array id="p" count="{n}">{points}</float_array>
<p>{indices}</p><p>0 1 2</p><float_array id="odd">{odd}</float_array></COLLADA>"""


def a_mesh(odd="1.0 NaN " * 50):
    points = 100.0 * sphere_points(400)
    indices = np.arange(1200) // 2
    text = MESH.format(
        n=1200,
        points=" ".join(f"{x:.6f}" for x in points.reshape(-1)),
        indices=" ".join(map(str, indices)),
        odd=odd,
    )
    return text, points.reshape(-1), indices


def test_only_long_lists_of_numbers_are_taken_out():
    text, points, indices = a_mesh()
    rest, numbers = take_out_numbers(text)
    assert len(numbers) == rest.count(MARK) == 2
    assert "<p>0 1 2</p>" in rest
    assert "NaN" in rest
    assert '<unit meter="0.001"/>' in rest
    np.testing.assert_allclose(restored(numbers[0]), points, atol=2e-3)
    np.testing.assert_array_equal(restored(numbers[1]), indices)
    small = len(gzip.compress(rest.encode() + umsgpack.packb(numbers)))
    assert small < 0.5 * len(gzip.compress(text.encode()))


def test_a_text_with_the_mark_is_left_alone():
    text = a_mesh()[0].replace("NaN", MARK)
    assert take_out_numbers(text) == (text, [])


@pytest.mark.browser
def test_the_page_restores_what_was_packed(browser):  # noqa: F811
    from pathlib import Path

    import sphshell_pin.view.page as page_module

    source = Path(page_module.__file__).with_name("recording.html").read_text(encoding="utf-8")
    functions = re.search(r"^function unfold.*?^}$.*?^function restore.*?^}$", source, re.S | re.M)
    text, points, indices = a_mesh()
    rest, numbers = take_out_numbers(text)
    told = [{**one, "bytes": list(one["bytes"])} for one in numbers]
    page = browser.new_page()
    again = page.evaluate(
        f"([text, numbers]) => {{ {functions[0]}\nreturn restore(text, numbers); }}", [rest, told]
    )
    page.close()
    assert re.sub(r">[^<]{200,}<", "><", again) == re.sub(r">[^<]{200,}<", "><", text)
    bodies = re.findall(r"<(?:float_array|p)\b[^>]*>([^<]*)<", again)
    np.testing.assert_allclose(np.array(bodies[0].split(), float), points, atol=2e-3)
    np.testing.assert_array_equal(np.array(bodies[1].split(), int), indices)
