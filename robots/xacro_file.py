"""Xacro files, expanded to a URDF by the package xacro."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from pathlib import Path
from xml.parsers.expat import ExpatError

from sphshell_pin.errors import MissingExtra
from sphshell_pin.robots.packages import Folders
from sphshell_pin.robots.xacro_expressions import checked

# xacro keeps its state in its module.
_ONE_AT_A_TIME = threading.Lock()


def expand(file: Path, folders: Folders, arguments: Mapping[str, object]) -> bytes:
    """Return the URDF that the xacro file makes with `arguments`.

    `$(find package)` is searched in `folders`. Raises MissingExtra without the package xacro, and
    ValueError with the reason of a file that cannot be expanded.
    """
    try:
        import xacro
        from xacro import substitution_args
    except ImportError:
        raise MissingExtra("xacro", "robots", f"the xacro file {file}") from None

    def find(name: str) -> str:
        folder = folders.package(name)
        if folder is None:
            raise substitution_args.ArgException(
                f"there is no package '{name}' in {folders.searched()}: give the folder above it "
                "with --package-dir, or package_dirs in a scenario or in Python"
            )
        return str(folder)

    known: dict[str, object] = substitution_args._eval_dict  # $(eval find('name'))
    with _ONE_AT_A_TIME:
        # It asks ament alone, which few machines have.
        usual = substitution_args._eval_find
        substitution_args._eval_find = known["find"] = find
        try:
            stated = {name: _text(value) for name, value in arguments.items()}
            with checked(xacro, substitution_args):
                document = xacro.process_file(str(file), mappings=stated)
        except (xacro.XacroException, ExpatError, OSError) as error:
            reason = " ".join(str(error).split())
            where = Path((xacro.filestack or [file])[-1]).name
            of = f" (in {where})" if where != file.name else ""
            raise ValueError(f"xacro cannot expand it{of}: {reason}") from None
        finally:
            substitution_args._eval_find = known["find"] = usual
    return bytes(document.toxml(encoding="utf-8"))


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
