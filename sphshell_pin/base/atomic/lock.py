"""Locks on files; the kernel releases them when their process ends, however it ends."""

import errno
import fcntl
import os
import socket
import time
from pathlib import Path

from sphshell_pin.base.regular_file import read_text

# Errors of file systems without locks, such as Lustre as it is often mounted.
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL, errno.EBADF}


def lock_file(path: Path, *, wait: bool = True) -> tuple[int, bool]:
    """Open the file at `path`, made if it is not there, and lock it.

    Returns the descriptor, and whether it is locked: not so on a file system without locks.

    Raises
    ------
    BlockingIOError
        Another process has the lock, unless `wait`.
    OSError
        The file cannot be opened.
    """
    # No link of somebody else's in a shared folder may lead to the file.
    flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
    operation = fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB)
    while True:
        descriptor = os.open(path, flags, 0o666)
        try:
            fcntl.flock(descriptor, operation)
            # The holder before may have removed or renamed it: then others lock a new one.
            if _is_at(descriptor, path):
                return descriptor, True
        except OSError as fault:
            if fault.errno in _NO_LOCKS:
                return descriptor, False
            os.close(descriptor)
            raise
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def sign(descriptor: int) -> None:
    """Write into a locked file who has it, and since when."""
    text = f"{os.getpid()} {socket.gethostname()} {time.strftime('%Y-%m-%d %H:%M:%S')}\n"
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, text.encode(), 0)


def holder(path: Path) -> str:
    """Say who signed the lock at `path`: "process 12 since 2026-01-02 03:04:05"."""
    try:
        process, host, since = read_text(path).strip().split(" ", 2)
    except (OSError, ValueError):
        return "another process"  # which has not signed yet
    where = "" if host == socket.gethostname() else f" on {host}"
    return f"process {process}{where}, since {since},"


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path))
    except FileNotFoundError:
        return False
