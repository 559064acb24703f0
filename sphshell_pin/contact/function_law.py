"""Laws of one's own: the force is a C function, or for trying a Python function."""

from __future__ import annotations

import copy
import ctypes
import math
import sys
import warnings
from _ctypes import CFuncPtr
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from sphshell_pin import _core
from sphshell_pin.checks import check_finite
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.errors import InvalidParameter, NotPicklable, SlowLawWarning
from sphshell_pin.parameters import Component, Parameter, parameter

_RATE = 1e-6  # over which the damping at rest is a difference [m/s]


@dataclass(frozen=True, init=False)
class FunctionLaw(NormalLaw, kind="function"):
    """A law of one's own.

    Slopes are differences of fourth order: they agree with a smooth force's to 1e-9. A number that
    is not finite raises SphshellError; exceptions of a Python function pass.

    Parameters
    ----------
    function : its force [N], `double force(double depth, double gap_rate, const double*
        parameters)`, in m and m/s, the gap rate negative while closing. A numba cfunc, a function
        pointer of ctypes or cffi, or an address, which must stay valid; a Python function, which
        gets the parameters as a tuple, is slow and takes the GIL (SlowLawWarning). It must be
        continuous and grow with the depth; below zero it counts as none
    energy : of the elastic part, that is of the force at rest [J], `double energy(double depth,
        const double* parameters)`; by default its integral by Gauss's rule, exact for sums of
        depth^(k/2), k <= 14, and the better the smoother the force is
    parameters : numbers by name, in the order in which the functions get them; attributes of the
        law, varied, fitted and differentiated as those of other laws

    Raises
    ------
    InvalidParameter
        No function, one with another signature, or a parameter that is no finite number or whose
        name cannot be an attribute.
    """

    function: Any
    parameters: Mapping[str, float]
    _energy: Any = field(repr=False)

    def __init__(
        self, function: Any, energy: Any = None, parameters: Mapping[str, float] | None = None
    ) -> None:
        """Check the functions' signatures and the parameters; call nothing."""
        python = _address("function", function, 3) is None
        if energy is not None:
            python |= _address("energy", energy, 2) is None
        numbers = {name: self._checked(name, x) for name, x in (parameters or {}).items()}
        for name, value in (("function", function), ("parameters", numbers), ("_energy", energy)):
            object.__setattr__(self, name, value)
        if python:
            said = "a FunctionLaw of a Python function is slow and takes the GIL at each contact: "
            said += "compile it, for instance by numba.cfunc"
            warnings.warn(said, SlowLawWarning, stacklevel=2)

    @classmethod
    def _checked(cls, name: object, value: object) -> float:
        if not isinstance(name, str) or not name.isidentifier() or hasattr(cls, name):
            must = "must be names of Python that a law has no other use for"
            raise InvalidParameter("parameters", name, must)
        return check_finite(f"parameters['{name}']", value)

    def __getattr__(self, name: str) -> float:
        """Return the parameter called `name`."""
        try:
            return self.__dict__["parameters"][name]  # type: ignore[no-any-return]
        except KeyError:
            raise AttributeError(f"{type(self).__name__} has no attribute '{name}'") from None

    def __hash__(self) -> int:
        """Return the hash of the numbers; function pointers of ctypes have none."""
        return hash(tuple(self.parameters.items()))

    @property
    def own_parameters(self) -> Mapping[str, Parameter]:
        """Descriptions of the parameters."""
        return {name: Parameter() for name in self.parameters}

    def changed(self, **numbers: object) -> FunctionLaw:
        """Return the law with other numbers."""
        new = copy.copy(self)
        checked = {name: self._checked(name, value) for name, value in numbers.items()}
        object.__setattr__(new, "parameters", {**self.parameters, **checked})
        return new

    @cached_property
    def _binding(self) -> _core.NormalLaw:
        """The C++ binding, which keeps the functions alive."""
        numbers = self._numbers()
        force = _routine("function", self.function, numbers, 3)
        energy = (0, None) if self._energy is None else _routine("energy", self._energy, numbers, 2)
        return _core.NormalLaw.of_function(numbers, *force, *energy)

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        numbers = (f"{name} {value:.4g}" for name, value in self.parameters.items())
        return ", ".join([f"function {getattr(self.function, '__name__', 'in C')}", *numbers])

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        closing, opening = (self.normal_force(depth, rate) for rate in (-_RATE, _RATE))
        damping = (closing - opening) / (2 * _RATE)
        return mass / damping if damping > 0 else math.inf

    def __getstate__(self) -> dict[str, object]:
        """Raise NotPicklable for C functions; Python functions are pickled by their names."""
        for name, one in (("function", self.function), ("energy", self._energy)):
            if one is not None and _address(name, one, 3 if name == "function" else 2) is not None:
                raise NotPicklable(
                    "a FunctionLaw of a C function cannot be pickled, as its address is valid in "
                    "this process alone: make the law anew in the other one"
                )
        return super().__getstate__()

    def __copy__(self) -> FunctionLaw:
        """Return a law of the same functions."""
        new = object.__new__(type(self))
        new.__dict__.update(super().__getstate__())
        return new

    def __deepcopy__(self, memo: object) -> FunctionLaw:
        """Return itself, as nothing of it changes."""
        return self


@dataclass(frozen=True)
class FunctionFile(Component, kind="function", of=NormalLaw):
    """A law of one's own as a scenario states it."""

    function: str = parameter(help='"file.py:name" of the force')
    energy: str | None = parameter(None, help='"file.py:name" of the energy')
    parameters: Mapping[str, float] | None = parameter(None, help="numbers by name")

    @property
    def files(self) -> tuple[str, ...]:
        """The files of the functions."""
        named = [one for one in (self.function, self.energy) if one]
        return tuple(one.rpartition(":")[0] for one in named)

    def loaded(self, load: Callable[[str, str], Any]) -> FunctionLaw:
        """Return the law; `load("file.py:name", key)` gives a function, `key` is that of here."""
        energy = load(self.energy, "energy") if self.energy else None
        return FunctionLaw(load(self.function, "function"), energy, self.parameters)

    def _build(self, folder: Path = Path()) -> FunctionLaw:
        """Raise InvalidParameter: where a law is no contact's, no code is executed."""
        must = "must be no function here: laws of one's own are for contacts and sources"
        raise InvalidParameter("law", self.function, must)


def _address(name: str, function: Any, count: int) -> int | None:
    """Return the address of a C function of `count` arguments, None for a Python function."""
    if isinstance(getattr(function, "address", None), int):  # numba
        _check_signature(name, function.ctypes, count)
        return int(function.address)
    if isinstance(function, CFuncPtr):
        _check_signature(name, function, count)
        found = ctypes.cast(function, ctypes.c_void_p).value
    elif type(function).__module__ == "_cffi_backend":
        ffi = sys.modules["_cffi_backend"].FFI()
        found = int(ffi.cast("uintptr_t", function))
    elif isinstance(function, int) and not isinstance(function, bool):
        found = function
    elif callable(function):
        return None
    else:
        must = "must be a C function pointer (numba.cfunc, ctypes, cffi) or a Python function"
        raise InvalidParameter(name, function, must)
    if not found or found < 0:
        raise InvalidParameter(name, function, "must not be null")
    return found


def _check_signature(name: str, pointer: Any, count: int) -> None:
    """Raise InvalidParameter for a declared signature that is another one."""
    given = pointer.argtypes
    if given is None:
        return  # not declared
    numbers, last = given[:-1], given[-1] if given else None
    is_pointer = last is ctypes.c_void_p or hasattr(last, "contents")
    doubles = all(one is ctypes.c_double for one in (pointer.restype, *numbers))
    if len(given) != count or not is_pointer or not doubles:
        where = "double depth, double gap_rate" if count == 3 else "double depth"
        must = f"must be a double f({where}, const double* parameters)"
        raise InvalidParameter(name, pointer, must)


def _routine(name: str, function: Any, numbers: list[float], count: int) -> tuple[int, object]:
    """Return the address of a function and what keeps it alive; 0 and a checked Python function."""
    address = _address(name, function, count)
    if address is not None:
        return address, function
    parameters = tuple(numbers)

    def checked(*where: float) -> float:
        answer = function(*where, parameters)
        try:
            return float(answer)
        except (TypeError, ValueError):
            must = "must return a number"
            raise InvalidParameter(name, answer, must, f"returns {answer!r},") from None

    return 0, checked
