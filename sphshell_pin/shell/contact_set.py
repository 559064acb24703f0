"""The contacts of one sphere with one shell, as columns."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Bytes, Ints
from sphshell_pin.base.checks import read_only
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.errors import InvalidParameter, NameNotFound


class Feature(IntEnum):
    """What of the surface the sphere touches."""

    FACE = 0
    EDGE = 1
    VERTEX = 2
    RING = 3


class Method(IntEnum):
    """How contacts are found; the names are lower case in public arguments."""

    FACETS = 0
    ELEMENTS = 1
    SMOOTH = 2

    @classmethod
    def from_name(cls, name: str) -> Method:
        """Look up "facets", "elements" or "smooth"; NameNotFound lists the valid ones."""
        if isinstance(name, str) and name in _METHODS:
            return _METHODS[name]
        raise NameNotFound("method", str(name), "the contact query", [m.name.lower() for m in cls])


_METHODS = {method.name.lower(): method for method in Method}


class ElasticLaw(Protocol):
    """The elastic part of a normal law, see `sphshell_pin.contact.NormalLaw`."""

    def normal_force(self, depth: float) -> float:
        """Force [N] at a depth [m]."""

    def normal_stiffness(self, depth: float) -> float:
        """Its derivative [N/m]."""

    def energy(self, depth: float) -> float:
        """Energy [J] at a depth [m]."""


@dataclass(frozen=True, repr=False)
class ContactSet(Summarized):
    """Contacts, deepest first, in the shell's frame.

    With k contacts: `point` (k, 3) on the shell [m]; `normal` (k, 3) unit, from the shell to the
    sphere's center, of a ring the mean of those all around; `depth` (k,) > 0 [m]; `element` (k,)
    row of shell.elements (of an edge or a vertex, one of those that share it); `patch` (k,) smooth
    piece of the surface; `feature` (k,) values of Feature; `weight` (k,) by which a contact's force
    counts: 1, but -1 at a saddle, where two components of the surface inside the sphere merge
    (method "smooth" only, where the sphere reaches a concave crease between them); `turn`
    (k, 3, 3), if asked for: derivative of weight * normal with respect to the center [1/m].

    Minima that are nearly one, as beside the joint of two curved elements, are shown as one
    contact. `terms` are the minima and saddles themselves: force and energy are their sums.
    """

    point: Array
    normal: Array
    depth: Array
    element: Ints
    patch: Ints
    feature: Bytes
    weight: Array
    turn: Array | None = None
    summed: ContactSet | None = None

    @classmethod
    def from_rows(
        cls, rows: bytes, terms: bytes | None, gradient: bool, patches: Ints
    ) -> ContactSet:
        """Build from the core's rows of contacts, and of `terms` where these are more.

        A column is made when it is first read. `patches` (m,) are those of the elements.
        """
        contacts = object.__new__(cls)
        kept = contacts.__dict__
        kept["_rows_of_core"], kept["_patches"] = rows, patches
        if gradient:
            kept["turn"] = _column(rows, "turn").reshape(-1, 3, 3)
        if terms is not None:
            kept["summed"] = cls.from_rows(terms, None, gradient, patches)
        return contacts

    def __getattr__(self, name: str) -> NDArray[np.generic]:
        """Return a column that has not been read yet."""
        kept = self.__dict__
        if "_rows_of_core" not in kept or name not in _COLUMNS:
            raise AttributeError(f"'{type(self).__name__}' object has no attribute '{name}'")
        if name == "patch":
            column = read_only(kept["_patches"][self.element])
        else:
            column = _column(kept["_rows_of_core"], name)
        kept[name] = column
        return column

    def __reduce__(self) -> tuple[type[ContactSet], tuple[object, ...]]:
        """Pickle the columns, not what they are made of."""
        return type(self), tuple(getattr(self, one.name) for one in fields(self))

    @property
    def terms(self) -> ContactSet:
        """The minima and saddles that are summed: the set itself, unless some are shown as one."""
        return self if self.summed is None else self.summed

    def __len__(self) -> int:
        """Return the number of contacts."""
        return len(self.depth)

    def _facts(self) -> list[Fact]:
        facts = [Fact("contacts", len(self))]
        if len(self):
            found = [Feature(int(one)).name.lower() for one in np.unique(self.feature)]
            facts.append(Fact("largest depth", float(self.depth.max()), "m"))
            facts += [Fact("on", found[0])] if len(found) == 1 else []
        saddles, merge = int(np.count_nonzero(self.weight < 0)), "at which contacts merge"
        if saddles:
            facts.append(Fact(f"saddles {merge}", saddles, one=f"saddle {merge}"))
        return facts

    def force(self, law: ElasticLaw) -> Array:
        """Return the elastic force (3,) on the sphere [N], in the shell's frame: no damping."""
        terms = self.terms
        magnitude = np.array([law.normal_force(depth) for depth in terms.depth])
        return np.asarray((terms.weight * magnitude) @ terms.normal)

    def energy(self, law: ElasticLaw) -> float:
        """Return the elastic energy [J]: `force` is minus its gradient."""
        terms = self.terms
        return float(terms.weight @ np.array([law.energy(depth) for depth in terms.depth]))

    def force_gradient(self, law: ElasticLaw) -> Array:
        """Return the derivative (3, 3) of `force` with respect to the sphere's center [N/m].

        Of contacts that were found with gradient=True; it is symmetric. With n the normal, t the
        turn and F the law's elastic force: the sum over `terms` of F t - F' weight n n^T.
        """
        terms = self.terms
        if terms.turn is None:
            raise InvalidParameter(
                "contacts", self, "have no derivative: ask for them with gradient=True"
            )
        force = np.array([law.normal_force(depth) for depth in terms.depth])
        stiffness = np.array([law.normal_stiffness(depth) for depth in terms.depth])
        return np.asarray(
            np.einsum("k,kxy->xy", force, terms.turn)
            - np.einsum("k,kx,ky->xy", stiffness * terms.weight, terms.normal, terms.normal)
        )


_ROW = np.dtype(_core.shell_contact_row_type())
_COLUMNS = frozenset(("patch", *(_ROW.names or ())))


def _column(rows: bytes, name: str) -> NDArray[np.generic]:
    """Return a field of the core's rows."""
    return read_only(np.ascontiguousarray(np.frombuffer(rows, _ROW)[name]))
