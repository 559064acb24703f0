"""Programs in Python processes of their own, and modules of files that are in no package."""

import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
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
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# Processes that run in the background pass on that Ctrl-C is to be ignored.
HEARS_CTRL_C = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from sphshell_pin.cli import main; main()"
)


class Silent(SimpleHTTPRequestHandler):
    """Serves files without a word."""

    def log_message(self, *_):
        pass


@contextmanager
def serving(folder: Path) -> Iterator[int]:
    """Serve the files of a folder, at the port that is yielded."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Silent, directory=str(folder))) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_port
        server.shutdown()
