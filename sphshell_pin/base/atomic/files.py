"""Several files of one folder, written together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path

from sphshell_pin.base.atomic.folder import AtomicFolder, FolderInUse
from sphshell_pin.errors import ResultError


def write_folder(
    folder: str | PathLike[str],
    files: Mapping[str, bytes] | Iterable[tuple[str, bytes]],
    every: Sequence[str],
) -> list[Path]:
    """Write `files`, names and contents, into `folder`, all or none; return their paths.

    `every` are the names of all that an earlier call may have left there, which are replaced; the
    first of them is written in any case. ResultError where the folder cannot be written.
    """
    folder = Path(folder)
    try:
        with AtomicFolder(folder, last=every[0]) as place:
            staging, names = place.staging(), []
            for name, content in files.items() if isinstance(files, Mapping) else files:
                (staging / name).write_bytes(content)
                names.append(name)
            place.replace(staging, every)
    except FolderInUse as busy:
        raise ResultError(folder, f"{busy}: wait until it ends, or give another folder") from None
    except OSError as error:
        raise ResultError(folder, f"cannot be written: {error.strerror or error}") from error
    return [folder / name for name in names]
