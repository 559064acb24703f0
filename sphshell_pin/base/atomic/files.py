"""Several files of one folder, written together."""

import contextlib
import ctypes
import errno
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.atomic.file import holder, lock_file, sign, sync_file, sync_folder
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.errors import ResultError

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2  # Linux
_RENAME_SWAP = 2  # macOS


def exchange(one: Path, other: Path) -> None:
    """Exchange the names of two folders of one file system, without a state in between.

    Raises
    ------
    OSError
        System or file system cannot do it (NFS, FAT, ...), or the folders may not be renamed.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    names = os.fsencode(one), os.fsencode(other)
    try:
        if sys.platform == "darwin":
            failed = libc.renamex_np(*names, _RENAME_SWAP)
        else:
            failed = libc.renameat2(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE)
    except AttributeError:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS)) from None
    if failed:
        fault = ctypes.get_errno()
        raise OSError(fault, os.strerror(fault), str(other))


# Another process can remove the parent that long between two steps of this one.
_MOST_TRIES = 100


class FolderInUse(OSError):
    """Another process is writing the folder; the text says which and since when."""


class AtomicFolder:
    """The folder at `path`, locked by this process while the `with` block lasts.

    It is made if it does not exist, and removed again if the block leaves it empty. At the
    beginning, what a killed process left is removed.

    Parameters
    ----------
    path : of the folder; of a symbolic link its target is meant.
    last : name of the file that says that the others are complete. Where files are replaced one by
        one, it is removed first and written last.

    Raises
    ------
    FolderInUse
        Another process has locked it.
    OSError
        It cannot be made or written.
    """

    def __init__(self, path: StrPath, *, last: str) -> None:
        self._folder = Path(os.path.realpath(path))
        self._last = last
        self._made: list[Path] = []
        self._lock: tuple[Path, int] | None = None
        # Without a lock it is unknown whether another process has ended: its files are left alone.
        self._suffix = ""

    def __enter__(self) -> Self:
        try:
            self._take()
            with tempfile.TemporaryFile(dir=self._folder):
                pass
            self._clear()
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        fault: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            # What cannot be cleared away now is so by the next process.
            with contextlib.suppress(OSError):
                self._clear()
        finally:
            self._end()

    def staging(self) -> Path:
        """Make the empty folder for the new files, and return it."""
        beside, inside = self._places()
        if self._may_leave():
            with contextlib.suppress(OSError):  # the parent cannot be written
                beside.mkdir()
                return beside
        inside.mkdir()
        return inside

    def write(self, files: Iterable[tuple[str, bytes]], old: Iterable[str]) -> list[str]:
        """Write `files`, names and contents, in place of `old`, see `replace`; return their names.

        Raises ResultError where they cannot be written; the old ones stay.
        """
        names = []
        try:
            staging = self.staging()
            for name, content in files:
                (staging / name).write_bytes(content)
                names.append(name)
            self.replace(staging, old)
        except OSError as error:
            reason = f"cannot be written: {error.strerror or error}"
            raise ResultError(self._folder, reason) from error
        return names

    def replace(self, staging: Path, old: Iterable[str]) -> None:
        """Replace the files called `old` by all files of the `staging`; other files stay.

        A reader sees all old files or all new ones at any time, and every other file, unless the
        folder cannot be exchanged: a mount point, the working directory, a folder whose parent
        cannot be written, one with subfolders, or one on a file system without the exchange of
        names or without hard links. There the files are replaced one by one, and `last` is missing
        meanwhile, for ever if the process is killed then.

        Raises
        ------
        OSError
            The files cannot be put there; the old ones stay.
        """
        for left in staging.glob(".*.writing"):  # an `atomic_file` that Ctrl-C ended at its start
            left.unlink()
        new = sorted(os.listdir(staging))
        ours = {*new, *old}
        for name in ours:
            if (self._folder / name).is_dir():
                raise IsADirectoryError(errno.EISDIR, f"{name} there is a folder")
        for name in new:
            sync_file(staging / name)
        with interrupts_delayed():
            if staging.parent != self._folder and self._exchange(staging, ours):
                _bring_back(staging, self._folder, ours)
                sync_folder(self._folder.parent)
            else:
                self._move_in(staging, new, ours)

    def _exchange(self, staging: Path, ours: set[str]) -> bool:
        """Exchange the two folders, the files of others in both; whether that was possible."""
        try:
            self._link_others(staging, ours)
            sync_folder(staging)
            exchange(staging, self._folder)
        except OSError:
            return False
        return True

    def _move_in(self, staging: Path, new: Sequence[str], ours: set[str]) -> None:
        """Move the new files into the folder, one by one, and remove the others of `ours`."""

        def flush() -> None:
            with contextlib.suppress(OSError):  # a full disk: the names change all the same
                sync_folder(self._folder)

        (self._folder / self._last).unlink(missing_ok=True)
        flush()
        for name in ours.difference(new):
            (self._folder / name).unlink(missing_ok=True)
        for name in sorted(new, key=lambda name: name == self._last):
            if name == self._last:
                flush()
            os.replace(staging / name, self._folder / name)
        flush()

    def _take(self) -> None:
        """Lock the folder, then make it: only its holder makes it, and removes it again."""
        folder = self._folder
        for tries_left in reversed(range(_MOST_TRIES)):
            try:
                self._make(folder.parent)
                try:
                    self._lock_by(folder.parent / f".{folder.name}.lock")
                except (FolderInUse, FileNotFoundError):
                    raise
                except OSError:  # the parent cannot be written
                    self._make(folder)
                    self._lock_by(folder / ".lock")
                break
            except FileNotFoundError:
                # Another process has just removed the parent, which it had made in vain.
                if not tries_left:
                    raise
        self._make(folder)

    def _lock_by(self, path: Path) -> None:
        """Lock the folder by the file at `path`."""
        try:
            descriptor, locked = lock_file(path, wait=False)
        except BlockingIOError:
            raise FolderInUse(f"{holder(path)} is writing it") from None
        self._lock = path, descriptor
        self._suffix = "" if locked else f"-{os.getpid()}"
        sign(descriptor)

    def _make(self, folder: Path) -> None:
        """Make a folder and its parents; remember those that this process made."""
        for one in reversed((folder, *folder.parents)):
            if not one.exists():
                with contextlib.suppress(FileExistsError):
                    one.mkdir()
                    self._made.append(one)

    def _end(self) -> None:
        """Remove the folder if it was made in vain, and unlock it."""
        try:
            if self._lock is not None:
                path, descriptor = self._lock
                self._lock = None
                if path.parent != self._folder and self._folder in self._made:
                    # While it is locked: afterwards it may be another process's.
                    try:
                        self._folder.rmdir()
                        self._made.pop()
                    except OSError:
                        self._made.clear()
                try:
                    with contextlib.suppress(OSError):
                        os.unlink(path)
                finally:
                    os.close(descriptor)
        finally:
            with contextlib.suppress(OSError):
                while self._made:
                    self._made.pop().rmdir()  # fails where something is in it

    def _places(self) -> tuple[Path, Path]:
        """Return the folders in which the new files may be made: beside, and inside."""
        name = f"writing{self._suffix}"
        return self._folder.parent / f".{self._folder.name}.{name}", self._folder / f".{name}"

    def _may_leave(self) -> bool:
        """Whether the folder may be exchanged, as far as is known beforehand."""
        parent = self._folder.parent
        if os.path.ismount(self._folder) or os.stat(parent).st_dev != os.stat(self._folder).st_dev:
            return False
        with contextlib.suppress(OSError):  # a working directory that was removed
            return not Path.cwd().is_relative_to(self._folder)
        return True

    def _clear(self) -> None:
        """Remove what this process or a killed one left."""
        for place in self._places():
            if _is_left(place):
                shutil.rmtree(place)

    def _link_others(self, target: Path, ours: set[str]) -> None:
        """Link all files of the folder but `ours` into `target`, which becomes like it.

        OSError for a subfolder: it may be large, or a working directory.
        """
        about = os.stat(self._folder)
        os.chown(target, about.st_uid, about.st_gid)
        shutil.copystat(self._folder, target)
        for entry in os.scandir(self._folder):
            if entry.name not in ours:
                if entry.is_dir(follow_symlinks=False):
                    raise OSError(f"{entry.path} is a folder of others")
                os.link(entry, target / entry.name, follow_symlinks=False)


def _is_left(place: Path) -> bool:
    """Whether a process of this user left a folder there, not somebody else in a shared folder."""
    try:
        about = os.lstat(place)
    except OSError:
        return False
    return stat.S_ISDIR(about.st_mode) and about.st_uid == os.geteuid()


def _bring_back(left: Path, folder: Path, ours: set[str]) -> None:
    """Remove the folder `left`; what in it is not `ours`, nor in `folder`, moves there.

    Others may have written into it until the moment of the exchange.
    """
    for entry in list(os.scandir(left)):
        there = folder / entry.name
        if entry.name in ours or _is_older(entry, there):
            os.unlink(entry)
        else:
            os.rename(entry, there)
    os.rmdir(left)


def _is_older(entry: os.DirEntry[str], there: Path) -> bool:
    """Whether the file is also `there`, the same or a newer one."""
    try:
        found = os.lstat(there)
    except FileNotFoundError:
        return False
    mine = entry.stat(follow_symlinks=False)
    return os.path.samestat(mine, found) or mine.st_mtime_ns <= found.st_mtime_ns


@contextlib.contextmanager
def held_folder(folder: Path, last: str) -> Iterator[AtomicFolder]:
    """Hold a folder, see `AtomicFolder`; ResultError where it cannot be, or another has it."""
    with contextlib.ExitStack() as held:
        try:
            place = held.enter_context(AtomicFolder(folder, last=last))
        except FolderInUse as busy:
            advice = "wait until it ends, or give another folder with --out"
            raise ResultError(folder, f"{busy}: {advice}") from None
        except OSError as error:
            reason = f"the folder cannot be written: {error.strerror}; give another with --out"
            raise ResultError(folder, reason) from error
        yield place


def write_folder(
    folder: StrPath, files: Mapping[str, bytes] | Iterable[tuple[str, bytes]], every: Sequence[str]
) -> list[Path]:
    """Write `files`, names and contents, into `folder`, all or none; return their paths.

    `every` are the names of all that an earlier call may have left there, which are replaced; the
    first of them is written in any case. ResultError where the folder cannot be written.
    """
    with held_folder(Path(folder), every[0]) as place:
        given = files.items() if isinstance(files, Mapping) else files
        return [Path(folder) / name for name in place.write(given, every)]
