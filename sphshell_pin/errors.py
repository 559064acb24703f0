"""The errors of the package, with one base class; the data of a message are attributes."""

from __future__ import annotations

import difflib
import re
import threading
from collections.abc import Iterable
from importlib import import_module
from os import PathLike
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.run.rollout import Rollout


# Longer lists of valid names are cut to the nearest ones, longer values in the middle.
_MOST_NAMES = 20
_LONGEST_VALUE = 200
# Names of the second of two bodies: "young_2", "other_sphere".
_SECOND = re.compile(r"_2\b|\bother_")


class SphshellError(Exception):
    """Base class of all errors of this package; its text is one sentence that says what to do."""

    def __reduce__(self) -> tuple[object, ...]:
        """Let it be raised in another process: `args` are the text, not what __init__ takes."""
        return _again, (type(self), self.args, self.__dict__)


def _again(
    kind: type[SphshellError], args: tuple[object, ...], data: dict[str, object]
) -> SphshellError:
    error = kind.__new__(kind, *args)
    error.__dict__.update(data)
    return error


class InvalidParameter(SphshellError, ValueError):
    """A value outside its limits: `name` and `value` say which."""

    def __init__(self, name: str, value: object, must: str, given: str | None = None) -> None:
        """Say that parameter `name` has `value` but `must` (e.g. "must be positive [m]").

        `given` replaces "= value" in the text.
        """
        super().__init__(f"{name} {f'= {_shown(value)}' if given is None else given} {must}")
        self.name, self.value = name, value


class UnitMissing(InvalidParameter):
    """A surface file that states no unit: `path`, `size` of its box diagonal in its own numbers.

    Most formats have none; in STEP and IGES files it may be missing or unknown.
    """

    def __init__(self, path: str | PathLike[str], size: float, units: Iterable[str]) -> None:
        """Say that the unit of the file at `path` must be stated as one of `units`."""
        self.path, self.size, self.units = Path(path), size, tuple(units)
        super().__init__("unit", None, self.must("unit='{}'"))

    def must(self, option: str) -> str:
        """Say what to do; `option` is how the caller states a unit, with {} in its place."""
        mm, m = option.format("mm"), option.format("m")
        suffix = self.path.suffix.lower()
        # These may state one; this one does not.
        header = suffix in (".step", ".stp", ".iges", ".igs")
        lacking = f"the header of {self.path.name} states" if header else f"{suffix} files carry"
        return (
            f"must be stated, as {lacking} none: one of "
            f"{', '.join(self.units)}; {self.path.name} measures {self.size:.4g} units: "
            f"say {mm} if that is {self.size * 1e-3:.4g} m, {m} if it is {self.size:.4g} m"
        )


def did_you_mean(name: str, valid: Iterable[str]) -> str:
    """Return "did you mean 'x'?" with the nearest of the `valid` names; "" if none is near.

    For a name of the first body none of the second is offered, and the other way round.
    """
    second = bool(_SECOND.search(name))
    near = difflib.get_close_matches(
        name, [one for one in valid if bool(_SECOND.search(one)) == second], n=1
    )
    return f"did you mean '{near[0]}'?" if near else ""


class UnitWarning(UserWarning):
    """A shell is so much larger than its sphere or robot that its unit is probably wrong."""


class WeakLawWarning(UserWarning):
    """A law is so compliant that the sphere's center is expected to pass through the shell."""


class SlowLawWarning(UserWarning):
    """A law is a Python function, which is for trying: a compiled one is many times as fast."""


class RobotWarning(UserWarning):
    """A robot's file states what is not modeled, or names a visual mesh that is missing."""


class SetupWarning(UserWarning):
    """Input that is allowed and probably a mistake: a path off its shell, a step too long."""


class InvalidShell(SphshellError, ValueError):
    """Vertices or elements from which no surface can be made."""


class _OfFile(SphshellError):
    """What is wrong with the file or folder at `path`: `reason`, and `line` (1-based) if known."""

    def __init__(self, path: str | PathLike[str], reason: str, line: int | None = None) -> None:
        """Say what is wrong with the file at `path`."""
        super().__init__(f"{path}{'' if line is None else f', line {line}'}: {reason}")
        self.path, self.reason, self.line = path, reason, line


class ShellFileError(_OfFile, ValueError):
    """A surface file that cannot be read."""


class NameNotFound(SphshellError, LookupError):
    """A name that does not exist: `kind`, `name`, and the `valid` ones."""

    def __init__(
        self, kind: str, name: str, owner: str, valid: Iterable[str], see: str = ""
    ) -> None:
        """Say that `owner` has no `kind` called `name`, and list what it has.

        Of a long list the message has the nearest names; `see` is where to find the others.
        """
        self.kind, self.name, self.valid = kind, name, tuple(valid)
        hint = did_you_mean(name, self.valid)
        has = f"{owner} has: {', '.join(self.valid) or 'none'}{hint and f'; {hint}'}"
        if len(self.valid) > _MOST_NAMES:
            near = difflib.get_close_matches(name, self.valid, n=5, cutoff=0.0)
            has = f"the nearest are {', '.join(near)}; {owner} has {len(self.valid)}"
            has += f": see {see}" if see else ""
        super().__init__(f"no {kind} '{name}'; {has}")


class FrameNotFound(NameNotFound):
    """A frame the model does not have."""

    def __init__(self, name: str, valid: Iterable[str]) -> None:
        """List the `valid` frames of the model."""
        super().__init__("frame", name, "the model", valid)


class MissingExtra(SphshellError, ImportError):
    """An optional package is not installed: `package`, and the `extra` that installs it."""

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        """Say what `purpose` needs `package`, and how to install it."""
        super().__init__(
            f"{purpose} needs {package}: install it with pip install 'sphshell-pin[{extra}]'"
        )
        self.package, self.extra = package, extra


def import_extra(module: str, extra: str, purpose: str, package: str = "") -> ModuleType:
    """Return an optional module; MissingExtra says what `purpose` needs its `package`."""
    try:
        return import_module(module)
    except ImportError as missing:
        raise MissingExtra(package or module.partition(".")[0], extra, purpose) from missing


class UnusableExtra(MissingExtra):
    """An optional `package` is installed but cannot be loaded: `reason`, of the system."""

    def __init__(self, package: str, extra: str, purpose: str, reason: str, debian: str) -> None:
        """Say what `purpose` needs `package`, which needs the system packages `debian`."""
        reason = " ".join(reason.split())
        absent = re.match(r"(\S+\.so\S*): cannot open shared object file", reason)
        why = f"it needs the library {absent[1]}, which is absent" if absent else f"({reason})"
        super(MissingExtra, self).__init__(
            f"{purpose} needs {package}, which is installed but cannot be loaded: {why}; on Debian "
            f"or Ubuntu, apt-get install {debian}"
        )
        self.package, self.extra, self.reason = package, extra, reason


class DeepStart(SphshellError, ValueError):
    """A sphere that starts deep inside its shell: `pair`, `depth` and `radius` [m].

    Of two spheres `radius` is that of the smaller one.
    """

    def __init__(self, pair: str, depth: float, radius: float) -> None:
        """Say how deep the sphere of `pair` starts."""
        super().__init__(
            f"contact '{pair}' starts at depth {depth:.6g} m, more than half of its sphere's "
            f"radius {radius:.6g} m: move the start configuration, or turn the shell's side"
        )
        self.pair, self.depth, self.radius = pair, depth, radius


class ScenarioError(SphshellError, ValueError):
    """A scenario file that cannot be built: `path` of the file, dotted `key`, offending `value`."""

    def __init__(
        self, path: str | PathLike[str], key: str, reason: str, value: object = None
    ) -> None:
        """Say which `key` of the scenario at `path` is wrong and why."""
        given = f" (given: {value!r})" if value is not None else ""
        super().__init__(f"{path}: {key}: {reason}{given}" if key else f"{path}: {reason}{given}")
        self.path, self.key, self.value = path, key, value


class ResultError(_OfFile, OSError):
    """Results that cannot be written or read back."""


class DataError(_OfFile, ValueError):
    """Measured data, of a file or of what is called `path`, that no run can be fitted to."""


class _Stopped(SphshellError):
    """A run that stopped at time `t` [s]; `result` holds all until then."""

    def __init__(self, t: float, why: str, result: Result) -> None:
        """Say when and why the run had to stop."""
        super().__init__(self._text.format(t=t, why=why))
        self.t, self.result = t, result

    _text = "interrupted at t = {t:.6g} s"


class SimulationDiverged(_Stopped, ArithmeticError):
    """The state stopped being finite at time `t` [s]; `result` holds all until then."""

    _text = (
        "the simulation diverged at t = {t:.6g} s: {why}; reduce dt, or the stiffness and "
        "damping, or take the integrator Implicit"
    )


class Interrupted(_Stopped, KeyboardInterrupt):
    """Ctrl-C during a run at time `t` [s]; `result` holds all until then."""

    def __init__(self, t: float, result: Result) -> None:
        """Say when the run was interrupted."""
        super().__init__(t, "", result)


class RowsFillMemory(_Stopped, MemoryError):
    """A run at time `t` [s] whose rows fill the memory; `result` holds all until then."""

    _text = "the run stopped at t = {t:.6g} s: {why}; state a record_dt, or a longer one"


class RunFailed(_Stopped, RuntimeError):
    """A user's routine that failed in a run at time `t` [s]; `result` holds all until then."""

    _text = "the run stopped at t = {t:.6g} s, its routine raised {why}"


class RolloutInterrupted(SphshellError, KeyboardInterrupt):
    """Ctrl-C during a rollout; `rollout` holds the runs that were finished."""

    def __init__(self, done: int, rollout: Rollout) -> None:
        """Say how many runs were `done`."""
        super().__init__(f"interrupted when {done} of {len(rollout)} runs were done")
        self.rollout = rollout


class NotPicklable(SphshellError, TypeError):
    """An object of one process, which cannot be pickled or copied."""


class Busy(SphshellError, RuntimeError):
    """An object for one caller at a time that is in use: `what`, and the call, `doing`."""

    def __init__(self, what: str, doing: str, thread: int) -> None:
        """Say that `what` is in its method `doing`, in the thread with the identifier `thread`."""
        if thread == threading.get_ident():
            why = f"this was called from within its own {doing}(): do it after that has returned"
        else:
            names = [one.name for one in threading.enumerate() if one.ident == thread]
            why = f"thread '{names[0] if names else thread}' is in its {doing}(): wait until that "
            why += "has returned, or make one for each thread"
        super().__init__(f"this {what} is busy: {why}")
        self.what, self.doing = what, doing


class SweepError(SphshellError, RuntimeError):
    """A sweep that cannot begin or go on; the runs that were done are kept."""


def add_origin(error: Exception, what: str) -> None:
    """Add a note to `error`, which user code has just raised: `what` raised it, and where."""
    place = error.__traceback__ and error.__traceback__.tb_next
    where = ""
    if place:
        code = place.tb_frame.f_code
        where = f" ({Path(code.co_filename).name}:{code.co_name}, line {place.tb_lineno})"
    error.add_note(f"raised by {what}{where}")


def _shown(value: Any) -> str:
    """Return `value` on one line, cut in the middle where it is long; of NumPy's the numbers."""
    is_numbers = type(value).__module__ == "numpy" and hasattr(value, "tolist")  # no ufunc
    if is_numbers and value.size < _LONGEST_VALUE:
        value = value.tolist()
    text = " ".join(repr(value).split())
    half = _LONGEST_VALUE // 2
    return text if len(text) <= _LONGEST_VALUE else f"{text[:half]} ... {text[-half:]}"
