"""Looks at the results in the current folder, and writes what it did beyond reading them.

Run as a program: `looking.py REPOSITORY OUTPUT SCENARIO`. A hook of the interpreter
(sys.addaudithook) hears of every file that is opened, every program that is started and all code
that is executed.
"""

import contextlib
import importlib
import importlib.util
import io
import json
import os
import site
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType

STARTS = {"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork"}
STARTS |= {"pty.spawn", "os.forkpty", "socket.connect", "webbrowser.open", "pickle.find_class"}
PACKAGE = f"{os.sep}sphshell_pin{os.sep}"


class Watch:
    """What happens, by the name of the look that is going on."""

    def __init__(self, code: list[Path], files: list[Path]) -> None:
        """Code may come from the places `code`; files that are read, from `files`, too."""
        self.found: dict[str, list[str]] = {}
        self.look = ""
        self.browser = False
        """Whether the program of Playwright may be started."""
        self._code = tuple(os.path.realpath(one) + os.sep for one in code)
        self._files = self._code + tuple(os.path.realpath(one) + os.sep for one in files)

    def __call__(self, event: str, arguments: tuple[object, ...]) -> None:
        """Hear of an event."""
        if not self.look:
            return
        if event == "open" and isinstance(arguments[0], str | bytes):
            path = os.fsdecode(arguments[0])
            if not _is_in(path, self._files):
                self._tell(event, path)
        elif event == "exec" and isinstance(arguments[0], CodeType):
            self._check_code(event, arguments[0].co_filename)
        elif event == "compile":
            self._check_code(event, str(arguments[1]))
        elif event == "ctypes.dlopen" and arguments[0]:
            self._check_code(event, str(arguments[0]))
        elif event in STARTS:
            program = str(arguments[0])
            if not (self.browser and "/playwright/" in program and _is_in(program, self._code)):
                self._tell(event, program)

    def _check_code(self, event: str, file: str) -> None:
        if not file.startswith("<"):
            if not _is_in(file, self._code):
                self._tell(event, file)
            return
        # Made of text: by whom? The libraries make classes in this way, xacro evaluates.
        frame: FrameType | None = sys._getframe(2)
        makers = []
        while frame is not None:
            makers.append(frame.f_code.co_filename)
            frame = frame.f_back
        makers = [one for one in makers if not one.startswith("<")]
        for maker in makers:
            if not _is_in(maker, self._code) or f"{os.sep}xacro{os.sep}" in maker:
                self._tell(event, f"text, by {maker}")
        if PACKAGE in makers[0]:
            self._tell(event, f"text, by {makers[0]}")

    def _tell(self, event: str, what: str) -> None:
        self.found[self.look].append(f"{event}: {what}")


def _is_in(path: str, places: tuple[str, ...]) -> bool:
    # realpath() opens nothing.
    return (os.path.realpath(path) + os.sep).startswith(places)


def looks(scenario: str) -> dict[str, Callable[[], object]]:
    """Return every way to look at the results in `run`, and the ways that must be noticed."""
    from sphshell_pin import Result
    from sphshell_pin.cli import main
    from sphshell_pin.patches import TaxelGrid
    from sphshell_pin.plot import KINDS
    from sphshell_pin.scenario import build
    from sphshell_pin.scenario.format.functions import load_function
    from sphshell_pin.scenario.running.replay import Replay

    def command(*words: str) -> Callable[[], None]:
        def run() -> None:
            sys.argv = ["sphshell-pin", *words]
            try:
                main()
            except SystemExit as end:
                if end.code:
                    raise RuntimeError(f"exit code {end.code}") from None

        return run

    def load() -> Result:
        return Result.load("run/run.npz")

    def taxels() -> None:
        replay = Replay("run/run.npz")
        TaxelGrid("ball-plate", (8, 8)).images(replay.result, replay.scene)

    found: dict[str, Callable[[], object]] = {
        f"export {to}": command("export", "run", "--to", to, "--out", f"out.{to}")
        for to in ("mcap", "csv", "parquet")
    }
    found |= {f"plot {kind}": lambda kind=kind: load().plot(kind) for kind in KINDS}
    return found | {
        "compare": command("compare", "run", "run", "--out", "compared"),
        "render": command("render", "run", "--out", "picture.png"),
        "view": command("view", "run", "--no-open"),
        "Replay": lambda: Replay("run/run.npz"),
        "Result.view": lambda: load().view().save("page.html"),
        "Result.to_mcap": lambda: load().to_mcap("again.mcap"),
        "Result.save": lambda: load().save("again.npz"),
        "TaxelGrid": taxels,
        "routine": lambda: load_function("routine.py:find", Path(scenario), "source", {}),
        "built": lambda: build(scenario),
    }


def look(repository: Path, out: Path, scenario: str) -> None:
    """Look at the results in every way."""
    import matplotlib.font_manager  # noqa: F401  # asks the system for its fonts, once

    with contextlib.suppress(ImportError):  # its glfw asks a process for its version, once
        import mujoco  # noqa: F401

    package = importlib.util.find_spec("sphshell_pin")
    code = [Path(sys.prefix), Path(sys.base_prefix), *map(Path, site.getsitepackages())]
    code += [Path(package.origin).parent, Path(__file__).parent]
    code += [repository / one for one in ("robots", "build")]
    files = [Path.cwd(), Path("run"), Path(tempfile.gettempdir()), repository / "scenarios"]
    files += [Path(one) for one in ("/dev", "/proc", "/sys", "/usr", "/lib", "/etc/mime.types")]
    watch = Watch(code, files)
    ways = looks(scenario)
    sys.addaudithook(watch)
    said: dict[str, str] = {}
    for name, way in ways.items():
        watch.found[name] = []
        watch.browser = name == "render"
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            try:
                watch.look = name
                way()
            except Exception as error:
                said[name] = f"{type(error).__name__}: {error} {printed.getvalue()}"
            finally:
                watch.look = ""
    out.write_text(json.dumps({"found": watch.found, "failed": said}))


if __name__ == "__main__":
    look(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
