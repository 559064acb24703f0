"""ADAMS .shl files: what occurs in them is read, what is damaged is said with its line."""

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter, InvalidShell, ShellFileError
from sphshell_pin.shell import Shell
from tests.tables import cases_of

from .surfaces import CUBE, CUBE_QUADS, areas, expect

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


def test_version_1_wound_inward_is_turned(write):
    shell = Shell.from_file(write(version_1()))
    expect(shell.health, is_closed=True, quads=6, flipped_elements=6, volume=1.0)
    assert (shell.normals, shell.name, shell.unit) == (None, "cube", "m")
    assert shell.source.endswith("cube.shl")


def test_version_2_is_welded_and_keeps_its_normals(write):
    shell = Shell.from_file(write(version_2()))
    figures = {"vertices": 8, "welded_vertices": 16, "turned_normals": 24}
    expect(shell.health, is_closed=True, **figures)
    assert shell.normals == pytest.approx(np.repeat(2 * areas(shell)[:, None], 3, axis=1))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "  \n", "\t \r\n\r\n"])
def test_line_ends_blanks_and_what_follows_the_polygons(write, end):
    for lines in ([*version_1(), "1 2 3", "7"], [*version_2(), ""]):
        assert Shell.from_file(write(lines, end)).is_closed


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
    health = Shell.from_file(write(["made by hand", *lines, "END"])).health
    expect(health, "4 lines of text were skipped", "made by hand", is_closed=True)


def test_polygons_may_have_many_corners(write):
    turn = 2 * np.pi * np.arange(15) / 15
    points = [f"{np.cos(t)} {np.sin(t)} 0" for t in turn]
    lines = version_1("1", points, ["15 " + " ".join(str(k + 1) for k in range(15))])
    expect(Shell.from_file(write(lines)).health, polygons=1, largest_polygon=15, elements=13)
    # Corners that run on in the next line belong to the same polygon.
    lines[-1:] = ["15 1 2 3 4 5 6 7", "8 9 10 11 12 13 14 15"]
    assert Shell.from_file(write(lines)).health.elements == 13


@pytest.mark.parametrize(("options", "size", "word"), cases_of("shell_files")["scales"])
def test_scale(write, options, size, word):
    shell = Shell.from_file(write(version_1("0.025400")), **options)
    assert shell.size == pytest.approx(size * np.sqrt(3.0))
    expect(shell.health, word, "0.0254", scale=size)


@pytest.mark.parametrize("scale", ["meters", 0.0, -1.0, np.nan, True])
def test_wrong_scale(write, scale):
    with pytest.raises(InvalidParameter, match="apply"):
        Shell.from_file(write(version_1()), scale=scale)


@pytest.mark.parametrize("lines", [version_1(), version_2()])
def test_truncated_anywhere_is_said(write, lines):
    for stop in range(1, len(lines)):
        shorter = [lines[:stop]]
        if len(lines[stop].split()) > 1 and stop < len(lines) - 1:
            shorter.append([*lines[:stop], lines[stop].split()[0]])
        for some in shorter:
            with pytest.raises(ShellFileError) as caught:
                Shell.from_file(write(some))
            assert caught.value.line is None or 1 <= caught.value.line <= len(some)


WRONG = cases_of("wrong_shl")["lines"]
FLAT = version_1("1", ["0 0 0", "1 0 0", "2 0 0"], ["3 1 2 3"])


@pytest.mark.parametrize(
    ("lines", "line", "said"),
    [
        *(({row: text}, line or None, said) for row, text, line, said in WRONG),
        (["solid cube"], None, "no numbers"),
        (FLAT, None, "no element is left"),
    ],
)
def test_messages_name_line_value_and_limit(write, lines, line, said):
    if isinstance(lines, dict):
        lines = [lines.get(k, text) for k, text in enumerate(version_1())]
    path = write(lines)
    with pytest.raises((ShellFileError, InvalidShell), match=said) as caught:
        Shell.from_file(path)
    assert getattr(caught.value, "line", None) == line
    assert lines is FLAT or str(path) in str(caught.value)


def test_normals_of_another_number_are_ignored_and_said(write):
    lines = version_2()
    lines[1] = "24 6 2 1.0"
    shell = Shell.from_file(write(lines))
    assert shell.normals is None
    expect(shell.health, "2 normals for 24 points ignored")
    lines[1] = "24 6 0 1.0"
    assert Shell.from_file(write(lines)).is_closed
