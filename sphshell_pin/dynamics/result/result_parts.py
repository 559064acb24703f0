"""What a result is made of: the contact log, events, the energy audit, and where it came from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.dynamics.scene.scene_contacts import SceneContacts


@dataclass(frozen=True, repr=False)
class ContactLog(SceneContacts):
    """Every contact of every recorded row: the columns of SceneContacts, and when.

    With m logged contacts: `t` (m,) [s], `row` (m,) index into the result's rows.
    """

    t: Array
    row: Longs

    def _facts(self) -> list[Fact]:
        rows = len(np.unique(self.row))
        return [*super()._facts(), Fact("recorded rows with contact", rows, brief=False)]

    def _rows(self) -> None:
        return None  # its entries are those of many moments

    def of_pair(self, pair: int) -> ContactLog:
        """Return the entries of one pair."""
        keep = self.pair == pair
        return ContactLog(**{f.name: getattr(self, f.name)[keep] for f in fields(self)})

    def at_row(self, row: int) -> SceneContacts:
        """Return the contacts of one of the result's rows."""
        first, last = np.searchsorted(self.row, (row, row + 1))
        return SceneContacts(
            **{f.name: getattr(self, f.name)[first:last] for f in fields(SceneContacts)}
        )


@dataclass(frozen=True)
class Event:
    """Something that happened at time `t` [s] to the pair, or the joint, called `pair`.

    `kind` of a pair: "touch", "lift_off", "deep" (the depth passed half the sphere's radius),
    "through" (the sphere's center was pushed through the shell; it is pushed back) or
    "beyond_hertz" (HertzLaw's theory no longer holds: the ellipse of contact is more than half as
    long as the sphere, or the shell is a socket of nearly its radius). Of a joint:
    "stop" (it reached the end of its range), "effort_limit" (the controller's torque is cut),
    "speed_limit" (it is too fast), and "stop_left", "effort_limit_left", "speed_limit_left".
    """

    t: float
    pair: str
    kind: str


@dataclass(frozen=True, repr=False)
class EnergyAudit(Summarized):
    """Where the energy is and where it went, (n,) [J] at the result's rows.

    `kinetic` and `potential` (gravity) of the model, `elastic` of the contacts and stops of joints,
    stretched bristles included; since the start: `damping_loss` and `friction_loss` of the contacts
    and joints, `control_work` of the controller.
    """

    kinetic: Array
    potential: Array
    elastic: Array
    damping_loss: Array
    friction_loss: Array
    control_work: Array

    def _facts(self) -> list[Fact]:
        parts = [
            Fact(f"{f.name.replace('_', ' ')} at the end", _last(getattr(self, f.name)), "J", False)
            for f in fields(self)
        ]
        return [
            Fact("rows", len(self.kinetic)),
            Fact("exchanged", self.exchanged, "J"),
            Fact("residual at the end", _last(self.residual), "J"),
            *parts,
        ]

    @property
    def total(self) -> Array:
        """Energy stored and lost, less the controller's work (n,) [J]: it should not change."""
        return (
            self.kinetic
            + self.potential
            + self.elastic
            + self.damping_loss
            + self.friction_loss
            - self.control_work
        )

    @property
    def residual(self) -> Array:
        """Energy that appeared from nowhere since the start (n,) [J]: the integration's error."""
        return self.total - self.total[:1]

    @property
    def exchanged(self) -> float:
        """Energy that changed form [J]: the scale on which to judge the residual.

        Sum over kinetic, potential and elastic energy of what each moved up and down in total
        between rows, halved, plus losses and the work of the controller.
        """
        until = self.exchanged_until
        return float(until[-1]) if len(until) else 0.0

    @property
    def exchanged_until(self) -> Array:
        """The same from the start until each row (n,) [J]."""
        parts = np.array([getattr(self, f.name) for f in fields(self)])
        steps = np.abs(np.diff(parts, axis=1, prepend=parts[:, :1])).sum(axis=0)
        return np.asarray(0.5 * np.cumsum(steps))


@dataclass(frozen=True)
class Kept:
    """What is kept of a scene, so that it can be shown without its files: JSON, and arrays."""

    contents: dict[str, object]
    arrays: Mapping[str, NDArray[np.generic]]


@dataclass(frozen=True)
class Origin:
    """The scenario that ran: `scenario`, a shipped name or a path, with all its `settings`.

    The settings, as JSON knows them, are those of the run, changed ones included. `keep` gives the
    robots and surfaces as they were used; None where an earlier version saved the result.
    """

    scenario: str
    settings: dict[str, object]
    keep: Callable[[], Kept] | None = field(default=None, repr=False, compare=False)


def _last(values: Array) -> float:
    return float(values[-1]) if len(values) else np.nan
