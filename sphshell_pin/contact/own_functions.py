"""What laws of one's own have in common: C functions, or for trying Python functions."""

import copy
import ctypes
import dataclasses
import sys
import warnings
from _ctypes import CFuncPtr
from collections.abc import Mapping
from typing import Any, Self

from sphshell_pin.base.checks import check_finite
from sphshell_pin.base.parameters import Parameter
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
