"""ADAMS .shl files: what occurs in them is read, what is damaged is said with its line."""

import re

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter, InvalidShell, ShellFileError
from sphshell_pin.shell import Shell

from .surfaces import CUBE, CUBE_QUADS, areas

POINTS = [" ".join(str(x) for x in p) for p in CUBE]
INWARD = ["4 " + " ".join(str(v + 1) for v in q[::-1]) for q in CUBE_QUADS]


def version_1(scale="1.0", points=POINTS, polygons=INWARD):
    return [f"{len(points)} {len(polygons)} {scale}", *points, *polygons]


def version_2(scale="1.0"):
    """Return the cube with a point for each corner and the file's own, inward, normals."""
    points, polygons, normals = [], [], []
    for quad in CUBE_QUADS:
        corners = CUBE[quad[::-1]]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        polygons.append("4 " + " ".join(str(len(points) + k + 1) for k in range(4)))
        points += [" ".join(map(str, c)) for c in corners]
        normals += [" ".join(map(str, normal))] * 4
    return ["Version: 2", f"{len(points)} 6 {len(normals)} {scale}", *points, *polygons, *normals]


@pytest.fixture
def write(tmp_path):
    def write(lines, end="\n", name="cube.shl"):
        path = tmp_path / name
        path.write_bytes(end.join(lines).encode())
        return path

    return write


def refused(path, **options):
    with pytest.raises(ShellFileError) as caught:
        Shell.from_file(path, **options)
    assert str(path) in str(caught.value)
    return caught.value


def test_version_1_wound_inward_is_turned(write):
    shell = Shell.from_file(write(version_1()))
    assert shell.is_closed
    assert shell.health.quads == 6
    assert shell.health.flipped_elements == 6
    assert shell.health.volume == pytest.approx(1.0)
    assert shell.normals is None
    assert shell.name == "cube"
    assert shell.unit == "m"
    assert shell.source.endswith("cube.shl")


def test_version_2_is_welded_and_keeps_its_normals(write):
    shell = Shell.from_file(write(version_2()))
    assert shell.is_closed
    assert len(shell.vertices) == 8
    assert shell.health.welded_vertices == 16
    assert shell.health.turned_normals == 24
    assert shell.normals == pytest.approx(np.repeat(2 * areas(shell)[:, None], 3, axis=1))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "  \n", "\t \r\n\r\n"])
def test_line_ends_and_blanks(write, end):
    for lines in (version_1(), version_2()):
        assert Shell.from_file(write([*lines, ""], end)).is_closed


def test_exponents_and_counts_as_reals(write):
    points = [" ".join(f"{float(x):.6f}D+00" for x in p.split()) for p in POINTS]
    polygons = [" ".join(f"{float(x):.1f}" for x in q.split()) for q in INWARD]
    lines = version_1("1.0D-03", points, polygons)
    lines[0] = "8.0 6.0D0 1.0D-03"
    shell = Shell.from_file(write(lines))
    assert shell.size == pytest.approx(np.sqrt(3.0) * 1e-3)
    assert shell.health.elements == 6


def test_text_lines_are_skipped_and_said(write):
    lines = version_1()
    lines[3:3] = ["! points of the cube", "x y z"]
    shell = Shell.from_file(write(["made by hand", *lines, "END"]))
    assert shell.is_closed
    assert any("4 lines of text were skipped" in note for note in shell.health.notes)
    assert "made by hand" in str(shell.health)


def test_polygons_may_have_many_corners(write):
    turn = 2 * np.pi * np.arange(15) / 15
    points = [f"{np.cos(t)} {np.sin(t)} 0" for t in turn]
    lines = version_1("1", points, ["15 " + " ".join(str(k + 1) for k in range(15))])
    health = Shell.from_file(write(lines)).health
    assert (health.polygons, health.largest_polygon, health.elements) == (1, 15, 13)
    # Corners that run on in the next line belong to the same polygon.
    lines[-1:] = ["15 1 2 3 4 5 6 7", "8 9 10 11 12 13 14 15"]
    assert Shell.from_file(write(lines)).health.elements == 13


def test_a_wrong_corner_count_shows_as_a_hole(write):
    polygons = INWARD.copy()
    polygons[5] = "3 " + " ".join(polygons[5].split()[2:])
    health = Shell.from_file(write(version_1(polygons=polygons))).health
    assert not health.ok
    assert health.boundary_edges == 3
    assert any("wrong number of corners" in sentence for sentence in health.problems)


@pytest.mark.parametrize(
    ("options", "size", "word"),
    [
        ({}, 0.0254, "applied"),
        ({"scale": "apply"}, 0.0254, "applied"),
        ({"scale": "ignore"}, 1.0, "ignored"),
        ({"scale": 2.0}, 2.0, "in place of"),
        ({"unit": "mm"}, 1e-3, "ignored"),
        ({"unit": "mm", "scale": "apply"}, 0.0254e-3, "applied"),
        ({"unit": "mm", "scale": 3}, 3e-3, "in place of"),
        ({"unit": "in", "scale": "ignore"}, 0.0254, "ignored"),
    ],
)
def test_scale(write, options, size, word):
    shell = Shell.from_file(write(version_1("0.025400")), **options)
    assert shell.size == pytest.approx(size * np.sqrt(3.0))
    assert shell.health.scale == pytest.approx(size)
    assert any(word in note and "0.0254" in note for note in shell.health.notes)


@pytest.mark.parametrize("scale", ["meters", 0.0, -1.0, np.nan, True])
def test_wrong_scale(write, scale):
    with pytest.raises(InvalidParameter, match="apply"):
        Shell.from_file(write(version_1()), scale=scale)


@pytest.mark.parametrize("lines", [version_1(), version_2()])
def test_truncated_anywhere_is_said(write, lines):
    for stop in range(1, len(lines)):
        error = refused(write(lines[:stop]))
        assert error.line is None or 1 <= error.line <= stop
    for stop in range(1, len(lines) - 1):
        if len(lines[stop].split()) > 1:
            refused(write([*lines[:stop], lines[stop].split()[0]]))


@pytest.mark.parametrize(
    ("row", "text", "line", "said"),
    [
        (9, "4 1 3 9 2", 10, r"point 9\b.*1 to 8"),
        (9, "4 1 3 0 2", 10, "point 0"),
        (9, "2 1 3", 10, "2 corners"),
        (9, "3 1 3 4 2", 10, "4 indices follow"),
        (9, "4 1 3.5 4 2", 10, "whole numbers"),
        (4, "1.0 2.0", 5, ""),
        (4, "1.0 2.0 nan", None, "vertex 4 is not finite"),
        (4, "1.0 2.0e 3", 5, ""),
        (0, "8 6 -1.0", 1, "SCALE"),
        (0, "8 6", 1, "header"),
        (0, "8.5 6 1", 1, "whole number"),
        (0, "Version: 3", 1, "version 3"),
    ],
)
def test_messages_name_line_value_and_limit(write, row, text, line, said):
    lines = version_1()
    lines[row] = text
    error = refused(write(lines))
    assert error.line == line
    assert re.search(said, str(error))


def test_files_without_a_surface(write):
    assert "no surface" in str(refused(write(["0 0 1.0"])))
    assert "no numbers" in str(refused(write(["solid cube"])))


def test_normals_of_another_number_are_ignored_and_said(write):
    lines = version_2()
    lines[1] = "24 6 2 1.0"
    shell = Shell.from_file(write(lines))
    assert shell.normals is None
    assert any("2 normals for 24 points ignored" in note for note in shell.health.notes)
    lines[1] = "24 6 0 1.0"
    assert Shell.from_file(write(lines)).is_closed


def test_all_degenerate(write):
    lines = version_1("1", ["0 0 0", "1 0 0", "2 0 0"], ["3 1 2 3"])
    with pytest.raises(InvalidShell, match="no element is left"):
        Shell.from_file(write(lines))


def test_what_follows_the_polygons_is_ignored(write):
    assert Shell.from_file(write([*version_1(), "1 2 3", "7"])).is_closed
