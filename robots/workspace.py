"""The robots in a folder: files that describe one, with what they need."""

import os
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from sphshell_pin.base.regular_file import open_regular
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots.files import build_model, read
from sphshell_pin.robots.inertia import mass_fault
from sphshell_pin.robots.packages import NAMED_ROBOT

_MOST_FOLDERS, _MOST_FILES = 5000, 60
_HEAD = 4000  # beginnings of files [bytes]


@dataclass(frozen=True)
class FoundRobot:
    """A robot's file: its joints, the frames that carry no other, what is missing."""

    file: Path
    joints: int = 0
    frames: tuple[str, ...] = ()
    missing: str = ""
    """A sentence; empty if nothing is."""


def find_robots(folder: str | PathLike[str]) -> Iterator[FoundRobot]:
    """Yield the robots of the URDF, xacro and MJCF files in `folder` and below."""
    for file in _candidates(Path(folder)):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                description = read(file)
                if not description.is_mjcf and description.root.find("link") is None:
                    continue  # macros alone
                model = build_model(description, mimic=True)
        except SphshellError as error:
            yield FoundRobot(file, missing=str(error).removeprefix(f"{file}: "))
            continue
        if not model.nv:
            continue
        carriers = {int(one.parentFrame) for one in model.frames}
        frames = [
            one.name
            for k, one in enumerate(model.frames)
            if one.parentJoint > 0 and k not in carriers
        ]
        fault = mass_fault(model, description.q0(model), description) or ""
        fault = "masses: --density 2700" if "--density" in fault else fault
        yield FoundRobot(file, model.njoints - 1, tuple(frames), fault)


def _candidates(folder: Path) -> Iterator[Path]:
    count = 0
    for depth, (place, folders, files) in enumerate(os.walk(folder)):
        if depth > _MOST_FOLDERS:
            return
        folders[:] = sorted(one for one in folders if not one.startswith("."))
        for name in sorted(files):
            file = Path(place, name)
            if file.suffix not in (".urdf", ".xacro", ".xml") or "macro" in name:
                continue
            try:
                with open_regular(file) as opened:
                    head = opened.read(_HEAD)
            except OSError:
                continue
            if NAMED_ROBOT.search(head) and count < _MOST_FILES:
                count += 1
                yield file
