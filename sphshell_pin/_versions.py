"""Loads the C++ core, and makes sure that it meets the libraries it was compiled against.

Pinocchio and Coal come first: the core finds their shared objects, and their Python types, loaded.
"""

from __future__ import annotations

import coal
import pinocchio

from sphshell_pin import _core


def _minor(version: str) -> list[str]:
    return version.split(".")[:2]


for _name, _compiled, _loaded in (
    ("pinocchio", _core.pinocchio_version, pinocchio.__version__),
    ("coal", _core.coal_version, coal.__version__),
):
    if _minor(_compiled) != _minor(_loaded):
        raise ImportError(
            f"sphshell_pin was compiled against {_name} {_compiled} but {_loaded} is installed: "
            "reinstall sphshell-pin, so that both agree"
        )
