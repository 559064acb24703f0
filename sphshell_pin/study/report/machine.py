"""What the measurements ran on: processor, system, versions, command, date."""

from __future__ import annotations

import contextlib
import os
import platform
import re
from datetime import datetime
from importlib import metadata
from pathlib import Path

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


def describe(command: str) -> dict[str, str]:
    """Return what the page says of the machine and of this run, by heading.

    What the system does not say is left out.
    """
    found = {"processor": f"{platform.processor() or 'unknown'}, {platform.machine()}"}
    with contextlib.suppress(OSError):
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        if model := re.search(r"^model name\s*:\s*(.+)", text, re.MULTILINE | re.IGNORECASE):
            found["processor"] = f"{model[1]}, {platform.machine()}"
    count = os.cpu_count() or 1
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else count
    found["cores"] = f"{count}" if usable == count else f"{count}, {usable} for this process"
    with contextlib.suppress(OSError, ValueError, AttributeError):
        size = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        found["memory"] = f"{size / 2**30:.1f} GiB"
    found["system"] = platform.platform()
    with contextlib.suppress(OSError, AttributeError):
        name = platform.freedesktop_os_release().get("PRETTY_NAME", platform.system())
        found["system"] = f"{name}, {platform.system()} {platform.release()}"
    found["Python"] = f"{platform.python_version()} ({platform.python_implementation()})"
    found["packages"] = ", ".join(_versions())
    with contextlib.suppress(OSError, AttributeError):
        one, five, _ = os.getloadavg()
        found["load before"] = f"{one:.2f} and {five:.2f} processes in the last 1 and 5 minutes"
    found["date"] = datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %z")
    return found | ({"command": command} if command else {})


def _versions() -> list[str]:
    """Return name and version of each package that is installed."""
    found = []
    for name in PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found.append(f"{name} {metadata.version(name)}")
    return found
