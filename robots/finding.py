"""Where robots are found: by names of the package robot_descriptions, and in a folder."""

import os
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from sphshell_pin.base.regular_file import StrPath, open_regular
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots.files import RobotError, build_model, read
from sphshell_pin.robots.inertia import mass_fault
from sphshell_pin.robots.packages import NAMED_ROBOT

_PACKAGE = "robot_descriptions"


class Source(NamedTuple):
    """Where a robot's file is, with the folders of its packages and arguments of a xacro."""

    file: Path
    folders: tuple[str, ...]
    xacro_args: Mapping[str, object] | None


def is_library_name(name: object) -> bool:
    """Whether `name` is meant as one of robot_descriptions, such as ur5e_description."""
    return isinstance(name, str) and name.isidentifier() and name.endswith("_description")


def library_source(name: str) -> Source:
    """Return the files of a robot of robot_descriptions, which may download them.

    Raises SphshellError without the package, and RobotError for a robot that it does not have or
    cannot bring.
    """
    if find_spec(_PACKAGE) is None:
        raise SphshellError(
            f"the robot '{name}' is one of the package {_PACKAGE}: pip install {_PACKAGE}, or give "
            "the robot's own file"
        )
    if find_spec(f"{_PACKAGE}.{name}") is None:
        raise RobotError(f"the package {_PACKAGE} has no robot '{name}': python -m {_PACKAGE} list")
    try:
        module = import_module(f"{_PACKAGE}.{name}")
    except Exception as error:  # it clones a repository
        reason = " ".join(str(error).split()) or type(error).__name__
        raise RobotError(f"{_PACKAGE} cannot bring the robot '{name}': {reason}") from None
    paths = [getattr(module, f"{kind}_PATH", None) for kind in ("URDF", "XACRO", "MJCF")]
    file = next((Path(one) for one in paths if one), None)
    if file is None:
        raise RobotError(f"{_PACKAGE} states no file of the robot '{name}'")
    package, root = (getattr(module, f"{one}_PATH", None) for one in ("PACKAGE", "REPOSITORY"))
    folders = [str(Path(package).parent)] if package else []
    folders += [str(one) for one in (package, root) if one]
    arguments = getattr(module, "XACRO_ARGS", None) if file.suffix == ".xacro" else None
    return Source(file, tuple(dict.fromkeys(folders)), arguments)


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


def find_robots(folder: StrPath) -> Iterator[FoundRobot]:
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
        absent = [one for one in description.notes if "there is no package" in one]
        fault = mass_fault(model, description.q0(model), description) or "; ".join(absent)
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
