"""stl, obj, ply and off: elements and normals stay what the file says; faults are sentences."""

import struct

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter, ShellFileError
from sphshell_pin.shell import Shell
from sphshell_pin.shell.readers.mesh import STL_RECORD

from .surfaces import CUBE, CUBE_QUADS, TRIANGLE, by_place, expect, plate

SUFFIXES = ["shl", "stl", "obj", "ply", "off"]


@pytest.fixture
def write(tmp_path):
    def write(name, text):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def cube(**options):
    return Shell(CUBE, CUBE_QUADS, **options)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("unit", ["m", "mm", "in"])
def test_round_trip(tmp_path, suffix, unit):
    vertices, quads = plate(3)
    vertices = vertices + np.array([0.1, 0.2, 0.3])
    shell = Shell(vertices, [q[:3].tolist() if k == 4 else q.tolist() for k, q in enumerate(quads)])
    path = tmp_path / f"plate.{suffix}"
    shell.to_file(path, unit=unit)
    back = Shell.from_file(path, unit=None if suffix == "shl" else unit)
    tolerance = 1e-6 if suffix == "stl" else 1e-15
    assert back.size == pytest.approx(shell.size, rel=tolerance)
    if suffix == "stl":
        assert back.num_elements == len(shell.triangles)
    else:
        assert by_place(back) == by_place(shell)
    assert back.normals is None


@pytest.mark.parametrize("suffix", ["shl", "obj", "ply"])
def test_round_trip_with_normals(tmp_path, suffix):
    normals = np.random.default_rng(0).normal(size=(6, 4, 3)) * 0.1
    normals += 2 * (CUBE[CUBE_QUADS].mean(axis=1, keepdims=True) - 0.5)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    shell = cube(normals=normals)
    path = tmp_path / f"cube.{suffix}"
    shell.to_file(path)
    back = Shell.from_file(path, unit="m")
    assert by_place(back) == by_place(shell)
    places, again = (np.c_[s.vertices[s.triangles], s.normals] for s in (shell, back))
    assert again == pytest.approx(places, abs=1e-12)


def test_a_good_file_is_never_half_overwritten(tmp_path):
    path = tmp_path / "cube.obj"
    cube().to_file(path)
    before = path.read_bytes()
    (tmp_path / "taken.off").mkdir()
    for kind, name, unit, said in (
        (InvalidParameter, "cube.obj", "furlong", "unit"),
        (InvalidParameter, "cube.step", "m", r"\.shl, \.stl"),
        (ShellFileError, "none/cube.obj", "m", "cannot be written"),
        (ShellFileError, "taken.off", "m", "cannot be written"),
    ):
        with pytest.raises(kind, match=said):
            cube().to_file(tmp_path / name, unit=unit)
    assert path.read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cube.obj", "taken.off"]


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("cube.obj", {}, r"(?s)unit.*mm.*ft.*103\.9 units.*0\.1039 m"),
        ("cube.obj", {"unit": "parsec"}, "must be one of: m, dm, cm, mm"),
        ("cube.obj", {"unit": "m", "scale": "apply"}, "must be a number"),
        ("cube.dae", {"unit": "m"}, r"\.stl, \.obj, \.ply, \.off, \.shl"),
    ],
)
def test_unit_must_be_stated(tmp_path, name, options, said):
    path = tmp_path / "cube.obj"
    cube().transformed(60.0).to_file(path)
    health = Shell.from_file(path, unit="mm", scale=10.0).health
    expect(health, "scaled by 10 as asked", size=0.6 * np.sqrt(3.0))
    assert Shell.from_file(path, unit="inches").unit == "inches"
    with pytest.raises(InvalidParameter, match=said):
        Shell.from_file(path.rename(tmp_path / name), **options)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_missing_empty_and_damaged(tmp_path, write, suffix):
    (tmp_path / f"folder.{suffix}").mkdir()
    write(f"empty.{suffix}", "")
    for name, said in (("none", "no such file"), ("empty", "is empty"), ("folder", "not a file")):
        with pytest.raises(ShellFileError, match=said):
            Shell.from_file(tmp_path / f"{name}.{suffix}", unit="m")
    for damage in (b"\x00\x01\x02 nothing", b"text only\n", bytes(range(256)) * 3):
        with pytest.raises(ShellFileError):
            Shell.from_file(write(f"damaged.{suffix}", damage), unit="m")


CORNERS = "".join(f"{x} {y} {z}\n" for x, y, z in CUBE)


SIDES = "".join(f"4 {a} {b} {c} {d}\n" for a, b, c, d in CUBE_QUADS)


def test_obj_dialects(write):
    text = "\ufeff# made by hand\r\nmtllib none.mtl\r\no thing\r\n"
    text += "".join(f"v {x} {y} {z} 0.5 0.5 0.5\r\n" for x, y, z in CUBE)
    text += "vt 0 0\r\nvn 0 0 1\r\ng faces\r\nusemtl blue\r\ns off\r\nl 1 2\r\n"
    rows = [[str(v + 1) for v in q] for q in CUBE_QUADS]
    rows[1] = [f"{v}/1" for v in rows[1]]
    rows[2] = [str(int(v) - 9) for v in rows[2]]
    rows[3] = [f"{v}/1/1" for v in rows[3]]
    rows[4] = [f"{v}//-1" for v in rows[4]]
    text += "".join("f " + " ".join(row) + "\r\n" for row in rows[:5])
    text += "f " + rows[5][0] + " \\\r\n " + " ".join(rows[5][1:]) + " # last"
    shell = Shell.from_file(write("cube.obj", text), unit="m")
    assert shell.is_closed
    assert shell.health.quads == 6
    assert shell.health.missing_normals == 16


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n8 6 0\n{CORNERS}{SIDES}",
        "OFF 8 6 0 " + (CORNERS + SIDES).replace("\n", " "),
        f"OFF # cube\n# by hand\n\n8 6 12 # counts\n{CORNERS}\n{SIDES}# end",
        f"OFF\n8 6\n{CORNERS}{SIDES}",  # without a count of edges
        f"OFF\n8 6 0\n{CORNERS}" + SIDES.replace("\n", " 3 255 0 0\n"),
        f"OFF\n8 6 0\n{CORNERS}{SIDES}".replace("\n4", " 4"),
        "COFF\n8 6 0\n" + CORNERS.replace("\n", " 1 0 0 1\n") + SIDES,
        "NOFF\n8 6 0\n" + CORNERS.replace("\n", " 0 0 1\n") + SIDES,
    ],
)
def test_off_with_comments_colours_and_loose_lines(write, text):
    shell = Shell.from_file(write("cube.off", text), unit="m")
    assert (shell.health.quads, shell.is_closed) == (6, True)
    assert (shell.normals is not None) == text.startswith("NOFF")
    assert shell.normals is None or (np.abs(shell.normals[..., 2]) == 1.0).all()


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_ply_with_mixed_elements(write, order):
    name = "little" if order == "<" else "big"
    head = (
        f"ply\nformat binary_{name}_endian 1.0\nelement vertex 8\n"
        "property float x\nproperty float y\nproperty float z\n"
        "element face 7\nproperty list uchar int vertex_indices\nend_header\n"
    )
    data = head.encode() + CUBE.astype(f"{order}f4").tobytes()
    for quad in [*CUBE_QUADS[:5], CUBE_QUADS[5][:3], [CUBE_QUADS[5][k] for k in (2, 3, 0)]]:
        data += struct.pack(f"{order}B{len(quad)}i", len(quad), *quad)
    shell = Shell.from_file(write("cube.ply", data), unit="m")
    assert (shell.health.quads, shell.num_elements) == (5, 7)
    assert shell.is_closed


def binary_stl(count, held, more=b""):
    """Return a binary file whose header promises `count` triangles, and which holds others."""
    facet = np.zeros((), STL_RECORD)
    facet["corners"] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    return bytes(80) + count.to_bytes(4, "little") + held * facet.tobytes() + more


OBJ = "".join(f"v {row}\n" for row in CORNERS.splitlines()) + "f 1 2 3\n"
OFF = f"OFF\n8 2 0\n{CORNERS}"


@pytest.mark.parametrize(
    ("suffix", "content", "said"),
    [
        ("obj", OBJ + "f 1 2 9", "vertex 9"),
        ("obj", OBJ + "f 1 2 0", "vertex 0"),
        ("obj", OBJ + "f 1 2 -9", "vertex -9"),
        ("obj", OBJ + "f 1 2", "needs three"),
        ("obj", OBJ + "f 1 2 x", "'x'"),
        ("obj", OBJ + "f 1//1 2//1 3//1", "normal"),
        ("obj", OBJ + "v 1 2", "three numbers"),
        ("obj", OBJ + "v 1 2 x", "could not convert"),
        ("obj", OBJ + "v 1 2 nan", "not finite"),
        *(
            ("off", f"{OFF}{before}{face}\n", "damaged face")
            for before in ("3 0 1 2 ", "3 0 1 2 255 0 0\n")  # all in one line, and each in its own
            for face in ("0", "-1 0 1", "4 0 1 2", "3 0 1 x")
        ),
        *(
            ("off", f"{OFF}3 0 1 2\n3 0 1 {index}\n", "element 2 uses vertex")
            for index in (-1, 8, 10**12)
        ),
        (
            "stl",
            binary_stl(
                1, 0, np.array([0, 0, 0, *[0] * 5, np.nan, *[1] * 3], "<f4").tobytes() + bytes(2)
            ),
            "vertex 2 is not finite",
        ),
        ("stl", binary_stl(9, 4), "its header promises 9 triangles, and it holds 4; export"),
        ("stl", binary_stl(2, 3), "its header promises 2 triangles, and it holds 3; export"),
        ("stl", binary_stl(3, 3)[:-7], "its header promises 3 triangles, and it holds 2; export"),
        ("stl", binary_stl(0, 0), "its header promises 0 triangles, and it holds 0; export"),
        ("stl", binary_stl(2**32 - 1, 1), "promises 4294967295 triangles, and it holds 1;"),
        ("stl", "solid a\nfacet normal 0 0 1\nvertex 0 0 0\nvertex 1", "1 vertices in 0 whole"),
        ("stl", "solid a\nvertex 1_0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet", "2 vertices in 1"),
    ],
)
def test_a_damaged_file_is_told_as_it_is(write, suffix, content, said):
    with pytest.raises(ShellFileError, match=said):
        Shell.from_file(write(f"bad.{suffix}", content), unit="m")


@pytest.mark.parametrize("number", ["1_0", "\u0661"])
@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "shl"])
def test_numbers_of_python_alone_are_refused(suffix, number, tmp_path):
    text, file = TRIANGLE[suffix], tmp_path / f"a.{suffix}"
    for changed in (text, text.replace("2 0 0", f"{number} 0 0"), text.replace("3", number, 1)):
        file.write_text(changed, encoding="utf-8")
        unit = None if suffix == "shl" else "m"
        if changed == text:
            Shell.from_file(file, unit)
            continue
        with pytest.raises(ShellFileError):
            Shell.from_file(file, unit)
