"""Meshes written anew: the same points, faces and colors, and nothing that they name."""

import importlib.util
import json
import os
import re
import sysconfig
import xml.etree.ElementTree as ET
from pathlib import Path

import coal
import numpy as np
import pytest

from sphshell_pin import robots
from sphshell_pin.errors import RobotWarning
from sphshell_pin.robots.mesh_faults import mesh_fault
from sphshell_pin.robots.plain_mesh import FORMATS, plain_mesh
from tests import urdf
from tests.texts import text_of

HEAD = '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema">'
OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nusemtl a\nf 1/1/1 2//1 3\n"


@pytest.mark.parametrize(
    "start",
    ["LIB\n", "mtl\\\nlib x\n", "\x0cLIB\n", "\0LIB\n", "v 0 0 0 \rLIB\n", "#\rLIB\n", "#\rLIB\r"],
)
def test_an_obj_file_keeps_its_numbers_alone(start):
    content = OBJ.replace(b"\n", b"\r") if start.endswith("\r") else OBJ
    made = plain_mesh(".obj", start.replace("LIB", "mtllib /etc/passwd").encode() + content)
    vertices = b"v 0.0 0.0 0.0\nv 1.0 0.0 0.0\nv 0.0 1.0 0.0\n"
    assert made.endswith(vertices + b"vn 0.0 0.0 1.0\nf 1//1 2//1 3\n")
    assert not {word for word in made.split() if word.isalpha()} - {b"v", b"vn", b"f"}
    assert plain_mesh(".obj", made) == made


GLTF = '{"asset": {"version": "2.0"}, "buffers": [{"%s": "%s", "byteLength": 36}]}'


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("m.obj", OBJ),  # assimp looks for m.mtl
        ("m.obj", b"mtllib other\n" + OBJ),
        ("m.obj", b"# x\rmtllib other\r" + OBJ),
        ("m.obj", b"mtl\\\nlib other\n" + OBJ),
        ("m.obj", b"mtllib ./sub/../other\n" + OBJ),
        ("m.obj", b"mtl\\\x0c\nlib other\n" + OBJ),
        ("m.gltf", (GLTF % ("uri", "other")).encode()),
        ("m.gltf", (GLTF % ("\\u0075ri", "%6fther")).encode()),
        ("m.gltf", (GLTF % ("uri", "other")).replace("}]", "}], 'buffers': []").encode()),
        ("m.glb", b"glTF" + bytes(8) + b"\x80" + bytes(7) + (GLTF % ("uri", "other")).encode()),
    ],
)
@pytest.mark.parametrize("kind", ["visual", "collision"])
def test_what_a_mesh_names_is_a_regular_file(name, content, kind, tmp_path):
    """Pinocchio's reader opens it, holding the interpreter's lock."""
    (tmp_path / "sub").mkdir()
    (tmp_path / name).write_bytes(content)
    os.mkfifo(tmp_path / ("m.mtl" if content == OBJ else "other"))
    drawn = urdf.link("a", urdf.shape(kind, urdf.mesh(name)))
    with pytest.warns(RobotWarning, match=f"missing or broken: {name}"):
        robot = robots.load_file(urdf.write(tmp_path / "r.urdf", drawn))
    assert robot.visual_model.ngeoms == robot.collision_model.ngeoms == 0


def test_a_collada_file_keeps_what_is_drawn_and_no_names_of_files():
    phong = "<phong><diffuse><texture texture='t'/><color>1 0 0 1</color></diffuse></phong>"
    common = f"<profile_COMMON><technique>{phong}</technique></profile_COMMON>"
    library = f"<library_effects><effect id='e'>{common}</effect></library_effects>"
    images = "<library_images><image><init_from>/etc/passwd</init_from></image></library_images>"
    nodes = '<scene><instance_visual_scene url="#s"/><instance_physics_scene url="#s"/></scene>'
    abroad = '<library_nodes><node><instance_node url="other.dae#n"/></node></library_nodes>'
    head = HEAD.replace("xmlns=", 'xmlns:c="http://a" xmlns=')
    for extra in (images, images.replace("library_images", "c:library_images")):
        text = f"{head}<!-- a --><?b c?>{extra}{abroad}{library}{nodes}</COLLADA>"
        made = plain_mesh(".dae", text.encode())
        assert not re.search(b"passwd|other|texture", made)
        tags = [one.tag.rpartition("}")[2] for one in ET.fromstring(made).iter()]
        drawn = ["color", "instance_visual_scene"]
        assert [tag for tag in tags if tag in drawn] == drawn
        assert plain_mesh(".dae", made) == made
    for wrong in ("<!DOCTYPE a>", "<translate>a b</translate>"):
        assert plain_mesh(".dae", f"{HEAD}{wrong}</COLLADA>".encode()) is None
    assert plain_mesh(".dae", b"<a/>") is None


TRIANGLE = text_of("robots/triangle.dae")
DRAWN = '<instance_geometry url="#g"/>'
ROWS = [[k + 1] * 10 for k in range(5)]


HUGE = {"accessors": [{"count": 10**6}], "meshes": [{"primitives": [{"indices": 0}] * 100}]}


def collada(p="0 1 2", library="", node=DRAWN):
    return TRIANGLE.format(p=p, library=library, node=node).encode()


def many_nodes():
    rows = [f'<node id="m0">{DRAWN}</node>']
    for k in range(5):
        rows += [f'<node id="m{k + 1}">' + f'<instance_node url="#m{k}"/>' * 10 + "</node>"]
    return collada(library="".join(rows), node='<instance_node url="#m5"/>')


def gltf(**of):
    accessor = {"componentType": 5126, "count": 3, "type": "VEC3"}
    mesh = {"primitives": [{"attributes": {"POSITION": 0}}]}
    nodes = [{"mesh": 0}]
    made = {"asset": {"version": "2.0"}, "accessors": [accessor], "meshes": [mesh], "nodes": nodes}
    return json.dumps(made | of).encode()


NO_INDEX = "<p> holds what is no index"
PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    b"property float z\nelement face 1\nproperty list int int vertex_indices\nend_header\n"
    b"0 0 0\n1 0 0\n0 1 0\n3 0 1 99999999\n"
)
WRONG = {
    "point": (".dae", collada(p="0 1 ."), NO_INDEX),
    "entity": (".dae", collada(p="0 1 &#46;"), NO_INDEX),
    "comment": (".dae", collada(p="0 1 <!-- 2 -->."), NO_INDEX),
    "utf-16": (".dae", collada(p="0 1 x").decode().encode("utf-16"), NO_INDEX),
    "namespace": (".dae", collada().replace(b'xmlns="', b'xmlns="}'), "not well-formed XML"),
    "itself": (".dae", collada(node='<instance_node url="#n"/>'), "holds itself"),
    "scene": (".dae", collada(node='<instance_node url="#w"/>'), "holds itself"),
    "deep": (".dae", collada(node="<node>" * 300 + "</node>" * 300), "deep"),
    "many": (".dae", many_nodes(), "stand for more than 100000 nodes"),
    "digits": (".obj", OBJ + b"f 1 2 " + b"10" * 500, "400 digits"),
    "digits joined": (".obj", OBJ + b"f 1 2 " + b"10\\\n" * 500, "400 digits"),
    "no index": (".obj", OBJ + b"f 1 2 12345678901", ""),
    "glTF itself": (".gltf", gltf(nodes=[{"children": [0]}]), "holds itself"),
    "glTF deep": (".gltf", gltf(nodes=[{"children": [k + 1]} for k in range(300)] + [{}]), "deep"),
    "glTF many": (".gltf", gltf(nodes=[{"children": row} for row in ROWS] + [{}]), "stand for"),
    "glTF huge": (".gltf", gltf(**HUGE), "stand for more than 20000000 triangles"),
    "glTF nested": (".gltf", b"[" * 100_000, "cannot be read"),
    "glTF other": (".gltf", gltf(nodes=[3]), "not that of a glTF"),
    "ply": (".ply", PLY, "uses vertex 100000000"),
}


@pytest.mark.parametrize("name", WRONG)
def test_assimp_is_not_given_what_it_cannot_bear(name, tmp_path):
    """It crashes, takes all memory or goes on without end at each of these."""
    suffix, content, reason = WRONG[name]
    file = tmp_path / f"m{suffix}"
    file.write_bytes(content)
    assert reason in mesh_fault(file)
    made = plain_mesh(suffix, content)
    if made is not None:
        file.write_bytes(made)
        assert mesh_fault(file) == ""
    file.write_bytes({".dae": collada(), ".obj": OBJ, ".gltf": gltf()}.get(suffix, b""))
    assert suffix == ".ply" or mesh_fault(file) == ""


def bounds(path):
    mesh = coal.MeshLoader().load(str(path), np.ones(3))
    points = mesh.vertices()
    return mesh.num_tris, np.array([points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize("suffix", FORMATS)
def test_assimp_reads_the_same_from_what_is_written_anew(suffix, tmp_path):
    home = Path(__file__).parents[2]
    found = [one for one in home.glob(f"*/**/meshes/**/*{suffix}") if "build" not in one.parts]
    if importlib.util.find_spec("cmeel"):
        prefix = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data"
        found += prefix.glob(f"robots/*_description/meshes/**/*{suffix}")
    found = [one for one in found if one.stat().st_size < 200_000]
    if not found:
        pytest.skip(f"there is no mesh of a robot in {suffix}")
    for path in sorted(found)[:8]:
        made = plain_mesh(suffix, path.read_bytes())
        assert made is not None, path
        (tmp_path / f"a{suffix}").write_bytes(made)
        (count, box), (again, found) = bounds(path), bounds(tmp_path / f"a{suffix}")
        assert again == count
        np.testing.assert_allclose(found, box, rtol=0.0, atol=1e-6 * np.ptp(box, axis=0).max())
