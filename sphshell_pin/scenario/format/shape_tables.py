"""Primitive shapes that a scenario states by their sizes."""

from dataclasses import dataclass, fields
from typing import TypedDict, Unpack

import coal
import numpy as np

from sphshell_pin.base.parameters import Component, parameter
from sphshell_pin.scenario.format.typed_tables import Lengths3
from sphshell_pin.shell import Shell


class ShellOptions(TypedDict):
    """What a shell of a primitive takes besides its sizes."""

    chord_error: float | None
    segments: int | None
    side: str
    crease_angle: float
    name: str


class Primitive(Component):
    """Base of the shapes that a scenario states by their sizes; centered, axes along z."""

    def shell(self, **options: Unpack[ShellOptions]) -> Shell:
        """Return its surface."""
        return Shell.from_geometry(self.geometry(), **options)

    def geometry(self) -> coal.ShapeBase:
        """Return it as Coal has it: its class takes the sizes in the order of the fields."""
        shape = getattr(coal, type(self).__name__)
        return shape(*np.hstack([getattr(self, one.name) for one in fields(self)]))


@dataclass(frozen=True)
class Box(Primitive, kind="box"):
    """A box.

    Parameters
    ----------
    size : edge lengths along x, y, z
    """

    size: Lengths3 = parameter(unit="m")


@dataclass(frozen=True)
class Ball(Primitive, kind="sphere"):
    """A ball.

    Parameters
    ----------
    radius : radius
    """

    radius: float = parameter(above=0, unit="m")

    def geometry(self) -> coal.Sphere:
        """Return it as Coal has it."""
        return coal.Sphere(self.radius)


@dataclass(frozen=True)
class _Round(Primitive):
    """What all of them have.

    Parameters
    ----------
    radius : radius
    length : length along z, of a capsule without caps
    """

    radius: float = parameter(above=0, unit="m")
    length: float = parameter(above=0, unit="m")


@dataclass(frozen=True)
class Cylinder(_Round, kind="cylinder"):
    """A cylinder."""


@dataclass(frozen=True)
class Capsule(_Round, kind="capsule"):
    """A capsule."""


@dataclass(frozen=True)
class Cone(_Round, kind="cone"):
    """A cone."""


@dataclass(frozen=True)
class Ellipsoid(Primitive, kind="ellipsoid"):
    """An ellipsoid.

    Parameters
    ----------
    radii : half axes along x, y, z
    """

    radii: Lengths3 = parameter(unit="m")


@dataclass(frozen=True)
class HalfSpace(Primitive, kind="half-space"):
    """A square in the plane z = 0, facing +z.

    Parameters
    ----------
    extent : edge length
    """

    extent: float = parameter(10.0, above=0, unit="m")

    def shell(self, **options: Unpack[ShellOptions]) -> Shell:
        """Return its surface."""
        plane = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        return Shell.from_geometry(plane, extent=self.extent, **options)
