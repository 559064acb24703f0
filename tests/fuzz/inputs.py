"""Input k of seed s: always the same bytes, so that two numbers are enough to have it again."""

from __future__ import annotations

import functools
import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.fuzz import tables
from tests.fuzz.meshes import SHAPES, WRITERS, damaged_mesh
from tests.fuzz.mutate import damage

CORPUS = Path(__file__).parents[1] / "data" / "corpus"


@dataclass(frozen=True)
class Input:
    """A damaged file: its `kind`, the `suffix` of its name, its bytes."""

    kind: str
    suffix: str
    data: bytes


def corpus_of(kind: str) -> tuple[bytes, ...]:
    """Return the undamaged files of a kind."""
    return _mesh_corpus(kind) if kind in WRITERS else _CORPORA[kind]()


@functools.cache
def _mesh_corpus(kind: str) -> tuple[bytes, ...]:
    suffix, write = WRITERS[kind]
    own = [write(shape()) for shape in SHAPES]
    small = [p.read_bytes() for p in sorted(CORPUS.glob(f"*{suffix}")) if p.stat().st_size < 8000]
    return (*own, *small)


def _mesh(kind: str) -> Callable[[random.Random], bytes]:
    write = WRITERS[kind][1]

    def make(rng: random.Random) -> bytes:
        if rng.random() < 0.5:
            return damage(rng, rng.choice(_mesh_corpus(kind)), _mesh_corpus(kind))
        return write(damaged_mesh(rng))

    return make


def _table(
    kind: str, structure: Callable[[random.Random], bytes]
) -> Callable[[random.Random], bytes]:
    def make(rng: random.Random) -> bytes:
        if rng.random() < 0.4:
            return damage(rng, rng.choice(corpus_of(kind)), corpus_of(kind))
        return structure(rng)

    return make


_CORPORA = {
    "npz": tables.npz_corpus,
    "toml": tables.toml_corpus,
    "journal": tables.journal_corpus,
    "urdf": tables.urdf_corpus,
    "mjcf": tables.mjcf_corpus,
}

KINDS: dict[str, tuple[str, Callable[[random.Random], bytes]]] = {
    **{kind: (suffix, _mesh(kind)) for kind, (suffix, _) in WRITERS.items()},
    "npz": (".npz", _table("npz", tables.damaged_npz)),
    "toml": (".toml", _table("toml", tables.damaged_toml)),
    "journal": (".journal", _table("journal", tables.damaged_journal)),
    "urdf": (".urdf", _table("urdf", tables.damaged_urdf)),
    "mjcf": (".xml", _table("mjcf", tables.damaged_mjcf)),
}
"""By kind of file: the suffix, and what makes a damaged one."""
TURNS = (*KINDS, "npz", "toml", "npz")  # the reader with the most to check comes more often


def make_input(seed: int, k: int) -> Input:
    """Return input `k` of `seed`."""
    kind = TURNS[k % len(TURNS)]
    suffix, make = KINDS[kind]
    return Input(kind, suffix, make(random.Random(f"{seed}/{k}")))
