"""Children that read files of strangers are confined by the kernel, where Linux has the means."""

import json
import os
import platform
import re
import socket
import subprocess
from pathlib import Path

import pytest

from sphshell_pin.base import sandbox
from sphshell_pin.base.limits import child_command

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
REFUSED = {
    "write": "open(old, 'w')",
    "append": "open(old, 'a')",
    "write without a name": "os.open(folder, os.O_TMPFILE | os.O_RDWR)",
    "truncate": "os.truncate(old, 0)",
    "unlink": "os.unlink(old)",
    "rename": "os.rename(old, new)",
    "link": "os.link(old, new)",
    "symlink": "os.symlink(old, new)",
    "mkdir": "os.mkdir(new)",
    "rmdir": "os.rmdir(empty)",
    "pipe": "os.mkfifo(new)",
    "mode": "os.chmod(old, 0)",
    "times": "os.utime(old, (0, 0))",
    "attribute": "os.setxattr(old, 'user.a', b'1')",
    "connect": "socket.create_connection(('127.0.0.1', port))",
    "datagram": "socket.socket(socket.AF_INET, socket.SOCK_DGRAM)",
    "local socket": "socket.socket(socket.AF_UNIX)",
    "pair": "socket.socketpair()",
    "exec": "os.execv('/bin/sh', ['sh', '-c', 'echo > ' + new])",
    "exec of memory": "os.memfd_create('a')",
    "fork": "os.fork()",
    "command": "[os.system('echo > ' + new)].index(0)",
    "signal": "os.kill(os.getppid(), 0)",
    "limits of another": "resource.prlimit(os.getppid(), resource.RLIMIT_CORE, (0, 0))",
    "trace": "call(101, 16, os.getppid(), 0, 0)",
    "memory of another": "open(f'/proc/{os.getppid()}/mem', 'r+b')",
    "ring": "call(425, 8, 0)",
    "open in another way": "call(437, -100, 0, 0, 0)",
    "clone3": "call(435, 0, 0)",
    "owner of a pipe": "call(72, 1, 8, os.getppid())",
    "the other numbers of x86-64": "call(0x40000000 | 39)",
}
ALLOWED = {
    "read": "open(old).read()",
    "list": "os.listdir(folder)",
    "thread": "thread()",
    "own signal": "os.kill(os.getpid(), 0)",
    "time": "len(os.times())",
}


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
