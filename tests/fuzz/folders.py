"""Inputs of several files, each folder packed into one zip archive; they are damaged apart."""

import functools
import io
import json
import random
import re
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path, PurePath

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_gltf

from sphshell_pin import robots
from sphshell_pin.scenario import build
from sphshell_pin.scenario.running.run import simulate
from tests.fuzz import tables
from tests.fuzz.meshes import SHAPES, WRITERS, Mesh, damaged_mesh
from tests.fuzz.mutate import LARGEST, NUMBERS, alter, damage, repeated, word
from tests.fuzz.strangers import mesh_corpus as drawn_corpus
from tests.kept import scenes
from tests.texts import text_of

DATA = Path(__file__).parents[1] / "data"
Structure = Callable[[random.Random, bytes], bytes]

ROBOT = text_of("robots/with_mesh.urdf").rstrip()
MJCF = text_of("robots/with_mesh.xml").rstrip()
INERTIAL = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
POSES = text_of("robots/finger.srdf").rstrip()
DAE = text_of("robots/tetrahedron.dae").rstrip()
MEASURED = b"""t [s],pairs.ball-plate.normal_force [N],q.root_joint.2 [m],q.root_joint.2.sigma [m]
0.001,0.0,0.01249,1e-5\n0.002,0.5,0.01246,1e-5\n0.003,0.9,0.01241,1e-5\n0.004,,0.0124,2e-5
"""


def unpacked(data: bytes) -> dict[str, bytes]:
    """Return the files of an archive that `pack` made."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@functools.cache
def xacro_corpus() -> tuple[bytes, ...]:
    home = DATA / "xacro"
    parts = {"finger_description/package.xml", "finger_description/urdf/finger.xacro"}
    more = {name: (home / name).read_bytes() for name in sorted(parts | {"lengths.yaml"})}
    files = (path.read_bytes() for path in sorted(home.glob("*.xacro")))
    return tuple(tables.pack({"robot.xacro": data, **more}) for data in files)


@functools.cache
def srdf_corpus() -> tuple[bytes, ...]:
    finger = (robots.URDF_FOLDER / "three_link_finger.urdf").read_bytes()
    return (tables.pack({"robot.urdf": finger, "robot.srdf": POSES.encode()}),)


@functools.cache
def include_corpus() -> tuple[bytes, ...]:
    home = DATA / "mjcf"
    parts = {f"parts/{p.name}": p.read_bytes() for p in sorted((home / "parts").iterdir())}
    return (tables.pack({"robot.xml": (home / "included.xml").read_bytes(), **parts}),)


@functools.cache
def package_corpus() -> tuple[bytes, ...]:
    home = DATA / "xacro" / "finger_description"
    robot = ROBOT.replace("MESH", "package://finger_description/meshes/cube.stl").encode()
    parts = {name: (home / name).read_bytes() for name in ("package.xml", "meshes/cube.stl")}
    return (tables.pack({"robot.urdf": robot, **parts}),)


@functools.cache
def mesh_corpus() -> tuple[bytes, ...]:
    solid = SHAPES[-1]()
    files = {suffix: write(solid) for suffix, write in WRITERS.values() if suffix in _BY_ROBOTS}
    scene = trimesh.Trimesh(np.array(solid.vertices, float), solid.faces, process=False).scene()
    beside, whole = (export_gltf(scene, embed_buffers=embedded) for embedded in (False, True))
    files |= {".dae": DAE.encode(), ".gltf": whole["model.gltf"]}
    files[".obj"] = b"mtllib mesh.mtl\n" + files[".obj"]
    parts = {"mesh.mtl": b"newmtl a\nmap_Kd mesh.mtl\n"}
    made = [tables.pack({"robot.urdf": ROBOT.replace("MESH", "model.gltf").encode(), **beside})]
    for suffix, data in files.items():
        for name, text in (("robot.urdf", ROBOT), ("robot.xml", MJCF)):
            robot = text.replace("MESH", f"mesh{suffix}")
            if suffix not in (".stl", ".obj"):  # whose mass MuJoCo cannot tell
                robot = robot.replace("<geom ", f"{INERTIAL}<geom ")
            made.append(tables.pack({name: robot.encode(), f"mesh{suffix}": data, **parts}))
    return tuple(made)


_BY_ROBOTS = (".stl", ".obj", ".ply", ".off")


@functools.cache
def law_corpus() -> tuple[bytes, ...]:
    law = r'type = "hertz".*?(?= \}\nfriction = \{ type = "bristle")'
    scenario = re.sub(law, 'type = "table", file = "law.csv"', tables.PRESS, flags=re.S)
    table = b"depth,force\n0,0\n1e-3,10\n"
    return (tables.pack({"law.toml": scenario.encode(), "law.csv": table}),)


@functools.cache
def results_corpus() -> tuple[bytes, ...]:
    """Return the results of a run whose robots and surfaces came from files of all formats."""
    with tempfile.TemporaryDirectory() as folder:
        scenes.write(Path(folder))
        scenario = Path(folder, "own.toml")
        scenario.write_text(scenes.SCENARIO)
        changes = {"run.record": '["patch", "torque"]', "run.record_dt": "4e-3"}
        result, _ = simulate(build(scenario, changes))
        run = tables.reproducible(result.save(scenario.with_name("run.npz")))
        return (tables.pack({"run.npz": run}),)


def damaged_kept(rng: random.Random, data: bytes) -> bytes:
    """Return results in which a mesh that shows a robot is a damaged one of its format."""
    with np.load(io.BytesIO(unpacked(data)["run.npz"])) as file:
        arrays = dict(file)
    robots = json.loads(str(arrays["header"]))["origin"]["kept"]["robots"]
    meshes = [item for one in robots if one for item in one["meshes"].items()]
    for name, digest in rng.choices(sorted(meshes), k=rng.choice((1, 1, 2))):
        suffix = PurePath(name).suffix
        content = damaged(rng, STRUCTURES[suffix], rng.choice(drawn_corpus(suffix)))
        arrays[f"kept.file.{digest}"] = np.frombuffer(content, np.uint8)
    return tables.pack({"run.npz": tables.packed(arrays)})


def damaged_csv(rng: random.Random, data: bytes) -> bytes:
    """Return a table of which cells, columns or rows were changed."""
    rows = [row.split(",") for row in data.decode(errors="replace").split("\n")]
    if rng.random() < 0.2:
        at, to = rng.randrange(len(rows[0])), rng.randrange(len(rows[0]))
        for row in rows:
            row.insert(at, row[min(to, len(row) - 1)])
    rows = alter(rng, rows, (*NUMBERS, *rows))
    cells = (map(word, row if isinstance(row, list) else [row]) for row in rows)
    return "\n".join(map(",".join, cells)).encode()[:LARGEST]


def damaged_json(rng: random.Random, data: bytes) -> bytes:
    """Return JSON some of whose values were changed."""
    return json.dumps(alter(rng, json.loads(data))).encode()


def damaged_folder(rng: random.Random, data: bytes) -> bytes:
    """Return a folder of which a file or more are damaged, gone, or what another one is."""
    files = unpacked(data)
    for _ in range(rng.choice((1, 1, 1, 2))):
        name = rng.choice(sorted(files))
        way = rng.random()
        if way < 0.9:
            structure = STRUCTURES.get(PurePath(name).suffix)
            files[name] = damaged(rng, structure, files[name], sorted(files.values()))
        elif way < 0.95 and len(files) > 1:
            del files[name]
        else:
            files[name] = files[rng.choice(sorted(files))]
    return tables.pack(files)


def damaged(rng, structure, data, others=()):
    """Return `data` with its structure changed, or some of its bytes."""
    # Of an archive with other bytes, all is refused at once.
    archives = (damaged_folder, damaged_kept)
    if structure not in archives and rng.random() < 0.05:
        return repeated(rng, data)
    if structure is None or (structure not in archives and rng.random() < 0.4):
        return damage(rng, data, others)
    try:
        return structure(rng, data)
    except Exception:
        return damage(rng, data, others)  # damaged before, so that nothing can be read


def mesh_by(write: Callable[[Mesh], bytes]) -> Structure:
    """Return what makes a damaged surface, whatever the file was."""
    return lambda rng, _: write(damaged_mesh(rng))


STRUCTURES: dict[str, Structure] = {
    **{suffix: mesh_by(write) for suffix, write in WRITERS.values()},
    **dict.fromkeys((".xml", ".urdf", ".xacro", ".srdf", ".dae"), tables.damaged_xml),
    **dict.fromkeys((".json", ".gltf"), damaged_json),
    ".zip": damaged_folder,
    ".npz": tables.damaged_npz,
    ".toml": tables.damaged_toml,
    ".csv": damaged_csv,
}
"""By suffix: what changes the structure of a file."""
