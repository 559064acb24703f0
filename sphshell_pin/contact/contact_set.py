"""The contacts of one sphere with one shell, as columns."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.errors import InvalidParameter, NameNotFound

Array = NDArray[np.float64]


class Feature(IntEnum):
    """What of the surface the sphere touches."""

    FACE = 0
    EDGE = 1
    VERTEX = 2


class Method(IntEnum):
    """How contacts are found; the names are lower case in public arguments."""

    FACETS = 0
    ELEMENTS = 1
    SMOOTH = 2

    @classmethod
    def from_name(cls, name: str) -> Method:
        """Look up "facets", "elements" or "smooth"; NameNotFound lists the valid ones."""
        for method in cls:
            if isinstance(name, str) and method.name.lower() == name:
                return method
        raise NameNotFound("method", str(name), "the contact query", [m.name.lower() for m in cls])


@dataclass(frozen=True)
class ContactSet:
    """Places of touch, deepest first, in the shell's frame.

    With k contacts: `point` (k, 3) on the shell [m]; `normal` (k, 3) unit, from the shell to the
    sphere's centre; `depth` (k,) > 0 [m]; `element` (k,) row of shell.elements (of an edge or a
    vertex, one of those that share it); `patch` (k,) smooth piece of the surface; `feature` (k,)
    values of Feature; `weight` (k,) by which a contact's force counts: 1, but -1 at a saddle,
    where two components of the surface inside the sphere merge (method "smooth" only, where the
    sphere reaches a concave crease between them); `turn` (k, 3, 3), if asked for: derivative of
    weight * normal with respect to the centre [1/m].

    Minima that are nearly one, as beside the joint of two curved elements, are shown as one
    contact. `terms` are the minima and saddles themselves: force and energy are their sums.
    """

    point: Array
    normal: Array
    depth: Array
    element: NDArray[np.int32]
    patch: NDArray[np.int32]
    feature: NDArray[np.uint8]
    weight: Array
    turn: Array | None = None
    summed: ContactSet | None = None

    @property
    def terms(self) -> ContactSet:
        """The minima and saddles that are summed: the set itself, unless some are shown as one."""
        return self if self.summed is None else self.summed

    def __len__(self) -> int:
        """Return the number of contacts."""
        return len(self.depth)

    def force(self, law: NormalLaw) -> Array:
        """Return the elastic push (3,) on the sphere [N], in the shell's frame: no damping."""
        terms = self.terms
        push = np.array([law.normal_force(depth) for depth in terms.depth])
        return np.asarray((terms.weight * push) @ terms.normal)

    def energy(self, law: NormalLaw) -> float:
        """Return the elastic energy [J]: `force` is minus its gradient."""
        terms = self.terms
        return float(terms.weight @ np.array([law.energy(depth) for depth in terms.depth]))

    def force_gradient(self, law: NormalLaw) -> Array:
        """Return the derivative (3, 3) of `force` with respect to the sphere's centre [N/m].

        Of contacts that were found with gradient=True; it is symmetric. With n the normal, t the
        turn and F the law's elastic force: the sum over `terms` of F t - F' weight n n^T.
        """
        terms = self.terms
        if terms.turn is None:
            raise InvalidParameter(
                "contacts", self, "know no turn: ask for them with gradient=True"
            )
        total = np.zeros((3, 3))
        for depth, normal, weight, turn in zip(
            terms.depth, terms.normal, terms.weight, terms.turn, strict=True
        ):
            total += law.normal_force(depth) * turn
            total -= law.normal_stiffness(depth) * weight * np.outer(normal, normal)
        return total
