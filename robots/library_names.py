"""Robots by the names of the package robot_descriptions, if it is installed."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from sphshell_pin.errors import SphshellError
from sphshell_pin.robots.files import RobotError

_PACKAGE = "robot_descriptions"


@dataclass(frozen=True)
class Source:
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
