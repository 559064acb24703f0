"""Programs in Python processes of their own, and modules of files that are in no package."""

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType


def python(program, *arguments, check=False, timeout=120.0, **more):
    """Run a program to its end, and return its exit code and what it printed."""
    command = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, check=check, timeout=timeout, **more
    )


def module_of(file: Path) -> ModuleType:
    """Return the module of a file."""
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# Processes that run in the background pass on that Ctrl-C is to be ignored.
HEARS_CTRL_C = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from sphshell_pin.cli import main; main()"
)
