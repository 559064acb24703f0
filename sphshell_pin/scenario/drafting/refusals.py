"""What a search for a draft came across, and the sentence that refuses."""

from collections import Counter
from dataclasses import dataclass, field

from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.placing import Searched
from sphshell_pin.scenario.drafting.plan import Plan
from sphshell_pin.scenario.drafting.trial import Fault
from sphshell_pin.scenario.drafting.wording import counted
from sphshell_pin.scenario.format.schema import RobotSection

_ADVICE = {
    "run": "take a softer --law, or a larger --radius",
    "touch": "take another --place, or another --frame",
    "force": "take a smaller --radius, another --press or --place",
    "path": "take a shorter --length, another --at or --place",
    "links": "take another --place, a smaller part, or a sphere farther out (--frame, --offset)",
    "figure": "take another --law or --radius",
}
_ADVICE_BOWL = "the bowl is a whole ball, which the limb would pass: take the file of an open one"
_ADVICE_FLOATING = "take a flatter or larger part, on which all spheres can come down"


class CannotStand(SphshellError):
    """The robot floats, and its feet do not hold it on this surface, for this `reason`."""

    def __init__(self, said: str, reason: str) -> None:
        super().__init__(said)
        self.reason = reason


class CannotReach(SphshellError):
    """The links of a limb would be in the part wherever its tip, on `frame`, touches that."""

    def __init__(self, said: str, frame: str) -> None:
        super().__init__(said)
        self.frame = frame
        self.others: list[str] = []
        """Frames at the ends of other limbs."""


@dataclass
class Tried(Searched):
    """What a search came across, for the sentence that refuses."""

    runs: int = 0
    faults: list[Fault] = field(default_factory=list)
    errors: list[SphshellError] = field(default_factory=list)
    stays: list[tuple[RobotSection, Plan]] = field(default_factory=list)
    """Plans that press in one place, where a path failed."""
    ways: list[str] = field(default_factory=list)
    """Why a path that was asked for could not be taken."""


def cannot_stand(tried: Tried, *, has_joints: bool) -> SphshellError:
    """Return the error of a robot that floats and was dropped in vain."""
    said = f"{_failed(tried)}; {_ADVICE_FLOATING}"
    if not has_joints:
        return SphshellError(said)
    return CannotStand(f"{said}, or hold it with --base fixed", tried.faults[-1].text)


def _failed(tried: Tried) -> str:
    fault = tried.faults[-1]
    when = f" at t = {fault.t:.2g} s" if fault.link else ""
    return f"no draft works ({counted(tried.runs, 'run')}): {fault.text}{when}"


def refusal(frame: str, asked: Asked, tried: Tried) -> SphshellError:
    """Return the error that says why no draft works, and what to change."""
    if not tried.postures:
        way = f"along {asked.place}" if asked.place else "along any axis"
        return SphshellError(
            f"the tip on frame '{frame}' cannot move {way} in any posture that was tried: its "
            "joints do not allow it; take another --place or --frame"
        )
    if tried.faults:
        return SphshellError(f"{_failed(tried)}; {_ADVICE[tried.faults[-1].kind]}")
    if tried.errors:
        return tried.errors[0]
    if tried.ways:
        return SphshellError(
            f"the path cannot be taken: {tried.ways[0]}; take a shorter --length, another --at or "
            "--place"
        )
    if tried.blocked:
        ((link, _),) = Counter(tried.blocked).most_common(1)
        advice = _ADVICE_BOWL if asked.inside else _ADVICE["links"]
        return CannotReach(
            f"link '{link}' would be in the part, or another one: in each of "
            f"{counted(tried.postures, 'posture')} and {counted(tried.places, 'place')} on the "
            f"part that were tried; {advice}",
            frame,
        )
    return SphshellError("the surface has no point to touch")
