"""The contacts of a run beside the exact faces of the CAD file that their shell was made of."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.base.arrays import Array, Ints, Mask
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import ContactLog
from sphshell_pin.errors import SphshellError, UnitWarning
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.schema import ShellSection
from sphshell_pin.shell.cad import CAD_SUFFIXES, CadOptions
from sphshell_pin.shell.contact_set import Feature

NOWHERE, ON_FACE = 0, 2
"""Kinds of places next to a contact, as `cad.jobs.stationary_points` returns them."""

_CANCELS, _ALIKE = 0.01, 0.03
"""A minimum and a saddle cancel whose depths differ by this share, and their normals by that."""


@dataclass(frozen=True)
class PairAudit:
    """How far the contacts of one pair are from those on the exact faces.

    `contacts` recorded that count, of them `unmatched` that no place of the faces corresponds to;
    of the others the largest and the root mean square difference in depth [m] and in normal [rad],
    0 if there are none; `file` that the faces are of.
    """

    name: str
    file: str
    contacts: int
    unmatched: int
    depth: tuple[float, float]
    normal: tuple[float, float]


@dataclass(frozen=True)
class CadAudit:
    """The audit of a run: figures by pair, and per logged contact what it is off.

    `depth_error` (m,) [m], positive where a contact is too deep, and `normal_error` (m,) [rad]; nan
    where the shell is no CAD surface, or where no place of the faces corresponds to the contact;
    of rings, of saddles, and of minima that a saddle cancels.
    """

    pairs: tuple[PairAudit, ...]
    depth_error: Array
    normal_error: Array

    def columns(self) -> dict[str, Array]:
        """Return the columns for contacts.csv, units in the names."""
        return {
            "cad_depth_error [m]": self.depth_error,
            "cad_normal_error [rad]": self.normal_error,
        }

    def figures(self) -> dict[str, dict[str, object]]:
        """Return the figures by pair, for summary.json."""
        return {
            pair.name: {
                "file": pair.file,
                "contacts": pair.contacts,
                "unmatched": pair.unmatched,
                "depth_error": dict(zip(("largest", "rms"), pair.depth, strict=True)),
                "normal_error": dict(zip(("largest", "rms"), pair.normal, strict=True)),
            }
            for pair in self.pairs
        }


def check_audit(built: Built) -> None:
    """Refuse an audit of a scenario without CAD surfaces, before it runs.

    Raises
    ------
    SphshellError
        No contact of the scenario is with a surface of a CAD file.
    """
    if not any(True for _ in _cad_pairs(built)):
        raise SphshellError(
            f"scenario '{built.name}' has no contact with a CAD surface: --audit-cad needs "
            f"a shell whose file is one of {', '.join(CAD_SUFFIXES)}"
        )


def audit_cad(built: Built, result: Result) -> CadAudit:
    """Project every recorded contact with a CAD surface on the trimmed faces of its file.

    The same place of the surface is meant: the stationary point of the distance from the sphere's
    center that is next to the contact, on a face inside its trimming, on an edge or a vertex.

    Raises
    ------
    SphshellError
        As `check_audit` and `Shell.from_file` do.
    """
    check_audit(built)
    log = result.contacts
    counts = _counts(log)
    depth_error, normal_error = (np.full(len(log.depth), np.nan) for _ in range(2))
    by_shell: dict[str, tuple[ShellSection, list[int]]] = {}
    for index, section in _cad_pairs(built):
        by_shell.setdefault(section.name, (section, []))[1].append(index)
    for section, indices in by_shell.values():
        own = np.flatnonzero(np.isin(log.pair, indices) & counts)
        depth_error[own], normal_error[own] = _audit_shell(built, result, section, own).T
    pairs: list[PairAudit] = []
    for index, section in _cad_pairs(built):
        errors = np.stack([depth_error, normal_error])[:, (log.pair == index) & counts]
        known = errors[:, np.isfinite(errors[0])]
        name, count = built.scene.pairs[index].name, errors.shape[1]
        off = map(_largest_and_rms, known)
        pairs.append(PairAudit(name, str(section.file), count, count - known.shape[1], *off))
    return CadAudit(tuple(pairs), depth_error, normal_error)


def _cad_pairs(built: Built) -> Iterator[tuple[int, ShellSection]]:
    """Walk the pairs whose shell is of a CAD file."""
    sections = {section.name: section for section in built.scenario.shell}
    for index, pair in enumerate(built.scene.pairs):
        names = [on_shell.shell.name for _, on_shell in pair.sphere_on_shell]
        if not names or names[0] not in sections:
            continue
        section = sections[names[0]]
        if section.file is not None and Path(section.file).suffix.lower() in CAD_SUFFIXES:
            yield index, section


def _counts(log: ContactLog) -> Mask:
    """Return which logged contacts (m,) are minima of their own.

    A saddle lies between two of them, where the faces need have nothing; a minimum as deep as its
    saddle adds nothing to the force: an element is bent a little too little there.
    """
    counts: Mask = (log.normal_force >= 0.0) & (log.feature != Feature.RING)
    for i in np.flatnonzero(log.normal_force < 0.0):
        begin, end = np.searchsorted(log.row, log.row[i] + np.arange(2))
        near = np.arange(begin, end)
        near = near[counts[near] & (log.pair[near] == log.pair[i])]
        alike = np.abs(log.normal_world[near] - log.normal_world[i]).max(axis=1) < _ALIKE
        alike &= np.abs(log.depth[near] - log.depth[i]) < _CANCELS * log.depth[i]
        # One saddle cancels one minimum, and the deepest always counts.
        counts[near[1:][alike[1:]][:1]] = False
    return counts


def _audit_shell(
    built: Built, result: Result, section: ShellSection, own: npt.NDArray[np.intp]
) -> Array:
    """Return what depth [m] and normal [rad] of the logged contacts `own` are off (k, 2)."""
    log, model = result.contacts, built.scene.model
    data = model.createData()
    centers, points, normals = (np.zeros((len(own), 3)) for _ in range(3))
    radii = np.zeros(len(own))
    shown = -1
    for place, i in enumerate(own.tolist()):
        pair = built.scene.pairs[log.pair[i]]
        if log.row[i] != shown:
            shown = int(log.row[i])
            pin.forwardKinematics(model, data, np.asarray(result.q[shown], dtype=float))
        shell = data.oMi[pair.joint_j] * pair.placement_j
        normals[place] = shell.rotation.T @ log.normal_world[i]
        points[place] = shell.actInv(log.point_world[i])
        radii[place] = pair.least_radius
        centers[place] = points[place] + (radii[place] - log.depth[i]) * normals[place]
    errors = np.full((len(own), 2), np.nan)
    for place, found in enumerate(zip(*_feet(section, built.path, centers, points), strict=True)):
        at, exact, kind = found
        offset, normal = centers[place] - at, normals[place]
        exact = exact if kind == ON_FACE else offset
        length = float(np.linalg.norm(exact))
        if kind == NOWHERE or length == 0.0:
            continue
        # On the side of the surface on which the contact is.
        exact = exact * np.sign(exact @ normal) / length
        depth = log.depth[own[place]]
        errors[place, 0] = depth - (radii[place] - float(offset @ exact))
        errors[place, 1] = np.arctan2(np.linalg.norm(np.cross(exact, normal)), exact @ normal)
    return errors


def _feet(
    section: ShellSection, path: Path, centers: Array, points: Array
) -> tuple[Array, Array, Ints]:
    """Return the places of the exact faces next to contacts, see `cad.jobs.stationary_points`."""
    from sphshell_pin.shell.cad.process import run_in_child

    file = path.parent / str(section.file)
    options = CadOptions(
        section.chord_error,
        section.bodies,
        section.faces if isinstance(section.faces, list) else None,
        time_limit=section.time_limit,
        memory_limit=section.memory_limit,
    )
    scale = section.scale if isinstance(section.scale, int | float) else 1.0
    arguments = (file, section.unit, options, (scale, section.magnify), centers, points)
    # It was reported when the shell was made.
    with warnings.catch_warnings(action="ignore", category=UnitWarning):
        found: tuple[Array, Array, Ints] = run_in_child(
            "stationary_points", arguments, file, "--audit-cad", options
        )
    return found


def _largest_and_rms(values: Array) -> tuple[float, float]:
    if not len(values):
        return 0.0, 0.0
    return float(np.abs(values).max()), float(np.sqrt(np.mean(values**2)))
