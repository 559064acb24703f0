"""The user's own functions, which a scenario names as "file.py:function".

They are the only code that a scenario can name, and this is the only place that executes it.
"""

import importlib.util
import inspect
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from sphshell_pin.base.regular_file import why_no_file
from sphshell_pin.errors import NameNotFound, ScenarioError, SphshellError
from sphshell_pin.scenario.format.bodies import blamed_on

Modules = dict[Path, ModuleType]
Loader = Callable[[str, Path, str, Modules], Callable[..., object]]
"""What `load_function` and `unloaded` are."""


def load_function(where: str, path: Path, key: str, modules: Modules) -> Callable[..., object]:
    """Return the function that "file.py:function" names, the file relative to the scenario's.

    Files that are in `modules` are not run again; one that is run is added.

    Raises
    ------
    ScenarioError
        No such file or function, or the file cannot be run.
    """
    file_name, colon, function = where.rpartition(":")
    if not colon or not file_name.endswith(".py") or not function:
        raise ScenarioError(path, key, 'must be "file.py:function"', where)
    file = path.parent / file_name
    if reason := why_no_file(file):
        raise ScenarioError(path, key, f"{file}: {reason}", where)
    if file not in modules:
        modules[file] = _run(file, where, path, key)
    module = modules[file]
    found = getattr(module, function, None)
    if not callable(found):
        valid = [
            name
            for name, one in inspect.getmembers(module, inspect.isfunction)
            if one.__module__ == module.__name__ and not name.startswith("_")
        ]
        with blamed_on(path, key):
            raise NameNotFound("function", function, str(file), valid)
    return found  # type: ignore[no-any-return]


def _run(file: Path, where: str, path: Path, key: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"sphshell_pin_scenario_{file.stem}", file)
    if spec is None or spec.loader is None:
        raise ScenarioError(path, key, f"python cannot load {file}", where)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise ScenarioError(path, key, f"{file} fails: {type(error).__name__}: {error}") from error
    return module


def unloaded(where: str, path: Path, key: str, modules: Modules) -> Callable[..., object]:
    """Return a stand-in for the function that "file.py:function" names; nothing is executed.

    Called, it raises SphshellError, which states how to load the function.
    """

    def refuse(*arguments: object, **keywords: object) -> object:
        raise SphshellError(
            f"{path}: {key}: '{where}' was not loaded, as no code is executed to show a finished "
            "run: build the scenario again"
        )

    return refuse
