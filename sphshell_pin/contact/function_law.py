"""Laws of one's own: the force is a C function, or for trying a Python function."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from sphshell_pin import _core
from sphshell_pin.base.parameters import Component, parameter
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.contact.own_functions import OwnFunctions
from sphshell_pin.errors import InvalidParameter

_RATE = 1e-6  # over which the damping at rest is a difference [m/s]


@dataclass(frozen=True, init=False)
class FunctionLaw(OwnFunctions, NormalLaw, kind="function"):
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
class FunctionFile(Component, kind="function", of=NormalLaw):
    """A law of one's own as a scenario states it.

    Parameters
    ----------
    function : "file.py:name" of the force
    energy : "file.py:name" of the energy
    parameters : numbers by name
    """

    function: str = parameter()
    energy: str | None = parameter(None)
    parameters: Mapping[str, float] | None = parameter(None)

    @property
    def files(self) -> tuple[str, ...]:
        """The files of the functions."""
        named = [one for one in (self.function, self.energy) if one]
        return tuple(one.rpartition(":")[0] for one in named)

    def loaded(self, load: Callable[[str, str], object]) -> FunctionLaw:
        """Return the law; `load("file.py:name", key)` gives a function, `key` is that of here."""
        energy = load(self.energy, "energy") if self.energy else None
        return FunctionLaw(load(self.function, "function"), energy, self.parameters)

    def _build(self, folder: Path = Path()) -> FunctionLaw:
        """Raise InvalidParameter: where a law is no contact's, no code is executed."""
        must = "must be no function here: laws of one's own are for contacts and sources"
        raise InvalidParameter("law", self.function, must)
