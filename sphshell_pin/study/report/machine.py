"""What the measurements ran on: processor, system, versions, command, date."""

import contextlib
import os
import platform
import re
from datetime import datetime
from importlib import metadata
from pathlib import Path

BUSY = 0.5
"""Load before the measurements from which on a report says that the machine was busy."""

# Distributions whose speed shows on a page, in its order; others are left out.
OWN = "sphshell-pin", "pin", "coal", "numpy"
PEERS = "trimesh", "libigl", "fcpw", "mujoco", "drake", "pybullet"


def caution_of(load: float) -> str:
    """Return the sentence about a machine with this load; "" if it was idle."""
    if load <= BUSY:
        return ""
    return (
        f"The machine was busy: its load was {load:.2f} before the measurements (an idle machine: "
        f"at most {BUSY:g}). Times may be too long, and ratios of times are uncertain, whether "
        "their aims are met here or missed. Errors do not depend on it."
    )


def describe(command: str) -> dict[str, str]:
    """Return what the page says of the machine and of this run, by heading."""
    processor = platform.processor() or "unknown"
    with contextlib.suppress(OSError):
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        if model := re.search(r"^model name\s*:\s*(.+)", text, re.MULTILINE):
            processor = model[1]
    versions = []
    for name in (*OWN, *PEERS):
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
