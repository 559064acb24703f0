"""Xacro files, expanded to a URDF by the package xacro, in a process of its own.

A xacro file is code: its expressions are Python's. They are checked (`xacro_expressions`), and the
process that evaluates them has limits of time and memory.
"""

import importlib.util
import itertools
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
from sphshell_pin.robots.packages import Folders, workspaces

TIME_LIMIT = 5.0
"""Time of the processor, to expand a file [s]; large robots take one or two."""

WAIT = 300.0
"""How long the process is waited for [s]: on a busy machine it gets little of the processor."""

CHILD = "sphshell_pin.robots.xacro_child"
"""The module whose `serve` runs in the process."""

# Arguments, in a sentence; files of a package that may state one, and their ends.
_LISTED, _MOST_FILES = 12, 2000
_STATING = (".launch", ".txt", ".xml", ".py", ".sh", ".xacro", ".yaml", ".yml")

MEMORY_LIMIT = 1e9
"""What a file may take [bytes]."""


def expand(
    file: Path, folders: Folders, arguments: Mapping[str, object]
) -> tuple[bytes, list[str]]:
    """Return the URDF that the xacro file makes with `arguments`, others it needs, and notes.

    Those have no default in it, or one that names a file that is not there: each has the value that
    another file states, else the first for which the file is there, else that of a condition is
    false, any other its own name. What else such an argument may be is said in a clause.
    `$(find package)` is searched in `folders`. Raises MissingExtra without the package xacro, and
    ValueError with the reason of a file that cannot be expanded, or not within the limits.
    """
    if importlib.util.find_spec("xacro") is None:
        raise MissingExtra("xacro", "robots", f"the xacro file {file}")
    assumed, others = dict[str, str](), ""
    while True:
        try:
            urdf, left_out = _expanded(file, folders, {**assumed, **arguments})
        except ValueError as error:
            needed = re.search(r"Undefined substitution argument (\w+)", str(error))
            if needed is not None and needed[1] not in assumed and len(assumed) < _LISTED:
                assumed[needed[1]] = _usual(needed[1], file)
                continue
            name, choices = _choices(
                str(error), {**dict(_stated_arguments(file)), **assumed, **arguments}
            )
            may = f"; {name} may be {', '.join(choices[:_LISTED])}" if choices else ""
            if not choices or name in arguments:
                raise ValueError(f"{error}{may}") from None
            assumed[name], others = choices[0], others + may
            continue
        values = " ".join(f"--xacro-arg {name}={value}" for name, value in assumed.items())
        taken = f"its arguments without a default are taken as {values}: or give others{others}"
        moves = assumed or re.search(rb'<joint\b[^>]*\btype="(?!fixed")', urdf)
        notes = (left_out, taken if assumed else "", "" if moves else listed_arguments(file))
        return urdf, [*filter(None, notes)]


def _choices(said: str, values: Mapping[str, object]) -> tuple[str, list[str]]:
    """Return the argument for whose value a file is missing, and the values for which one is there.

    `said` is the error, `values` are those of all arguments.
    """
    found = re.search(r"No such file or directory: '?(/.+?)(?:'|; its arguments|$)", said)
    parts = Path(found[1]).parts if found else ()
    k = next((k for k in range(len(parts)) if not Path(*parts[: k + 1]).exists()), 0)
    for name, value in values.items():
        old = _text(value)
        if not k or not old or old not in parts[k]:
            continue
        ahead, behind = parts[k].split(old, 1)
        names = [one.name for one in sorted(Path(*parts[:k]).iterdir())]
        new = [
            one[len(ahead) : len(one) - len(behind)]
            for one in names
            if one.startswith(ahead) and one.endswith(behind)
        ]
        rest = parts[k:]
        there = [
            one
            for one in new
            if one and Path(*parts[:k], *(part.replace(old, one) for part in rest)).is_file()
        ]
        if there:
            return name, there
    return "", []


def _usual(argument: str, file: Path) -> str:
    """Return the value that a file of the package or folder states, or one that names `file`."""
    stated = re.compile(
        rf'\b{argument}:=([\w./+-]+)|<arg\s+name="{argument}"\s+(?:default|value)="([\w./+-]+)"'
        rf'|LaunchArgument\(\s*["\']{argument}["\'],\s*default_value=["\']([\w./+-]+)["\']'
    )
    tested = re.compile(rf'(?:if|unless)\s+value="[^"]*\b{argument}\b')
    is_tested = False
    above = file.absolute().parents
    package = next((one for one in above[:4] if (one / "package.xml").is_file()), None)
    files = above[0].glob("*") if package is None else package.rglob("*")
    launch = workspaces(above[0])[-1].rglob("*launch*") if package else ()
    stating = (one for one in itertools.chain(files, launch) if one.suffix in _STATING)
    for one in itertools.islice(stating, _MOST_FILES):
        try:
            text = read_bytes(one, MOST_TEXT).decode(errors="replace")
        except (OSError, ValueError):
            continue
        if package is not None and package not in one.parents and file.name not in text:
            continue
        found = stated.search(text)
        if found is not None:
            return str(next(filter(None, found.groups())))
        is_tested = is_tested or tested.search(text) is not None
    return "false" if is_tested else argument


def _expanded(file: Path, folders: Folders, arguments: Mapping[str, object]) -> tuple[bytes, str]:
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
        raise ValueError(
            f"xacro has not expanded it after {WAIT:g} s: the machine is busy, or a file that it "
            "includes cannot be read to its end"
        ) from None
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
    return urdf.encode(), visible(str(answer.get("left_out") or ""))


def _advised(reason: str, file: Path) -> str:
    """Return a reason with the arguments that may be to blame."""
    if re.search("there is no package|Undefined sub", reason) or not file.is_file():
        return reason
    if re.search("Invalid parameter|Undefined parameters", reason):
        return (
            f"{reason}: the file that calls the macro fits another version of the one that has it"
        )
    stated = listed_arguments(file)
    return f"{reason}; {stated}" if stated else reason


def listed_arguments(file: Path) -> str:
    """Return the arguments of a file in a clause, "" if it has none."""
    stated = [f"{name} ({usual})" if usual else name for name, usual in _stated_arguments(file)]
    sets = "its arguments, which --xacro-arg NAME=VALUE sets: "
    return sets + ", ".join(stated[:_LISTED]) if stated else ""


def _stated_arguments(file: Path) -> list[tuple[str, str]]:
    """Return the arguments that a file states, with their defaults, "" where it has none."""
    text = read_bytes(file, MOST_TEXT).decode(errors="replace")
    found = re.findall(r'<xacro:arg\s+name="(\w+)"(?:\s+default="([^"]*)")?', text)
    return [(name, "" if "$" in usual else usual) for name, usual in found]


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
