"""What may be asked of a CAD file, and whether the library that reads one is installed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from sphshell_pin.base.checks import check_not_negative, check_positive
from sphshell_pin.errors import InvalidParameter, MissingExtra, UnusableExtra

Occ: TypeAlias = Any
"""An object of OpenCASCADE, whose binding has no types."""

STEP_SUFFIXES = (".step", ".stp")
IGES_SUFFIXES = (".iges", ".igs")
BREP_SUFFIXES = (".brep", ".brp")
PACKAGE = "cadquery-ocp-novtk"
SYSTEM_PACKAGES = "libgl1 libx11-6"
"""What OpenCASCADE needs of Debian and Ubuntu; images of containers often lack it."""

CAD_SUFFIXES = (*STEP_SUFFIXES, *IGES_SUFFIXES, *BREP_SUFFIXES)


@dataclass(frozen=True)
class CadOptions:
    """How a CAD file is turned into elements; None leaves the choice to the file.

    Attributes
    ----------
    chord_error : largest distance between the flat elements and the exact surface [m]; 1e-3 of the
        box diagonal unless given
    bodies : names of the bodies to take, all unless given
    faces : names of the faces to take, or their numbers in the file (from 1), all unless given
    sew : faces whose borders are nearer than this are joined [m], 0 leaves them as they are; unless
        given, the smallest of a few tolerances that joins the most
    time_limit : after which OpenCASCADE is ended [s], 600 unless given
    memory_limit : which it may take beyond what it takes by itself [bytes], 8e9 unless given
    """

    chord_error: float | None = None
    bodies: Sequence[str] | None = None
    faces: Sequence[str | int] | None = None
    sew: float | None = None
    time_limit: float | None = None
    memory_limit: float | None = None

    def __post_init__(self) -> None:
        """Raise InvalidParameter if an option is out of range."""
        for name, unit in (("chord_error", "m"), ("time_limit", "s"), ("memory_limit", "bytes")):
            if getattr(self, name) is not None:
                check_positive(name, getattr(self, name), unit)
        if self.sew is not None:
            check_not_negative("sew", self.sew, "m")
        for name, kinds in (("bodies", (str,)), ("faces", (str, int))):
            given = getattr(self, name)
            listed = isinstance(given, (list, tuple)) and len(given) > 0
            if given is not None and not (
                listed and all(isinstance(k, kinds) and not isinstance(k, bool) for k in given)
            ):
                what = "names" if name == "bodies" else "names or numbers"
                raise InvalidParameter(name, given, f"must be a list of {what}, or left out")

    def check_unused(self, suffix: str) -> None:
        """Raise InvalidParameter if an option is given, as `suffix` is that of a mesh file."""
        for name, given in vars(self).items():
            if given is not None:
                raise InvalidParameter(
                    name,
                    given,
                    f"belongs to CAD files ({', '.join(CAD_SUFFIXES)}): leave it out for a "
                    f"{suffix} file, whose elements are taken as they are",
                )


def require_kernel(purpose: str) -> None:
    """Keep OpenCASCADE from printing.

    Raises
    ------
    MissingExtra
        If it is not installed.
    UnusableExtra
        If it is, but a library of the system that it needs is not.
    """
    try:
        from OCP.Message import Message
    except ModuleNotFoundError as error:
        raise MissingExtra(PACKAGE, "cad", purpose) from error
    except ImportError as error:
        raise UnusableExtra(PACKAGE, "cad", purpose, str(error), SYSTEM_PACKAGES) from error
    # Its readers write their own reports to the standard output.
    Message.DefaultMessenger_s().ChangePrinters().Clear()
