"""Children that read files of strangers are confined by the kernel, where Linux has the means."""

import json
import os
import platform
import re
import socket
import subprocess
import tomllib
from pathlib import Path

import pytest

from sphshell_pin.base import sandbox
from sphshell_pin.base.limits import child_command
from tests.texts import text_of

CHILD = """
import ctypes, json, os, resource, signal, socket, threading
libc = ctypes.CDLL(None, use_errno=True)
def call(*arguments):
    if libc.syscall(*map(ctypes.c_long, arguments)) < 0:
        raise {1: PermissionError, 38: PermissionError}.get(ctypes.get_errno(), RuntimeError)
def thread():
    found = []
    one = threading.Thread(target=lambda: found.append(1))
    one.start()
    one.join()
    return found[0]
def serve(source, target):
    request, answer = json.load(open(source)), {}
    for name, attempt in request["attempts"].items():
        try:
            answer[name] = repr(eval(attempt, globals() | request["names"]))
        except Exception as error:
            answer[name] = type(error).__name__
    os.write(target, json.dumps(answer).encode())
"""
ATTEMPTS = tomllib.loads(text_of("sandbox/attempts.toml"))
REFUSED, ALLOWED = ATTEMPTS["refused"], ATTEMPTS["allowed"]


def confined() -> bool:
    return platform.system() == "Linux" and platform.machine() in sandbox._ARCHITECTURES


@pytest.mark.skipif(not confined(), reason="the kernel, or its filter of calls, is another")
def test_a_child_computes_and_reads_and_does_nothing_else(tmp_path, monkeypatch):
    (tmp_path / "own_child.py").write_text(CHILD)
    monkeypatch.syspath_prepend(tmp_path)
    folder = tmp_path / "folder"
    (folder / "empty").mkdir(parents=True)
    old, new = folder / "old", folder / "new"
    old.write_text("precious")
    about = old.stat()
    with socket.create_server(("127.0.0.1", 0)) as server:
        names = {"port": server.getsockname()[1], "folder": str(folder), "old": str(old)}
        names |= {"new": str(new), "empty": str(folder / "empty")}
        request = json.dumps({"attempts": REFUSED | ALLOWED, "names": names})
        done = subprocess.run(
            child_command("own_child"), input=request.encode(), capture_output=True, check=True
        )
    refused = dict.fromkeys(REFUSED, "PermissionError") | {"command": "ValueError"}
    allowed = ("'precious'", repr(os.listdir(folder)), "1", "None", "5")
    assert json.loads(done.stdout) == refused | dict(zip(ALLOWED, allowed, strict=True))
    assert sorted(one.name for one in folder.iterdir()) == ["empty", "old"]
    assert (old.read_text(), old.stat().st_mode) == ("precious", about.st_mode)
    assert old.stat().st_mtime == about.st_mtime


@pytest.mark.parametrize(
    ("header", "column", "names"),
    [
        ("x86_64-linux-gnu/asm/unistd_64.h", 0, {}),
        ("asm-generic/unistd.h", 1, {"newfstatat": "3264_fstatat"}),
    ],
)
def test_the_numbers_of_system_calls_are_those_of_the_kernel(header, column, names):
    file = Path("/usr/include") / header
    if not file.exists():
        pytest.skip("the kernel's headers are not there")
    pairs = re.findall(r"#define __NR_?(\w+)\s+(\d+)\s", file.read_text())
    known = {name.removeprefix("_"): number for name, number in pairs}
    for name, *numbers in zip(*[iter(sandbox._CALLS.split())] * 3, strict=True):
        theirs = known.get(name, known.get(f"3264_{name}", known.get(names.get(name, ""), "-")))
        assert numbers[column] == theirs, name
