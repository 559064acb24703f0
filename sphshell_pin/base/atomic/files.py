"""Several files of one folder, written together."""

import contextlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path

from sphshell_pin.base.atomic.folder import AtomicFolder, FolderInUse
from sphshell_pin.errors import ResultError


@contextlib.contextmanager
def held_folder(folder: Path, last: str, inner: Sequence[str] = ()) -> Iterator[AtomicFolder]:
    """Hold a folder, see `AtomicFolder`; ResultError where it cannot be, or another has it."""
    with contextlib.ExitStack() as held:
        try:
            place = held.enter_context(AtomicFolder(folder, last=last, inner=inner))
        except FolderInUse as busy:
            advice = "wait until it ends, or give another folder with --out"
            raise ResultError(folder, f"{busy}: {advice}") from None
        except OSError as error:
            reason = f"the folder cannot be written: {error.strerror}; give another with --out"
            raise ResultError(folder, reason) from error
        yield place


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
    with held_folder(folder, every[0]) as place:
        try:
            staging, names = place.staging(), []
            for name, content in files.items() if isinstance(files, Mapping) else files:
                (staging / name).write_bytes(content)
                names.append(name)
            place.replace(staging, every)
        except OSError as error:
            raise ResultError(folder, f"cannot be written: {error.strerror or error}") from error
    return [folder / name for name in names]
