"""Loads the C++ core, and makes sure that it meets the libraries it was compiled against.

Pinocchio and Coal come first: the core finds their shared objects, and their Python types, loaded.
"""

from __future__ import annotations

from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

_LIBRARIES = ("pin", "coal", "cmeel-boost")  # whose shared objects the core links


def _minor(version: str) -> list[str]:
    return version.split(".")[:2]


def _no_load(error: ImportError) -> ImportError:
    """Say why the core, or a library it needs, does not load, and what is installed."""
    try:
        required = metadata.requires("sphshell-pin") or []
    except metadata.PackageNotFoundError:
        required = []
    built = sorted(one for one in required if one.startswith(("pin=", "coal=")))
    installed = []
    for name in _LIBRARIES:
        try:
            installed.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            installed.append(f"no {name}")
    return ImportError(
        f"the compiled core of sphshell_pin does not load: {error}; it was built for "
        f"{', '.join(built) or 'other versions'}, and {', '.join(installed)} are installed: "
        "reinstall sphshell-pin, so that they agree"
    )


if find_spec("sphshell_pin._core") is None:
    _folder = Path(__file__).parent.parent
    raise ImportError(
        f"sphshell_pin is not built in {_folder}: build it there with pip install -e ., or start "
        "Python in another folder if it is installed"
    )
try:
    import coal
    import pinocchio

    from sphshell_pin import _core
except ImportError as _error:
    raise _no_load(_error) from None

for _name, _compiled, _loaded in (
    ("pinocchio", _core.pinocchio_version, pinocchio.__version__),
    ("coal", _core.coal_version, coal.__version__),
):
    if _minor(_compiled) != _minor(_loaded):
        raise ImportError(
            f"sphshell_pin was compiled against {_name} {_compiled} but {_loaded} is installed: "
            "reinstall sphshell-pin, so that both agree"
        )
