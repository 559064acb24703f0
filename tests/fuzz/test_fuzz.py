"""Damaged files are read or refused in a sentence; every file that ever broke a reader is here."""

import os
import shutil
import sys
import time
from pathlib import Path

import pytest

from tests.fuzz import cad, folders, tables
from tests.fuzz.inputs import KINDS, TURNS, make_input, read
from tests.fuzz.tables import prepare
from tests.fuzz.watch import Report, Task, watch

BROKE = sorted((Path(__file__).parents[1] / "data" / "fuzz").iterdir())


@pytest.mark.parametrize("file", BROKE, ids=lambda file: file.name)
def test_a_file_that_once_broke_its_reader(file, tmp_path):
    prepare(tmp_path)
    path = Path(shutil.copy(file, tmp_path / f"input{''.join(file.suffixes)}"))
    assert read(path) in ("read", "refused")


@pytest.mark.parametrize("kind", KINDS)
def test_undamaged_files_are_read(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(cad, "LIMIT", 300.0)
    prepare(tmp_path)
    for data in KINDS[kind].corpus():
        path = tmp_path / f"input{KINDS[kind].suffix}"
        path.write_bytes(data)
        assert read(path) == "read"


@pytest.mark.parametrize(
    ("files", "seconds"),
    [(500, 600.0), pytest.param(sys.maxsize, 60.0, marks=pytest.mark.study)],
    ids=["500 files", "a minute"],
)
def test_damaged_files_break_no_reader(files, seconds):
    report = Report()
    watch(Task(seed=20, first=0, last=files, until=time.time() + seconds), report)
    assert report.failures == []
    assert sum(report.counts.values()) >= 500


def test_two_numbers_give_the_same_file():
    some = range(0, len(TURNS), 3)
    before = [make_input(3, k).data for k in some]
    for made in (folders.results_corpus, tables.npz_corpus):
        made.cache_clear()  # as another process would make them
    assert [make_input(3, k).data for k in some] == before
    assert len(set(before)) > 0.9 * len(some)


def stumble(path: Path) -> str:
    """Read a file as no reader should."""
    seen = path.with_name("seen")
    number = seen.stat().st_size if seen.exists() else 0
    with open(seen, "a") as file:
        file.write(".")
    if number == 1:
        raise KeyError("no error of the package")
    if number == 2:
        bytearray(4 << 30)
    if number == 3:
        os.abort()
    while number == 4:
        pass
    return "read"


def test_the_watch_notices_what_a_reader_must_not_do():
    report, reader = Report(), "tests.fuzz.test_fuzz:stumble"
    task = Task(1, 0, 7, time.time() + 600.0, ("stl",), reader, hang=1.0)
    watch(task, report, lambda failure: False)
    reasons = {one.k: one.why.partition(":")[0] for one in report.failures}
    assert reasons == {1: "KeyError", 2: "MemoryError", 3: "crash", 4: "hang"}
    assert "stumble" in report.failures[3].details
