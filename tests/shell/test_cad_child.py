"""The process in which OpenCASCADE runs: whatever becomes of it, the one that asked goes on."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("OCP")


from sphshell_pin import Shell
from sphshell_pin.errors import InvalidParameter, ShellFileError
from sphshell_pin.shell.cad import process
from sphshell_pin.shell.cad.messages import pack, unpack
from tests.command import call
from tests.shell import cad_shapes as shapes
from tests.tables import cases_of

DAMAGED = sorted((Path(__file__).parents[1] / "data" / "damaged_cad").iterdir())

# It holds the interpreter's lock, as OpenCASCADE does.
HANG = "re.match('(a+)+$', 'a' * 60 + 'b')"
JOBS = cases_of("opencascade_jobs")["jobs"]
"""What a child may do in place of reading a file, and what is told of it."""
MODULE = """
import os, re, signal, sys, types
from sphshell_pin.shell.cad import child
def job(*arguments):
    {job}
def serve(source, target):
    global answers
    answers = target
    name = "sphshell_pin.shell.cad.jobs"
    sys.modules[name] = types.SimpleNamespace(read=job)
    child.require_kernel = lambda purpose: None
    child.serve(source, target)
"""


@pytest.fixture
def box(tmp_path):
    return shapes.write_brep(tmp_path / "box.brep", shapes.box())


def load_with(job, box, monkeypatch, **limits):
    with monkeypatch.context() as patch:
        process._end_idle()
        (box.parent / "own_child.py").write_text(MODULE.format(job=job))
        patch.syspath_prepend(box.parent)
        patch.setattr(process, "CHILD", "own_child")
        Shell.from_file(box, "mm", **limits)


@pytest.mark.parametrize("job", JOBS)
def test_what_becomes_of_the_child_is_told_in_a_sentence(job, box, monkeypatch, capfd):
    limit = 1.0 if job == HANG else 60.0
    with pytest.raises(ShellFileError, match=JOBS[job]) as caught:
        load_with(job, box, monkeypatch, memory_limit=2e8, time_limit=limit)
    assert "\n" not in str(caught.value)
    assert not process._idle  # nobody else gets that child
    assert capfd.readouterr() == ("", "")


def test_files_on_which_opencascade_crashed_or_hung():
    told = "makes OpenCASCADE (crash|fail)|time limit|memory limit|no valid answer"

    def read(path):
        with pytest.raises(ShellFileError, match=told):
            Shell.from_file(path, "mm" if path.suffix == ".brep" else None, time_limit=1.5)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(read, DAMAGED))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_the_child_ends_with_its_parent(number, box, tmp_path):
    """A script without a guard, while the child holds the interpreter's lock for ever."""
    (tmp_path / "own_child.py").write_text(MODULE.format(job=HANG))
    code = f"""
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # jobs in the background ignore it
from sphshell_pin import Shell
from sphshell_pin.shell.cad import process
sys.path.insert(0, {str(tmp_path)!r})
process.CHILD = "own_child"
Shell.from_file({str(box)!r}, "mm")
"""
    parent = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE)
    pid = wait_for(lambda: listed("pid=", "--ppid", parent.pid))
    time.sleep(1.5)  # until it does its job
    os.kill(parent.pid, number)
    assert parent.wait(30) == -number
    assert (b"KeyboardInterrupt" in parent.communicate()[1]) == (number == signal.SIGINT)
    wait_for(lambda: listed("stat=", "-p", pid)[:1] in ("Z", ""))


def listed(*of):
    """Return what ps lists of processes."""
    # Without libraries that sanitizers load first: ps may not end with them.
    bare = {"PATH": os.environ["PATH"]}
    told = subprocess.run(["ps", "-o", *map(str, of)], stdout=-1, text=True, check=False, env=bare)
    return told.stdout.strip()


def wait_for(answer):
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        if found := answer():
            return found
        time.sleep(0.05)
    raise AssertionError("in vain")


def test_a_child_is_used_again_and_by_one_at_a_time(box):
    def load(_=None):
        return Shell.from_file(box, "mm").vertices

    whole = load()
    (first,) = process._idle
    assert np.array_equal(load(), whole)
    assert process._idle == [first]
    with pytest.raises(InvalidParameter, match="unit"):
        Shell.from_file(box)  # the fault of the caller, not of the file
    assert process._idle == [first]
    with ThreadPoolExecutor(2) as pool:
        assert all(np.array_equal(one, whole) for one in pool.map(load, range(2)))
    # A process forked of this one must not talk to its child.
    (idle,) = process._idle
    worker = multiprocessing.get_context("fork").Process(target=load)
    worker.start()
    worker.join(60)
    assert worker.exitcode == 0
    assert idle._process.poll() is None
    assert np.array_equal(load(), whole)


def test_a_relative_path_is_found_from_where_the_caller_is(box, monkeypatch):
    Shell.from_file(box, "mm")
    monkeypatch.chdir(box.parent)
    assert Shell.from_file(box.name, "mm").source == "box.brep"


def test_limits_are_checked_and_told_on_the_command_line(box, tmp_path):
    for name in ("time_limit", "memory_limit"):
        with pytest.raises(InvalidParameter, match=f"{name} = 0 must be positive"):
            Shell.from_file(box, "mm", **{name: 0})
    process._end_idle()  # one that has worked has memory to spare
    to = ["convert", box, tmp_path / "box.stl", "--unit-in", "mm", "--memory-limit", "1"]
    check = ["check", box, "--unit", "mm", "--time-limit", "1e-3"]
    for line, said in ((to, "memory limit of 1e-09 GB"), (check, "time limit of 0.001 s")):
        told = call(*line)
        assert told.exit_code == 2
        assert said in told.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["box.brep"]


def test_damaged_messages_are_noticed():
    message = pack(("done", np.arange(1000.0), Path("a"), (None, 1.5, "x")))
    kind, array, *rest = unpack(message)
    assert (kind, rest) == ("done", [Path("a"), (None, 1.5, "x")])
    assert np.array_equal(array, np.arange(1000.0))
    rng = np.random.default_rng(3)
    for place in rng.integers(len(message), size=200):
        changed = bytearray(message)
        changed[place] ^= 1
        try:
            found = unpack(bytes(changed))
        except ValueError:
            continue
        assert np.array_equal(found[1], array)  # a byte that nobody reads
