"""Friction of one's own: its force is a C function, or for trying a Python function."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base.parameters import Component, parameter
from sphshell_pin.contact.friction import Friction
from sphshell_pin.contact.normal_law import DECAYS_PER_PERIOD
from sphshell_pin.contact.own_functions import OwnFunctions
from sphshell_pin.errors import InvalidParameter

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
class FunctionFrictionFile(Component, kind="function", of=Friction):
    """Friction of one's own as a scenario states it.

    Parameters
    ----------
    function : "file.py:name" of the force
    parameters : numbers by name
    """

    function: str = parameter()
    parameters: Mapping[str, float] | None = parameter(None)

    @property
    def files(self) -> tuple[str, ...]:
        """The file of the function."""
        return (self.function.rpartition(":")[0],)

    def loaded(self, load: Callable[[str, str], object]) -> FunctionFriction:
        """Return the friction; `load("file.py:name", key)` gives a function."""
        return FunctionFriction(load(self.function, "function"), self.parameters)

    def _build(self, folder: Path = Path()) -> FunctionFriction:
        """Raise InvalidParameter: where friction is no contact's, no code is executed."""
        must = "must be no function here: friction of one's own is for contacts and sources"
        raise InvalidParameter("friction", self.function, must)
