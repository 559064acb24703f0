"""Xacro files, expanded to a URDF by the package xacro, in a process of its own.

A xacro file is code: its expressions are Python's. They are checked (`xacro_expressions`), and the
process that evaluates them has limits of time and memory.
"""

import importlib.util
import json
import re
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from sphshell_pin.base.limits import child_command, last_line
from sphshell_pin.base.regular_file import MOST_TEXT, read_bytes
from sphshell_pin.base.texts import visible
from sphshell_pin.errors import MissingExtra
from sphshell_pin.robots.packages import Folders

TIME_LIMIT = 5.0
"""Time of the processor, to expand a file [s]; large robots take one or two."""

WAIT = 60.0
"""How long the process is waited for [s], on a busy machine too."""

CHILD = "sphshell_pin.robots.xacro_child"
"""The module whose `serve` runs in the process."""

_LISTED = 12  # arguments, in a sentence

MEMORY_LIMIT = 1e9
"""What a file may take [bytes]."""


def expand(file: Path, folders: Folders, arguments: Mapping[str, object]) -> bytes:
    """Return the URDF that the xacro file makes with `arguments`.

    `$(find package)` is searched in `folders`. Raises MissingExtra without the package xacro, and
    ValueError with the reason of a file that cannot be expanded, or not within the limits.
    """
    if importlib.util.find_spec("xacro") is None:
        raise MissingExtra("xacro", "robots", f"the xacro file {file}")
    request = {
        "file": str(file),
        "folders": [str(one) for one in folders.given],
        "arguments": {name: _text(value) for name, value in arguments.items()},
        "time_limit": TIME_LIMIT,
        "memory_limit": MEMORY_LIMIT,
    }
    long = f"xacro takes more than {TIME_LIMIT:g} s to expand it: check its expressions and loops"
    try:
        done = subprocess.run(
            child_command(CHILD),
            input=json.dumps(request).encode(),
            capture_output=True,
            timeout=WAIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ValueError(long) from None
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        raise ValueError(long)
    try:
        answer = json.loads(done.stdout)
        urdf, fault = answer.get("urdf"), answer.get("fault")
    except (ValueError, AttributeError):
        last = last_line(done.stderr)
        fault = "memory" if "MemoryError" in last else f"failed ({last})"
    if fault == "memory":
        raise ValueError(
            f"xacro takes more than {MEMORY_LIMIT / 1e9:g} GB of memory to expand it: check its "
            "expressions and loops"
        )
    if fault == "file":
        raise ValueError(_advised(str(answer.get("reason")), file))
    if fault is not None or not isinstance(urdf, str):
        raise ValueError(f"xacro cannot expand it: its process {fault or 'gave no answer'}")
    sys.stderr.write(visible(answer["said"]))  # xacro's warnings
    return urdf.encode()


def _advised(reason: str, file: Path) -> str:
    """Return a reason with the arguments that may be to blame."""
    argument = re.search(r"Undefined substitution argument (\w+)", reason)
    if argument is not None:
        return f"{reason}: give it, --xacro-arg {argument[1]}=VALUE (xacro_args in a scenario)"
    if "there is no package" in reason or not file.is_file():
        return reason
    text = read_bytes(file, MOST_TEXT).decode(errors="replace")
    stated = [
        f"{name} ({usual})" if usual and "$" not in usual else name
        for name, usual in re.findall(r'<xacro:arg\s+name="(\w+)"(?:\s+default="([^"]*)")?', text)
    ]
    sets = "; its arguments, which --xacro-arg NAME=VALUE sets: "
    return reason + (sets + ", ".join(stated[:_LISTED]) if stated else "")


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
