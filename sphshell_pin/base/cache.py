"""Files that can be made again, kept between processes: compiled robots, surfaces of CAD files."""

import contextlib
import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path

CACHE = "SPHSHELL_PIN_CACHE"
"""Environment variable with another folder, empty for none; by default it is sphshell-pin in that
of XDG for caches."""


def cache_folder(kind: str) -> Path | None:
    """Return the folder for files of one `kind`, made if need be; None where there can be none.

    It belongs to the user; nobody else but root may write to it, or put another in its place.
    """
    given, xdg = os.environ.get(CACHE), os.environ.get("XDG_CACHE_HOME", "")
    if given == "":
        return None
    try:
        usual = Path(xdg) if os.path.isabs(xdg) else Path.home() / ".cache"
        root = Path(given).absolute() if given else usual / "sphshell-pin"
        folder = root / kind
        for one in (root, folder):
            one.mkdir(mode=0o700, parents=True, exist_ok=True)
        above = all(map(_keeps_names, root.resolve().parents))
    except (OSError, RuntimeError):  # no permission; no home
        return None
    own = is_own(root, stat.S_ISDIR) and is_own(folder, stat.S_ISDIR)
    return folder if above and own else None


def _keeps_names(folder: Path) -> bool:
    """Whether nobody but this user and root can rename what this user has in `folder`."""
    about = os.stat(folder)
    # The group of a user alone may write to the user's folders (umask 002).
    others = 0o002 if about.st_gid == os.getgid() else 0o022
    closed = not about.st_mode & others or about.st_mode & stat.S_ISVTX
    return bool(closed) and about.st_uid in (0, os.getuid())


def is_own(path: Path, kind: Callable[[int], bool] = stat.S_ISREG) -> bool:
    """Whether `path` is a file (of this `kind`), no link, that only this user can have written."""
    try:
        found = os.lstat(path)
    except OSError:
        return False
    return kind(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


def write_own(path: Path, data: bytes) -> None:
    """Write `data` as the file at `path`, which only this user may write, whole or not at all."""
    descriptor, made = tempfile.mkstemp(dir=path.parent)
    try:
        with open(descriptor, "wb") as file:
            file.write(data)
        os.replace(made, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(made)
        raise


def keep_newest(folder: Path, most: int) -> None:
    """Remove the files of `folder` that were used longest ago beyond `most` bytes."""
    used = []
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            with contextlib.suppress(OSError):
                about = entry.stat(follow_symlinks=False)
                used.append((about.st_mtime_ns, about.st_size, entry.path))
    room = most
    for _, size, path in sorted(used, reverse=True):
        room -= size
        if room < 0:
            with contextlib.suppress(OSError):
                os.unlink(path)


def mark_used(path: Path) -> None:
    """Make `path` the newest of its folder."""
    with contextlib.suppress(OSError):
        os.utime(path)
