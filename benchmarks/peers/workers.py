"""Every engine in a process of its own, pinned to one core: a crash is an answer, not the end."""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import os
import traceback
from typing import TYPE_CHECKING, Any

from sphshell_pin.benchmarks.peers.engine import CannotDo, Engine
from sphshell_pin.benchmarks.peers.scenes import SCENES
from sphshell_pin.benchmarks.timing import one_core

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from sphshell_pin.benchmarks.peers.engine import Knob

# Names on the command line, and module:class beside this file.
ENGINES = {
    "ours": "ours:Ours",
    "mujoco": "mujoco:MuJoCo",
    "drake": "drake:Drake",
    "pybullet": "pybullet:PyBullet",
    "loop": "python_loop:PythonLoop",
}
STARTING = 120.0  # [s] for imports


class WorkerLost(Exception):
    """The process of an engine crashed, or took too long and was ended; the message says which."""


def engine_called(name: str) -> Engine:
    """Return the engine of a name of ENGINES."""
    module, _, kind = ENGINES[name].partition(":")
    found: Engine = getattr(importlib.import_module(f"{__package__}.{module}"), kind)()
    return found


def serve(name: str, pipe: Connection) -> None:
    """Answer questions about an engine until the pipe closes: (what, scene, knob, variant)."""
    one_core()
    with contextlib.suppress(OSError):  # engines print from C
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
    engine = engine_called(name)
    while True:
        try:
            question = pipe.recv()
        except EOFError:
            return
        try:
            pipe.send(("done", answer(engine, *question)))
        except CannotDo as reason:
            pipe.send(("cannot", str(reason)))
        except ImportError as missing:
            pipe.send(("absent", str(missing)))
        except Exception as error:
            line = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{os.path.basename(line.filename)}:{line.lineno}"
            pipe.send(("failed", f"{type(error).__name__}: {error} ({where})"))


def answer(engine: Engine, what: str, scene: str, knob: Knob | None, variant: int) -> Any:
    """Return what is asked: the engine's facts about a scene, or a run's cost and errors."""
    built = SCENES[scene]()
    if what == "facts":
        return {
            "version": engine.version(),
            "settings": engine.settings(built),
            "knobs": engine.knobs(built),
        }
    assert knob is not None
    one = built.variants()[variant]
    found = engine.run(one, knob)
    return {
        "errors": one.errors(found),
        "cpu": found.cpu,
        "simulated": found.simulated,
        "steps": found.steps,
    }


class Worker:
    """The process of one engine; it starts anew after it was lost."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._process: Any = None
        self._pipe: Any = None

    def ask(
        self,
        what: str,
        scene: str,
        knob: Knob | None = None,
        variant: int = 0,
        timeout: float = STARTING,
    ) -> tuple[str, Any]:
        """Return ("done", answer), or "cannot", "absent" or "failed" with the reason.

        Raises WorkerLost.
        """
        if self._process is None:
            self._start()
        try:
            self._pipe.send((what, scene, knob, variant))
            if not self._pipe.poll(timeout):
                raise WorkerLost(f"took longer than {timeout:.0f} s")
            status, found = self._pipe.recv()
        except (EOFError, OSError):
            self._process.join(5.0)
            code = self._process.exitcode
            self.close()
            raise WorkerLost(f"the process ended with code {code}") from None
        except WorkerLost:
            self.close()
            raise
        return status, found

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(self.name, theirs), daemon=True)
        self._process.start()
        theirs.close()

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._pipe.close()
            self._process.terminate()
            self._process.join()
            self._process = None
