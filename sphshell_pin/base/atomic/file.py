"""One file, replaced whole or not at all."""

import contextlib
import errno
import fcntl
import os
import socket
import stat
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from sphshell_pin.base.regular_file import StrPath, open_regular, read_text
from sphshell_pin.errors import ResultError

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


@contextlib.contextmanager
def atomic_file(path: StrPath) -> Iterator[IO[bytes]]:
    """Yield an empty file that replaces the one at `path` if the block ends well.

    Whatever ends the process, `path` holds the old bytes or all of the new ones; after a power cut,
    too. The new file is written as `.NAME.writing` beside the old one. One that a killed process
    left there is written over; another process that writes the same file waits. A symbolic link
    stays, and its target is replaced; a device or pipe is written to directly.

    Raises
    ------
    OSError
        The file cannot be written; nothing is left of the new one.
    """
    with _aside(path, "") as (file, _):
        yield file


@contextlib.contextmanager
def atomic_path(path: StrPath, suffix: str) -> Iterator[Path]:
    """Yield where to write the file, for writers that open it by its name; see `atomic_file`.

    The name ends in `suffix`. The file there is to be written over, not removed.
    """
    with _aside(path, suffix) as (_, part):
        yield part


def write_whole(path: StrPath, data: bytes) -> Path:
    """Write `data` as the file at `path`, in folders that are made; return the path.

    Raises
    ------
    ResultError
        It cannot be written; the file that was there stays.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(path) as file:
            file.write(data)
    except OSError as fault:
        raise ResultError(path, f"cannot be written: {fault.strerror}") from fault
    return path


def check_writable(path: Path) -> None:
    """Raise ResultError unless a file can be written to `path`, in a folder that is made for it.

    It is asked before minutes go into the file's content.
    """
    trial = path.with_name(f".{path.name}.try")
    if path.is_dir():
        raise ResultError(path, "is a folder: give the name of a file")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        trial.touch()
        trial.unlink()
    except OSError as fault:
        raise ResultError(path, f"cannot be written: {fault.strerror}") from None


@contextlib.contextmanager
def _aside(path: StrPath, suffix: str) -> Iterator[tuple[IO[bytes], Path]]:
    target = Path(os.path.realpath(path))
    mode = target.stat().st_mode if target.exists() else None
    if mode is not None and not stat.S_ISREG(mode):
        try:  # a pipe that nobody reads would be waited for, without end
            descriptor = os.open(target, os.O_WRONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as fault:
            if fault.errno == errno.ENXIO:
                fault.strerror = "it is a pipe that nobody reads, or a socket"
            raise
        os.set_blocking(descriptor, True)
        with os.fdopen(descriptor, "wb") as file:
            yield file, target
        return
    # The longest names leave no room for more; files that share a part are written in turn.
    name = target.name[:60]
    part = target.with_name(f".{name}.writing{suffix}")
    descriptor, locked = lock_file(part)
    if not locked:
        # Two processes must not write the same file.
        own = part.with_name(f".{name}.writing-{os.getpid()}{suffix}")
        os.rename(part, own)
        part = own
    with os.fdopen(descriptor, "r+b") as file:
        try:
            file.truncate(0)
            yield file, part
            file.flush()
            if mode is not None:
                os.chmod(part, stat.S_IMODE(mode))
            os.fsync(file.fileno())
            os.replace(part, target)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(part)
            raise
    sync_folder(target.parent)


def sync_file(path: Path) -> None:
    """Make the contents of a file outlast a power cut."""
    with open_regular(path) as file:
        os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Make the names in a folder outlast a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as fault:
        if fault.errno not in (errno.EINVAL, errno.EBADF, errno.EOPNOTSUPP):
            raise  # else a file system that knows no such thing
    finally:
        os.close(descriptor)
