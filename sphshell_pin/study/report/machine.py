"""What the measurements ran on: processor, system, versions, command, date."""

from __future__ import annotations

import contextlib
import os
import platform
from datetime import datetime
from importlib import metadata

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
    """Return what the page says of the machine and of this run, by heading."""
    found = {
        "processor": processor(),
        "cores": cores(),
        "memory": memory(),
        "system": system(),
        "Python": f"{platform.python_version()} ({platform.python_implementation()})",
        "packages": ", ".join(versions()),
        "load before": load(),
        "date": datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %z"),
        "command": command,
    }
    return {heading: text for heading, text in found.items() if text}


def processor() -> str:
    """Return the model of the processor, as far as the system knows it."""
    with contextlib.suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as file:
        for line in file:
            if line.lower().startswith("model name"):
                return f"{line.partition(':')[2].strip()}, {platform.machine()}"
    return f"{platform.processor() or 'unknown'}, {platform.machine()}"


def cores() -> str:
    """Return how many cores there are, and how many of them this process may use."""
    number = os.cpu_count() or 1
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else number
    return f"{number}" if usable == number else f"{number}, {usable} of them for this process"


def memory() -> str:
    """Return the size of the memory; empty where the system does not say."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        size = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        return f"{size / 2**30:.1f} GiB"
    return ""


def system() -> str:
    """Return the system and its kernel."""
    with contextlib.suppress(OSError, AttributeError):
        name = platform.freedesktop_os_release().get("PRETTY_NAME", platform.system())
        return f"{name}, {platform.system()} {platform.release()}"
    return platform.platform()


def load() -> str:
    """Return how many processes wanted to run in the last minutes; empty where it is unknown."""
    with contextlib.suppress(OSError, AttributeError):
        one, five, _ = os.getloadavg()
        return f"{one:.2f} and {five:.2f} processes in the last 1 and 5 minutes"
    return ""


def versions() -> list[str]:
    """Return name and version of each package that is installed."""
    found = []
    for name in PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found.append(f"{name} {metadata.version(name)}")
    return found
