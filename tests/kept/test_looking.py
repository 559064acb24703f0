"""Looking at results reads no file but theirs, starts no program and executes no code."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sphshell_pin.robots.plain_mesh import FORMATS
from tests.fuzz.strangers import mesh_corpus
from tests.kept.looking import looks
from tests.kept.scenes import run
from tests.studies import mostly_studies

pytestmark = pytest.mark.browser  # `render` opens one, where there is one

TRUSTED = ("routine", "built")
WAYS = [name for name in looks("") if name not in TRUSTED]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario and its results."""
    home = tmp_path_factory.mktemp("home")
    results = run(home) / "run.npz"
    # The meshes that show the arm name a pipe: what opens it, in C too, waits for ever.
    pipe = str(home.with_name("pipe")).encode()
    os.mkfifo(pipe)
    with np.load(results) as file:
        arrays = dict(file)
    robots = json.loads(str(arrays["header"]))["origin"]["kept"]["robots"]
    listed = [item for one in robots if one for item in one["meshes"].items()]
    meshes = {Path(name).suffix: digest for name, digest in listed}
    assert {*meshes} == {*FORMATS}
    for suffix, digest in meshes.items():
        content = mesh_corpus(suffix)[0].replace(b"/dev/zero", pipe)
        if suffix == ".obj":
            content = b"#\rmtllib %s\n\x0cmtllib %s\nmtl\\\nlib %s\n" % (pipe, pipe, pipe) + content
        arrays[f"kept.file.{digest}"] = np.frombuffer(content, np.uint8)
    np.savez_compressed(results, **arrays)
    return home


@pytest.fixture(
    scope="module",
    params=mostly_studies(["beside their scenario", "alone"], lambda place: place != "alone"),
)
def seen(home, tmp_path_factory, request):
    """What was noticed while the results were looked at, and what failed."""
    work = tmp_path_factory.mktemp("looking")
    (work / "temporary").mkdir()
    (work / "here").mkdir()
    if request.param == "alone":
        shutil.copytree(home / "results", work / "here" / "run")
        hidden = home.with_name("hidden")
        home.rename(hidden)
    else:
        (work / "here" / "run").symlink_to(home / "results")
    out = work / "noticed.json"
    program, repository = Path(__file__).with_name("looking.py"), Path(__file__).parents[2]
    command = [sys.executable, program, repository, out, home / "all.toml"]
    try:
        more = {"cwd": work / "here", "env": {**os.environ, "TMPDIR": str(work / "temporary")}}
        done = subprocess.run(command, capture_output=True, timeout=500, check=False, **more)
    finally:
        if request.param == "alone":
            hidden.rename(home)
    assert out.exists(), done.stderr.decode()
    noticed: dict[str, dict[str, object]] = json.loads(out.read_text())
    noticed["place"] = {"is": request.param}
    return noticed


def test_looking_reads_nothing_else_and_executes_nothing(seen, home):
    failed, found = seen["failed"], seen["found"]
    if "Chromium" in str(failed.get("render", "")):
        del failed["render"]
    assert {way: failed[way] for way in WAYS if way in failed} == {}
    assert {way: found[way] for way in WAYS if found[way]} == {}
    # The hook hears of a routine, of the process of a xacro file, and of what they read.
    if seen["place"]["is"] == "alone":
        assert "no such file" in str(seen["failed"][TRUSTED[1]])
        return
    routine, built = (str(seen["found"][one]) for one in TRUSTED)
    # Its text, or what an earlier process compiled of it, is read.
    source = home / "routine.py"
    cached = Path(importlib.util.cache_from_source(str(source)))
    assert f"open: {source}'" in routine or f"open: {cached}'" in routine
    assert f"exec: {source}'" in routine
    assert "subprocess.Popen: " in built
    assert f"open: {home / 'all.toml'}" in built
