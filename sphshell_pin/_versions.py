"""The version; loads the C++ core, which is checked against the libraries it was compiled for.

Pinocchio and Coal come first: the core finds their shared objects, and their Python types, loaded.
Their shared objects carry no version in their names, so the core would load with any of them, and
read memory in another layout than theirs. `_built_against` is written by CMake beside the core.
"""

import os
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

__version__ = "0.3.0.dev0"  # what is released next; the only place

# What to import, its distribution on PyPI.
_LIBRARIES = (("pinocchio", "pin"), ("coal", "coal"))


def _minor(version: str) -> str:
    return ".".join(version.split(".")[:2])


def _installed(name: str) -> str | None:
    """Return the version of a distribution; conda's and ROS's packages may have none."""
    from importlib import metadata

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _remedy(built: dict[str, str]) -> str:
    """Return how the libraries and the core are made to agree."""
    if _installed("cmeel") is None:
        wanted = " and ".join(f"{name} {_minor(built[name])}" for name, _ in _LIBRARIES)
        return f"install {wanted}, or compile sphshell_pin again (docs/install.md)"
    wanted = " ".join(f"'{dist}=={_minor(built[name])}.*'" for name, dist in _LIBRARIES)
    return f"python -m pip install {wanted}"


def _no_load(error: ImportError, built: dict[str, str]) -> ImportError:
    """Say why the core, or a library it needs, does not load, and what is installed."""
    versions = {name: _installed(name) for name in ("pin", "coal", "cmeel-boost")}
    return ImportError(
        f"the compiled core of sphshell_pin does not load: {error}; it was compiled against "
        f"{' and '.join(f'{name} {version}' for name, version in built.items())}, and "
        f"{', '.join(f'{n} {v}' if v else f'no {n}' for n, v in versions.items())} are installed: "
        f"{_remedy(built)}"
    )


def _load() -> None:
    """Import the libraries, compare their versions, import the core."""
    if any(find_spec(f"sphshell_pin.{name}") is None for name in ("_core", "_built_against")):
        folder = Path(__file__).parent.parent
        raise ImportError(
            f"sphshell_pin is not built in {folder}: build it there with pip install -e ., or "
            "start Python in another folder if it is installed"
        )
    built = import_module("sphshell_pin._built_against").VERSIONS

    try:
        for name, _ in _LIBRARIES:
            loaded = import_module(name).__version__
            if _minor(loaded) != _minor(built[name]):
                break
        else:
            import_module("sphshell_pin._core")
            return
    except ImportError as error:
        raise _no_load(error, built) from None
    raise ImportError(
        f"sphshell_pin was compiled against {name} {built[name]}, but {name} {loaded} is "
        f"installed: {_remedy(built)}"
    )


# NumPy's threads wait by turning in circles, and no command's matrices are large enough for two.
if Path(*sys.argv[:1]).stem == "sphshell-pin":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
_load()
