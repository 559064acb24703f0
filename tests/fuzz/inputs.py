"""Input k of seed s: always the same bytes, so that two numbers are enough to have it again."""

import functools
import random
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sphshell_pin.errors import SphshellError
from sphshell_pin.robots.plain_mesh import FORMATS
from tests.fuzz import cad, folders, readers, strangers, tables
from tests.fuzz.folders import STRUCTURES, Structure, damaged
from tests.fuzz.meshes import SHAPES, WRITERS
from tests.fuzz.mutate import damage
from tests.fuzz.special import read_special

CORPUS = Path(__file__).parents[1] / "data" / "corpus"
Corpus = Callable[[], tuple[bytes, ...]]
Reader = Callable[[Path], None]


@dataclass(frozen=True)
class Kind:
    """A kind of input: the `suffix` of its file, undamaged ones, and what reads one.

    `structure` changes more than bytes. `turns` is how often the kind comes in each round.
    """

    suffix: str
    corpus: Corpus
    structure: Structure
    read: Reader
    turns: int = 8


@dataclass(frozen=True)
class Input:
    """A damaged file: its `kind`, the `suffix` of its name, its bytes."""

    kind: str
    suffix: str
    data: bytes


@functools.cache
def _mesh_corpus(kind: str) -> tuple[bytes, ...]:
    suffix, write = WRITERS[kind]
    own = [write(shape()) for shape in SHAPES]
    small = [p.read_bytes() for p in sorted(CORPUS.glob(f"*{suffix}")) if p.stat().st_size < 8000]
    return (*own, *small)


def _mesh(kind: str) -> Kind:
    suffix, write = WRITERS[kind]
    corpus = functools.partial(_mesh_corpus, kind)
    return Kind(suffix, corpus, folders.mesh_by(write), readers.read_mesh)


def _file(suffix: str, corpus: Corpus, read: Reader, turns: int = 8) -> Kind:
    return Kind(suffix, corpus, STRUCTURES[suffix], read, turns)


def _folder(kind: str, corpus: Corpus, read: Reader, turns: int = 8) -> Kind:
    """Return a kind whose files are archives of folders; `read` takes the folder."""
    return Kind(f".{kind}.zip", corpus, folders.damaged_folder, readers.in_folder(read), turns)


def _drawn(suffix: str) -> Kind:
    corpus = functools.partial(strangers.mesh_corpus, suffix)
    return Kind(f".drawn{suffix}", corpus, STRUCTURES[suffix], strangers.read_drawn(suffix), 4)


def _cad(suffix: str) -> Kind:
    return Kind(suffix, functools.partial(cad.corpus, suffix), damage, cad.read, 1)


KINDS: dict[str, Kind] = {
    **{kind: _mesh(kind) for kind in WRITERS},
    # The reader with the most to check comes more often.
    "npz": _file(".npz", tables.npz_corpus, readers.read_result, 24),
    "toml": _file(".toml", lambda: tables.SCENARIOS, readers.read_scenario, 16),
    "urdf": _file(".urdf", tables.urdf_corpus, readers.read_robot),
    "mjcf": _file(".xml", tables.mjcf_corpus, readers.read_robot),
    "fit": _file(".csv", lambda: (folders.MEASURED,), readers.read_measured),
    "law": _folder("law", folders.law_corpus, readers.read_scenario_in),
    "srdf": _folder("srdf", folders.srdf_corpus, readers.read_robot_in),
    "includes": _folder("includes", folders.include_corpus, readers.read_robot_in),
    "packages": _folder("packages", folders.package_corpus, readers.read_robot_in),
    "meshes": _folder("meshes", folders.mesh_corpus, readers.read_robot_in),
    "results": _folder("results", folders.results_corpus, readers.read_run),
    "kept": Kind(".kept.zip", folders.results_corpus, folders.damaged_kept, readers.look_in),
    "special": Kind(".special", lambda: (b"",), lambda rng, _: rng.randbytes(8), read_special),
    "expression": Kind(
        ".expression", strangers.expression_corpus, strangers.expression, strangers.read_expression
    ),
    **{f"drawn{suffix}": _drawn(suffix) for suffix in FORMATS},
    **{suffix[1:]: _cad(suffix) for suffix in cad.SUFFIXES},
    # A process for each takes a second.
    "xacro": _folder("xacro", folders.xacro_corpus, readers.read_robot_in, 1),
}
TURNS = tuple(name for name, kind in KINDS.items() for _ in range(kind.turns))
_READERS = {kind.suffix: kind.read for kind in KINDS.values()}


def make_input(seed: int, k: int) -> Input:
    """Return input `k` of `seed`."""
    name = TURNS[k % len(TURNS)]
    kind, rng = KINDS[name], random.Random(f"{seed}/{k}")
    corpus = kind.corpus()
    return Input(name, kind.suffix, damaged(rng, kind.structure, rng.choice(corpus), corpus))


def read(path: Path) -> str:
    """Read the file, by its suffixes, as a user would; return "read", or "refused" with an error.

    Whatever else is raised is a fault of the package.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _READERS["".join(path.suffixes)](path)
    except SphshellError:
        return "refused"
    return "read"
