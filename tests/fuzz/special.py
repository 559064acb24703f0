"""Things that are no regular files, in the place of one that a reader opens."""

import functools
import os
import random
import signal
import socket
import tempfile
from collections.abc import Callable
from pathlib import Path

from tests.fuzz.folders import unpacked
from tests.fuzz.tables import prepare

LONGEST = 60  # [s] until a reader that waits for a pipe is interrupted


def _socket(place: Path) -> None:
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(str(place))


def _huge(place: Path) -> None:
    place.touch()
    os.truncate(place, 1 << 40)  # without blocks on the disk


def _link(target: str) -> Callable[[Path], None]:
    return lambda place: place.symlink_to(target)


def _in_each_other(place: Path) -> None:
    place.with_name("other link").symlink_to(place)
    place.symlink_to("other link")


_WAYS: tuple[Callable[[Path], None], ...] = (
    *(os.mkfifo, Path.mkdir, Path.touch, _socket, _huge, _in_each_other, lambda place: None),
    *map(_link, ("/dev/zero", "/dev/null", "/dev/urandom", "/dev/tty", "/dev/stdin", "/dev/full")),
    *map(_link, ("/proc/self/mem", "/proc/kmsg", "/proc/self/fd/0", ".", "/", "gone", "x" * 200)),
)


def read_special(path: Path) -> None:
    """Read the input of another kind of which one file, drawn by the content, is no regular one."""
    from tests.fuzz.inputs import KINDS

    drawn = path.read_bytes()
    rng = random.Random(drawn)
    names = [name for name in KINDS if not name.startswith(("drawn", "expression"))]
    kinds = [name for name in names if KINDS[name].turns > 1 and name != "special"]
    kind = KINDS[rng.choice([*kinds, "xacro"] if rng.random() < 0.02 else kinds)]
    data, read = rng.choice(kind.corpus()), kind.read
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        home = Path(folder)
        prepare(home)
        whole = home / f"input{kind.suffix}"
        if isinstance(read, functools.partial):  # of an archive
            whole, read = home, read.args[0]
            for name, content in unpacked(data).items():
                (home / name).parent.mkdir(parents=True, exist_ok=True)
                (home / name).write_bytes(content)
        else:
            whole.write_bytes(data)
        if drawn:
            place = rng.choice(sorted(one for one in home.rglob("*") if one.is_file()))
            place.unlink()
            rng.choice(_WAYS)(place)
        # Its handler interrupts a reader that waits.
        before = signal.signal(signal.SIGALRM, signal.default_int_handler)
        signal.alarm(LONGEST)
        try:
            read(whole)
        finally:
            signal.alarm(0)
            signal.signal(signal.SIGALRM, before)
