"""Programs in Python processes of their own."""

import subprocess
import sys
from typing import Any


def python(
    program: str, *arguments: object, check: bool = False, timeout: float = 120.0, **more: Any
) -> subprocess.CompletedProcess[str]:
    """Run a program to its end, and return its exit code and what it printed."""
    command = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, check=check, timeout=timeout, **more
    )
