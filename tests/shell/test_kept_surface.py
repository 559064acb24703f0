"""Surfaces of CAD files in the cache: the same, or read again."""

import os
import shutil
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from sphshell_pin.base.cache import CACHE, cache_folder, keep_newest
from sphshell_pin.errors import UnitWarning
from sphshell_pin.shell import shell as loading
from sphshell_pin.shell.cad import CadOptions
from sphshell_pin.shell.cleaned import CleanedSurface

pytest.importorskip("OCP")

PART = Path(__file__).parents[2] / "scenarios/surfaces/blade.step"


@pytest.fixture
def reads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The files that OpenCASCADE reads; the cache is in tmp_path."""
    monkeypatch.setenv(CACHE, str(tmp_path / "cache"))
    done: list[str] = []
    usual = loading.run_in_child

    def counted(*args: object, **options: object) -> object:
        done.append(str(args[2]))
        return usual(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(loading, "run_in_child", counted)
    return done


def load(path: Path, unit: str | None = None, **options: float) -> CleanedSurface:
    return loading.load_surface(path, unit, None, CadOptions(**options), 0.5)[0]  # type: ignore[arg-type]


def same(one: CleanedSurface, other: CleanedSurface) -> bool:
    def equal(a: object, b: object) -> bool:
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
            return a.dtype == b.dtype and np.array_equal(a, b)
        return type(a) is type(b) and a == b

    return all(equal(getattr(one, f.name), getattr(other, f.name)) for f in fields(CleanedSurface))


def test_the_second_reading_needs_no_child_and_gives_the_same(reads, tmp_path):
    part = shutil.copy(PART, tmp_path / "part.step")
    first, second = load(part), load(part)
    assert same(first, second)
    assert len(reads) == 1
    # What is asked for, and what is in the file, decide.
    assert not same(load(part, chord_error=1e-3), first)
    part.write_text(part.read_text().replace("DATA;", "DATA;\n/* again */", 1))
    load(part)
    assert len(reads) == 3
    # A limit of time does not change the answer.
    load(part, time_limit=100.0)
    assert len(reads) == 3


def test_what_is_damaged_or_foreign_is_read_again(reads: list[str], tmp_path: Path) -> None:
    first = load(PART)
    (kept,) = (tmp_path / "cache/surfaces").iterdir()
    data = kept.read_bytes()
    flipped = bytearray(data)
    flipped[len(data) // 2] ^= 1
    for count, bad in enumerate((b"", data[:-1], bytes(flipped)), start=2):
        kept.write_bytes(bad)
        assert same(load(PART), first)
        assert len(reads) == count
    kept.chmod(0o666)  # others could have written it
    load(PART)
    kept.unlink()
    kept.symlink_to(shutil.copy(PART, tmp_path / "elsewhere"))
    load(PART)
    assert len(reads) == 6


def test_a_warning_of_the_first_reading_is_given_again(reads: list[str]) -> None:
    for _ in range(2):
        with pytest.warns(UnitWarning, match="unit 'm' as stated, though the file's header"):
            load(PART, unit="m")
    assert len(reads) == 1


def test_files_that_others_of_the_group_may_write_by_default_are_kept(reads: list[str]) -> None:
    """With the umask 002 of many systems new files belong to the group."""
    before = os.umask(0o002)
    try:
        load(PART)
    finally:
        os.umask(before)
    load(PART)
    assert len(reads) == 1


def test_without_a_folder_nothing_is_kept(reads, tmp_path, monkeypatch):
    open_to_all = tmp_path / "open"
    own_in_open = open_to_all / "own"
    own_in_open.mkdir(mode=0o700, parents=True)
    open_to_all.chmod(0o777)
    for folder in ("", "/proc/none", str(open_to_all), str(own_in_open)):
        monkeypatch.setenv(CACHE, folder)
        load(PART)
    assert len(reads) == 4
    open_to_all.chmod(0o1777)  # as /tmp: there nobody renames what others have
    assert cache_folder("x") == own_in_open / "x"


def test_the_oldest_go(tmp_path: Path) -> None:
    for k in range(5):
        (tmp_path / str(k)).write_bytes(bytes(100))
        os.utime(tmp_path / str(k), (k, k))
    (tmp_path / "link").symlink_to("0")  # itself it is new, and small
    keep_newest(tmp_path, 250)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["3", "4", "link"]
