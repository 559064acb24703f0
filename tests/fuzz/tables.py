"""Damaged results, scenarios and robots."""

import functools
import io
import json
import math
import random
import re
import tempfile
import tomllib
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sphshell_pin import robots
from sphshell_pin.results import Sensitivities
from sphshell_pin.scenario import build
from sphshell_pin.scenario.running.run import simulate
from tests.fuzz.mutate import NUMBERS, alter, damage, word
from tests.scenario.files import DROP, write
from tests.texts import text_of

PRESS = text_of("scenarios/press.toml")

BOX = text_of("scenarios/box.off")

EXPRESSIONS = (
    *("${9**9**9}", "${'x' * 10**10}", "${open('x').read()}", "${(lambda: 0)()}", "${", "${1 / 0}"),
    *("$(arg x)", "$(find x)", "$(eval 10**9)", "$$", "robot.xml", "robot.xacro", "parts/limb.xml"),
    *("package://finger_description/robot.urdf", "package://", "file://", "..", "\U0001f600"),
)
"""Texts of robots' descriptions: what xacro evaluates, and names of files."""


def prepare(folder: Path) -> None:
    """Write the files that the scenarios need beside them."""
    (folder / "box.off").write_text(BOX)
    finger = robots.URDF_FOLDER / "three_link_finger.urdf"
    (folder / "finger.urdf").write_bytes(finger.read_bytes())


def reproducible(path: Path) -> bytes:
    """Return the file of a run without the folder and the clock of today."""
    with np.load(path, allow_pickle=False) as file:
        arrays = dict(file)
    header = json.loads(str(arrays["header"]).replace(str(path.parent), "/home"))
    header["stats"] |= {"wall_time": 0.0, "real_time_factor": 0.0}
    arrays["header"] = np.array(json.dumps(header))
    return packed(arrays)


def pack(members: dict[str, bytes]) -> bytes:
    """Return a zip archive of `members`, the same bytes at any time."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in members.items():
            one = zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0))
            one.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(one, data)
    return stream.getvalue()


def _npy(array: Any, *, pickled: bool = False) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=pickled)
    return stream.getvalue()


@functools.cache
def npz_corpus() -> tuple[bytes, ...]:
    """Return the file of a short run, with derivatives of its rows."""
    with tempfile.TemporaryDirectory() as home:
        result, _ = simulate(build(write(Path(home)), {"run.record_dt": "5e-3"}))
        nv, m = result.v.shape[1], len(result.contacts)
        shapes = {"q": (len(result.t), nv), "v": (len(result.t), nv), "force_world": (m, 3)}
        shapes |= {"normal_force": (m,), "depth": (m,)}
        rows = {name: np.ones((*shape, 2)) for name, shape in shapes.items()}
        by = Sensitivities(("v0.0", "v0.1"), **rows)
        result = replace(result, sensitivities=by)
        return (reproducible(result.save(Path(home, "run.npz"))),)


def damaged_npz(rng: random.Random, data: bytes) -> bytes:
    """Return a result whose arrays or header were changed; of files that it keeps, their bytes."""
    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        arrays = dict(file)
    members: dict[str, bytes] = {}
    for _ in range(rng.choice((1, 1, 2, 3))):
        name = rng.choice([*arrays, "header", "header"]) if arrays else "header"
        if name == "header":
            try:
                header = json.loads(str(arrays.get("header", "{}")))
                arrays["header"] = np.array(json.dumps(alter(rng, header)))
            except (ValueError, RecursionError):
                arrays["header"] = np.array("[" * 5000)
        elif ".file." in name and rng.random() < 0.8:
            arrays[name] = np.frombuffer(damage(rng, arrays[name].tobytes()), np.uint8)
        else:
            rng.choice(_ARRAY_WAYS)(rng, arrays, name)
    if rng.random() < 0.1:
        members["t.npy"] = _lying_npy(rng)
    return packed(arrays, members)


def packed(arrays: dict[str, Any], members: dict[str, bytes] | None = None) -> bytes:
    """Return a file of NumPy's with the arrays, and `members` in the place of some."""
    files = {f"{k}.npy": _npy(a, pickled=a.dtype.hasobject) for k, a in arrays.items()}
    return pack(files | (members or {}))


def _lying_npy(rng: random.Random) -> bytes:
    """Return an array whose header announces more, or something else, than follows."""
    stream = io.BytesIO()
    shape = rng.choice(((2**40,), (2**29,), (-1,), (51,), (2**62, 2**62), (), (0, 2**50)))
    kind = rng.choice(("<f8", "|O", "<U100000", "<c16", "|V8", "<M8[s]", ">f8", "|S0", "<f2"))
    header = {"descr": kind, "fortran_order": rng.random() < 0.3, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, header)
    return stream.getvalue() + b"\0" * rng.choice((0, 8, 80, 408, 1000))


def _drop(rng: random.Random, arrays: dict[str, Any], name: str) -> None:
    del arrays[name]


def _rename(rng: random.Random, arrays: dict[str, Any], name: str) -> None:
    arrays[rng.choice(("x", "header", "../x", f"{name}.npy", *arrays))] = arrays.pop(name)


def _copy(rng: random.Random, arrays: dict[str, Any], name: str) -> None:
    arrays[name] = arrays[rng.choice(list(arrays))]


def _reshape(rng: random.Random, arrays: dict[str, Any], name: str) -> None:
    old = arrays[name]
    ways = (
        lambda: old.reshape(-1),
        lambda: old[None],
        lambda: old[..., None],
        lambda: old.T,
        lambda: old[: len(old) // 2],
        lambda: old[:0],
        lambda: np.concatenate((old, old)),
        lambda: old[:, : old.shape[1] // 2],
        lambda: np.concatenate((old, old), axis=1),
        lambda: np.asfortranarray(old),
        lambda: old[0],
        lambda: np.flip(old),
    )
    try:
        arrays[name] = np.asarray(rng.choice(ways)())
    except (ValueError, IndexError, TypeError):
        arrays[name] = np.array(1.0)


def _retype(rng: random.Random, arrays: dict[str, Any], name: str) -> None:
    kind = rng.choice(("f4", "f2", "i1", "u8", "i8", "?", "c16", "U8", "S8", "O", "M8[s]", ">f8"))
    with np.errstate(all="ignore"):
        try:
            arrays[name] = arrays[name].astype(kind)
        except (ValueError, TypeError, OverflowError):
            arrays[name] = np.zeros(3, kind)


def _value(rng: random.Random, arrays: dict[str, Any], name: str) -> None:
    array = np.array(arrays[name])
    if not array.size:
        return
    flat = array.reshape(-1)
    odd = (0, -1, 1, 2, 3, 127, 255, 1e300, -1e300, 1e-300, math.nan, math.inf, 2**31 - 1, 2**62)
    with np.errstate(all="ignore"):
        for _ in range(rng.choice((1, 1, 5, len(flat)))):
            try:
                flat[rng.randrange(len(flat))] = rng.choice(odd)
            except (ValueError, OverflowError, TypeError):
                return
    arrays[name] = array


_ARRAY_WAYS = (_drop, _rename, _copy, _reshape, _reshape, _retype, _value, _value, _value)


def toml_corpus() -> tuple[bytes, ...]:
    return DROP.encode(), PRESS.encode()


def damaged_toml(rng: random.Random, data: bytes) -> bytes:
    """Return a scenario some of whose keys and values were changed."""
    tree = alter(rng, tomllib.loads(data.decode()))
    rows = (
        [f"{json.dumps(k)} = {_toml(v)}" for k, v in tree.items()] if isinstance(tree, dict) else []
    )
    return "\n".join(rows or [_toml(tree)]).encode("utf-8", "surrogatepass")


def _toml(value: Any) -> str:
    """Return `value` as TOML writes it; of what has no form in it, an empty text."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{json.dumps(k)} = {_toml(v)}' for k, v in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, int | float):
        return repr(value).lower()
    return json.dumps(value if isinstance(value, str) else "")


def urdf_corpus() -> tuple[bytes, ...]:
    head, said = b'<?xml version="1.0"?>', b'<?xml version="1.0" encoding="utf-8"?>'
    every = (path.read_bytes().replace(head, said) for path in sorted(robots.URDF_FOLDER.iterdir()))
    return tuple(data for data in every if b"<mesh" not in data)


def mjcf_corpus() -> tuple[bytes, ...]:
    folder = Path(__file__).parents[1] / "data" / "mjcf"
    every = (path.read_bytes() for path in sorted(folder.glob("*.xml")))
    return tuple(data for data in every if not re.search(b"<mesh|<include|<attach", data))


def damaged_xml(rng: random.Random, data: bytes) -> bytes:
    """Return XML some of whose elements, attributes, names and texts were changed."""
    ET.register_namespace("xacro", "http://www.ros.org/wiki/xacro")
    root = ET.fromstring(data.replace(b" xmlns=", b" xmlns_="))  # written with no prefixes
    text = ET.tostring(_element(alter(rng, _tree(root), _IN_XML))).replace(b" xmlns_=", b" xmlns=")
    if rng.random() < 0.05:
        encoding = rng.choice((b"utf-8", b"utf-16", b"latin-1", b"rot13", b"x"))
        return b'<?xml version="1.0" encoding="' + encoding + b'"?>' + text
    return text


def _tree(element: ET.Element) -> dict[str, Any]:
    """Return an element as a table, its texts as lists of words."""
    attributes = {name: text.split() for name, text in element.attrib.items()}
    texts = (element.text or "").split()
    return {"tag": element.tag, "is": attributes, "text": texts, "in": [*map(_tree, element)]}


def _element(tree: Any) -> ET.Element:
    """Return the element of a table, also of one that was altered."""
    tree = tree if isinstance(tree, dict) else {"tag": tree}
    attributes, inner = tree.get("is"), tree.get("in")
    made = ET.Element(word(tree.get("tag", "x")))
    if isinstance(attributes, dict):
        made.attrib.update({word(name): _words(value) for name, value in attributes.items()})
    made.text = _words(tree.get("text", ""))
    made.extend(map(_element, inner if isinstance(inner, list) else []))
    return made


def _words(value: Any) -> str:
    return " ".join(map(word, value if isinstance(value, list) else [value]))


_IN_XML = (
    *(*NUMBERS, *EXPRESSIONS, "base", "tip", "universe", "root_joint", "world", "floating"),
    *("revolute", "continuous", "prismatic", "fixed", "planar", "spherical"),
    *("link", "joint", "mimic", "geometry", "sphere", "mesh", "robot"),
    *(
        {"tag": "mesh", "is": {"filename": file, "scale": scale}}
        for file in ("box.off", "package://x/y.stl", "/", "finger.urdf", "", "http://x/y.stl")
        for scale in ("1 1 1", "0", "x")
    ),
)
