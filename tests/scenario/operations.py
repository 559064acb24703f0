"""End a process at its n-th file operation, for every n, and look at what is left.

The list of operations is not written by hand: a hook of the interpreter's audit events counts every
file opened for writing and every change of a name, and the calls without an event are wrapped.
"""

import contextlib
import errno
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

CHANGES = {
    "os.chmod", "os.chown", "os.link", "os.mkdir", "os.remove", "os.rename", "os.rmdir",
    "os.symlink", "os.truncate", "os.utime", "os.setxattr", "fcntl.flock", "ctypes.dlsym",
}  # fmt: skip
"""Audit events of changes of files; the exchange of names is called through ctypes."""
UNHEARD = ("fsync", "pwrite", "ftruncate")
"""Functions of os that change a file without an audit event."""
# What a full disk refuses; names can still be removed and exchanged there.
_TAKES_ROOM = {"open", "os.mkdir", "os.link", "os.symlink", *UNHEARD}

Act = Callable[[str], object]


def kill(_: str) -> None:
    """End this process as SIGKILL, a crash or a power cut does."""
    os.kill(os.getpid(), signal.SIGKILL)


def fill(event: str) -> None:
    """Let nothing be written, as on a full disk."""
    if event in _TAKES_ROOM:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


_counts: list[Callable[[str], None]] = []
_hooked = False


def _hear(event: str, arguments: tuple[object, ...]) -> None:
    if not _counts:
        return
    writes = (
        event == "open"
        and not isinstance(arguments[0], int)  # a file that is open already
        and isinstance(arguments[2], int)
        and (arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))
    )
    if writes or event in CHANGES:
        _counts[-1](event)


@contextlib.contextmanager
def counted(n: int, act: Act, *, once: bool = True) -> Iterator[list[str]]:
    """Do `act` before the n-th file operation of the block, and unless `once` before all later.

    Yields the list of the operations, which fills.
    """
    global _hooked  # noqa: PLW0603
    heard: list[str] = []

    def count(event: str) -> None:
        heard.append(event)
        if len(heard) == n or (len(heard) > n and not once):
            act(event)

    def heard_too(name: str) -> Callable[..., object]:
        real = getattr(os, name)

        def call(*arguments: object) -> object:
            count(name)
            return real(*arguments)

        return call

    if not _hooked:
        sys.addaudithook(_hear)  # for the life of the process
        _hooked = True
    real = {name: getattr(os, name) for name in UNHEARD}
    for name in UNHEARD:
        setattr(os, name, heard_too(name))
    _counts.append(count)
    try:
        yield heard
    finally:
        _counts.pop()
        for name, function in real.items():
            setattr(os, name, function)


def killed_at(n: int, write: Callable[[], object]) -> bool:
    """Call `write` in a copy of this process that is killed at its n-th file operation.

    Returns False where it has fewer.
    """
    child = os.fork()
    if child == 0:
        try:
            with counted(n, kill):
                write()
        except BaseException as fault:
            print(f"{type(fault).__name__}: {fault}", file=sys.stderr, flush=True)
            os._exit(1)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        assert os.WTERMSIG(status) == signal.SIGKILL, status
        return True
    assert status == 0, f"operation {n}: it failed, see above"
    return False


def contents(folder: Path) -> dict[str, bytes]:
    """Return every file below `folder` by its name, hidden ones as well."""
    files = filter(Path.is_file, sorted(folder.rglob("*")))
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def visible(folder: Path) -> dict[str, bytes]:
    """Return every file below `folder` that is not hidden."""
    found = contents(folder)
    return {name: data for name, data in found.items() if not f"/{name}".count("/.")}
