"""Laws and friction as the user's own functions, in Python or compiled."""

import copy
import ctypes
import dataclasses
import math
import warnings
from _ctypes import CFuncPtr
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base.checks import check_finite
from sphshell_pin.base.parameters import Component, Parameter, parameter
from sphshell_pin.contact.friction import Friction
from sphshell_pin.contact.normal_law import DECAYS_PER_PERIOD, NormalLaw
from sphshell_pin.errors import InvalidParameter, NotPicklable, SlowLawWarning


class OwnFunctions:
    """What a law of a user's `function` is beside a law; its parameters are attributes."""

    function: object
    parameters: Mapping[str, float]

    def _take(
        self, function: object, parameters: Mapping[str, float] | None, **more: object
    ) -> None:
        """Check the functions' signatures and the parameters, and keep them; call nothing."""
        numbers = {name: self._checked(name, x) for name, x in (parameters or {}).items()}
        for name, value in {"function": function, "parameters": numbers, **more}.items():
            object.__setattr__(self, name, value)
        if any(_address(*one) is None for one in self._functions):
            said = f"a {type(self).__name__} of a Python function is slow and takes the GIL at "
            said += "each contact: compile it, for instance by numba.cfunc"
            warnings.warn(said, SlowLawWarning, stacklevel=3)

    @property
    def _functions(self) -> tuple[tuple[str, object, int], ...]:
        """Name, function and number of arguments of each that is given."""
        return (("function", self.function, 3),)

    @classmethod
    def _checked(cls, name: object, value: object) -> float:
        used = {field.name for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
        valid = isinstance(name, str) and name.isidentifier() and name not in used
        if not valid or hasattr(cls, str(name)):
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

    def changed(self, **numbers: object) -> Self:
        """Return the law with other numbers."""
        new = copy.copy(self)
        checked = {name: self._checked(name, value) for name, value in numbers.items()}
        object.__setattr__(new, "parameters", {**self.parameters, **checked})
        return new

    def _routines(self) -> list[tuple[int, object]]:
        """Return of each function its address and what keeps it alive, as the core takes them."""
        numbers = list(self.parameters.values())
        return [_routine(name, one, numbers, count) for name, one, count in self._functions]

    @property
    def _function_text(self) -> str:
        numbers = (f"{name} {value:.4g}" for name, value in self.parameters.items())
        return ", ".join([f"function {getattr(self.function, '__name__', 'in C')}", *numbers])

    def __getstate__(self) -> dict[str, object]:
        """Raise NotPicklable for C functions; Python functions are pickled by their names."""
        for name, one, count in self._functions:
            if _address(name, one, count) is not None:
                raise NotPicklable(
                    f"a {type(self).__name__} of a C function cannot be pickled, as its address is "
                    "valid in this process alone: make the law anew in the other one"
                )
        state: dict[str, object] = super().__getstate__()  # type: ignore[assignment]
        return state

    def __copy__(self) -> Self:
        """Return a law of the same functions."""
        new = object.__new__(type(self))
        new.__dict__.update({k: v for k, v in self.__dict__.items() if k != "_binding"})
        return new

    def __deepcopy__(self, memo: object) -> Self:
        """Return itself, as nothing of it changes."""
        return self


def _address(name: str, function: Any, count: int) -> int | None:
    """Return the address of a C function of `count` arguments, None for a Python function."""
    if isinstance(getattr(function, "address", None), int):  # numba
        _check_signature(name, function.ctypes, count)
        return int(function.address)
    if isinstance(function, CFuncPtr):
        _check_signature(name, function, count)
        found = ctypes.cast(function, ctypes.c_void_p).value
        if not found:
            raise InvalidParameter(name, function, "must not be null")
        return found
    if callable(function):
        return None
    must = "must be a C function pointer (numba.cfunc, ctypes) or a Python function"
    raise InvalidParameter(name, function, must)


def _check_signature(name: str, pointer: Any, count: int) -> None:
    """Raise InvalidParameter for a declared signature that is another one."""
    given = pointer.argtypes
    if given is None:
        return  # not declared
    numbers, last = given[:-1], given[-1] if given else None
    is_pointer = last is ctypes.c_void_p or hasattr(last, "contents")
    doubles = all(one is ctypes.c_double for one in (pointer.restype, *numbers))
    if len(given) != count or not is_pointer or not doubles:
        must = f"must be a double f({'double, ' * (count - 1)}const double* parameters)"
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
        except OverflowError:
            must = "must return a number below 1e308"
            raise InvalidParameter(name, 0.0, must, "returns a larger one,") from None
        except (TypeError, ValueError):
            must = "must return a number"
            raise InvalidParameter(name, answer, must, f"returns {answer!r},") from None

    return 0, checked


_RATE = 1e-6  # over which the damping at rest is a difference [m/s]


@dataclass(frozen=True, init=False)
class FunctionLaw(OwnFunctions, NormalLaw, kind="function"):
    """A law of one's own.

    Slopes are differences of fourth order: they agree with a smooth force's to 1e-9. A number that
    is not finite raises SphshellError; exceptions of a Python function pass.

    Parameters
    ----------
    function : its force [N], `double force(double depth, double gap_rate, const double*
        parameters)`, in m and m/s, the gap rate negative while closing. A numba cfunc or a function
        pointer of ctypes, which must stay valid; a Python function, which gets the parameters as a
        tuple, is slow and takes the GIL (SlowLawWarning). It must be continuous and grow with the
        depth; below zero it counts as none
    energy : of the elastic part, that is of the force at rest [J], `double energy(double depth,
        const double* parameters)`; by default its integral, adaptive to about 1e-11 once for each
        set of parameters, kinks included
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
    _energy: object = field(repr=False)

    def __init__(
        self, function: object, energy: object = None, parameters: Mapping[str, float] | None = None
    ) -> None:
        """Check the functions' signatures and the parameters; call nothing."""
        self._take(function, parameters, _energy=energy)

    __hash__ = OwnFunctions.__hash__

    @property
    def _functions(self) -> tuple[tuple[str, object, int], ...]:
        energy = () if self._energy is None else (("energy", self._energy, 2),)
        return (("function", self.function, 3), *energy)

    @cached_property
    def _binding(self) -> _core.NormalLaw:
        """The C++ binding, which keeps the functions alive."""
        force, *energy = self._routines()
        return _core.NormalLaw.of_function(self._numbers(), *force, *(*energy, (0, None))[0])

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        return self._function_text

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        closing, opening = (self.normal_force(depth, rate) for rate in (-_RATE, _RATE))
        damping = (closing - opening) / (2 * _RATE)
        return mass / damping if damping > 0 else math.inf


@dataclass(frozen=True)
class _OfFunction(Component):
    """What a scenario states of a function of one's own.

    Parameters
    ----------
    function : "file.py:name" of the force
    parameters : numbers by name
    """

    function: str = parameter()
    parameters: Mapping[str, float] | None = parameter(None)

    @property
    def files(self) -> tuple[str, ...]:
        """The files of the functions."""
        named = self.function, getattr(self, "energy", None)
        return tuple(one.rpartition(":")[0] for one in named if one)

    def _build(self, folder: Path = Path()) -> NoReturn:
        """Raise InvalidParameter: where nothing touches, no code is executed."""
        must = "must be no function here: functions of one's own are for contacts and sources"
        raise InvalidParameter("function", self.function, must)


@dataclass(frozen=True)
class FunctionFile(_OfFunction, kind="function", of=NormalLaw):
    """A law of one's own as a scenario states it.

    Parameters
    ----------
    energy : "file.py:name" of the energy
    """

    energy: str | None = parameter(None)

    def loaded(self, load: Callable[[str, str], object]) -> FunctionLaw:
        """Return the law; `load("file.py:name", key)` gives a function, `key` is that of here."""
        energy = load(self.energy, "energy") if self.energy else None
        return FunctionLaw(load(self.function, "function"), energy, self.parameters)


_SLOW = 1e-6  # a slower slip bears a force in proportion [m/s]
_SPEEDS = np.logspace(-6, 1, 71)  # [m/s]


@dataclass(frozen=True, init=False)
class FunctionFriction(OwnFunctions, Friction, kind="function"):
    """Friction of one's own, by slip speed and normal force; it creeps under load.

    What holds for the functions of a FunctionLaw holds for this one: compiled, its derivatives, its
    faults.

    Parameters
    ----------
    function : the size of the force [N], which opposes the slip, `double friction(double
        slip_speed, double normal_force, const double* parameters)`, in m/s and N. It must be
        continuous and grow from zero at rest, as CoulombFriction does below its `v_static`: the
        slip at which it is large is what it creeps by, and a steep rise needs a small dt. Below
        zero it counts as none, and a slip below 1e-6 m/s bears a force in proportion
    parameters : numbers by name, as of a FunctionLaw

    Raises
    ------
    InvalidParameter
        As of a FunctionLaw.
    """

    function: object
    parameters: Mapping[str, float]

    def __init__(self, function: object, parameters: Mapping[str, float] | None = None) -> None:
        """Check the function's signature and the parameters; call nothing."""
        self._take(function, parameters)

    __hash__ = OwnFunctions.__hash__

    @cached_property
    def _binding(self) -> _core.FrictionLaw:
        """The C++ binding, which keeps the function alive."""
        (force,) = self._routines()
        return _core.FrictionLaw.of_function(self._numbers(), *force)

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        return f"{self._function_text}; creeps under load"

    @cached_property
    def sticking_speed(self) -> float:
        """The least slip speed [m/s] at which it is within 1 % of its largest, under 1 N."""
        found = np.array([self.coefficient(speed) for speed in _SPEEDS])
        return float(_SPEEDS[np.argmax(found >= 0.99 * found.max())])

    @property
    def vanishes_at_rest(self) -> bool:
        """Whether under 1 N it falls to a tenth of its largest before slips are too slow to see."""
        return self.coefficient(_SLOW) <= 0.1 * self.largest_coefficient

    @property
    def largest_coefficient(self) -> float:
        """The coefficient at `sticking_speed`, under 1 N."""
        return self.coefficient(self.sticking_speed)

    def slip_time(self, mass: float, load: float, disc: float) -> float:
        """Return 20 times the decay of a slow slip [s]."""
        damper = load * self.coefficient(_SLOW, load) / _SLOW if load > 0 else 0.0
        return DECAYS_PER_PERIOD * mass / damper if damper > 0 else math.inf


@dataclass(frozen=True)
class FunctionFrictionFile(_OfFunction, kind="function", of=Friction):
    """Friction of one's own as a scenario states it."""

    def loaded(self, load: Callable[[str, str], object]) -> FunctionFriction:
        """Return the friction; `load("file.py:name", key)` gives a function."""
        return FunctionFriction(load(self.function, "function"), self.parameters)
