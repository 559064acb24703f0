"""What the measurements ran on: processor, system, versions, command, date."""

import contextlib
import os
import platform
import re
from datetime import datetime
from importlib import metadata
from pathlib import Path

BUSY = 0.2
"""Cores that other processes may use on average before a report says so."""
# Distributions whose speed shows on the page, in its order; others are left out.
PACKAGES = (
    "sphshell-pin",
    "pin",
    "coal",
    "numpy",
    "trimesh",
    "libigl",
    "fcpw",
    "mujoco",
    "drake",
    "pybullet",
)


class OtherWork:
    """What other processes of the machine use of its processors, from now on.

    It is the time in which processors were not idle, less what this process and its children, those
    that have ended, have used; stolen time of a virtual machine counts as used by others.
    """

    def __init__(self) -> None:
        self._begin = _clocks()

    def cores(self) -> float | None:
        """Return how many cores others have used on average; None where the system does not say."""
        begin, end = self._begin, _clocks()
        if begin is None or end is None or end[0] <= begin[0]:
            return None
        wall, machine, own = (after - before for before, after in zip(begin, end, strict=True))
        return max(machine - own, 0.0) / wall


def _clocks() -> tuple[float, float, float] | None:
    """Return the time, that of all processors in use, and that of this process [s]."""
    try:
        line = Path("/proc/stat").read_text(encoding="ascii").partition("\n")[0].split()
        # user nice system idle iowait irq softirq steal; what guests use is in user, too.
        ticks = [int(one) for one in line[1:9]]
        used = (sum(ticks) - ticks[3] - ticks[4]) / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError, AttributeError):
        return None
    times = os.times()
    own = times.user + times.system + times.children_user + times.children_system
    return times.elapsed, used, own


def caution_of(cores: float | None) -> str:
    """Return the sentence about a machine on which others used so many cores; "" if it was idle."""
    if cores is None or cores <= BUSY:
        return ""
    return (
        f"The machine was busy: other processes used {cores:.2f} cores on average during the "
        f"measurements (an idle machine: at most {BUSY:g}). Times are too long, and ratios of "
        "times uncertain, whether their aims are met here or missed. Errors do not depend on it."
    )


def describe(command: str) -> dict[str, str]:
    """Return what the page says of the machine and of this run, by heading."""
    processor = platform.processor() or "unknown"
    with contextlib.suppress(OSError):
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        if model := re.search(r"^model name\s*:\s*(.+)", text, re.MULTILINE):
            processor = model[1]
    versions = []
    for name in PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            versions.append(f"{name} {metadata.version(name)}")
    found = {
        "processor": f"{processor}, {platform.machine()}",
        "cores": f"{os.cpu_count() or 1}",
        "system": platform.platform(),
        "Python": f"{platform.python_version()} ({platform.python_implementation()})",
        "packages": ", ".join(versions),
        "date": datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %z"),
    }
    return found | ({"command": command} if command else {})


def machine() -> str:
    """Return one line on what this runs on."""
    found = describe("")
    return f"{found['processor']}; Python {found['Python']}; {found['packages']}"
