"""Every engine in a process of its own, pinned to one core: a crash is an answer, not the end."""

import contextlib
import importlib
import os
from collections.abc import Iterator
from functools import cache
from typing import TypedDict

from benchmarks.peers.engine import CannotDo, Engine, Params
from benchmarks.peers.scenes import SCENES
from benchmarks.processes import OwnProcess, ProcessLost
from sphshell_pin.study.report.timing import one_core

# Names on the command line, and module:class beside this file.
ENGINES = {
    "ours": "ours:Ours",
    "mujoco": "mujoco:MuJoCo",
    "drake": "drake:Drake",
    "pybullet": "pybullet:PyBullet",
    "exudyn": "exudyn:Exudyn",
    "loop": "python_loop:PythonLoop",
}
STARTING = 120.0  # [s] for imports


class Facts(TypedDict):
    """What an engine says of itself and of a scene."""

    version: str
    settings: dict[str, str]
    param_sets: list[Params]


class Ran(TypedDict):
    """What a run cost [CPU s], how much it simulated [s], and its errors by name."""

    errors: dict[str, float]
    cpu: float
    simulated: float
    steps: int


class NoAnswer(Exception):
    """Why there is no figure: not installed, cannot do it, failed, crashed, took too long."""


@cache
def engine_called(name: str) -> Engine:
    """Return the engine of a name of ENGINES."""
    module, _, kind = ENGINES[name].partition(":")
    found: Engine = getattr(importlib.import_module(f"{__package__}.{module}"), kind)()
    return found


def _begin() -> None:
    one_core()
    with contextlib.suppress(OSError):  # engines print from C
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)


def _facts(name: str, scene: str) -> Facts:
    engine, built = engine_called(name), SCENES[scene]()
    return Facts(
        version=engine.version(),
        settings=engine.settings(built),
        param_sets=engine.param_sets(built),
    )


def _run(name: str, scene: str, params: Params, variant: int) -> Ran:
    one = SCENES[scene]().variants()[variant]
    found = engine_called(name).run(one, params)
    return Ran(
        errors=one.errors(found), cpu=found.cpu, simulated=found.simulated, steps=found.steps
    )


class Worker:
    """The process of one engine; it starts anew after it was lost. Its methods raise NoAnswer."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._process = OwnProcess(_begin)

    def facts(self, scene: str) -> Facts:
        """Return what the engine says of a scene."""
        with self._reasons():
            return self._process.call(STARTING, _facts, self.name, scene)

    def run(self, scene: str, params: Params, variant: int, timeout: float) -> Ran:
        """Run a setting of a scene; give it up after `timeout` [s]."""
        with self._reasons():
            return self._process.call(timeout, _run, self.name, scene, params, variant)

    def close(self) -> None:
        """End the process."""
        self._process.close()

    @contextlib.contextmanager
    def _reasons(self) -> Iterator[None]:
        try:
            yield
        except ProcessLost as lost:
            raise NoAnswer(str(lost)) from None
        except CannotDo as reason:
            raise NoAnswer(f"cannot: {reason}") from None
        except ImportError as missing:
            raise NoAnswer(f"not installed: {missing}") from None
        except Exception as error:
            raise NoAnswer(f"{type(error).__name__}: {error}") from None
