"""The contacts of a run beside the exact faces of the CAD file that their shell was made of."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.errors import SphshellError, UnitWarning
from sphshell_pin.scenario.build import Built
from sphshell_pin.shell.cad import CAD_SUFFIXES, CadOptions, require_kernel

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result import Result
    from sphshell_pin.scenario.schema import ShellSection
    from sphshell_pin.shell.cad.trimmed import TrimmedFaces

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class PairAudit:
    """How far the contacts of one pair are from those on the exact faces.

    `contacts` recorded, of them `unmatched` that no place of the faces corresponds to; of the
    others the largest and the root mean square difference in depth [m] and in normal [rad], 0 if
    there are none; `file` that the faces are of.
    """

    name: str
    file: str
    contacts: int
    unmatched: int
    depth_largest: float
    depth_rms: float
    normal_largest: float
    normal_rms: float


@dataclass(frozen=True)
class CadAudit:
    """The audit of a run: figures by pair, and per logged contact what it is off.

    `depth_error` (m,) [m], positive where a contact is too deep, and `normal_error` (m,) [rad]; nan
    where the shell is no CAD surface, or where no place of the faces corresponds to the contact.
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

    def figures(self) -> dict[str, Any]:
        """Return the figures by pair, for summary.json."""
        return {
            pair.name: {
                "file": pair.file,
                "contacts": pair.contacts,
                "unmatched": pair.unmatched,
                "depth_error": {"largest": pair.depth_largest, "rms": pair.depth_rms},
                "normal_error": {"largest": pair.normal_largest, "rms": pair.normal_rms},
            }
            for pair in self.pairs
        }


def check_audit(built: Built) -> None:
    """Refuse an audit of a scenario without CAD surfaces, before it runs.

    Raises
    ------
    SphshellError
        No contact of the scenario is with a surface of a CAD file.
    MissingExtra
        The library that reads CAD files is not installed.
    """
    if not any(True for _ in _cad_pairs(built)):
        raise SphshellError(
            f"scenario '{built.name}' has no contact with a CAD surface: --audit-cad needs "
            f"a shell whose file is one of {', '.join(CAD_SUFFIXES)}"
        )
    require_kernel("--audit-cad")


def audit_cad(built: Built, result: Result) -> CadAudit:
    """Project every recorded contact with a CAD surface on the trimmed faces of its file.

    The same place of the surface is meant: the stationary point of the distance from the sphere's
    centre that is next to the contact, on a face inside its trimming, on an edge or a vertex.

    Raises what `check_audit` does.
    """
    check_audit(built)
    log = result.contacts
    depth_error, normal_error = (np.full(len(log.depth), np.nan) for _ in range(2))
    pairs: list[PairAudit] = []
    loaded: dict[str, tuple[TrimmedFaces, float]] = {}
    for index, section in _cad_pairs(built):
        if section.name not in loaded:
            loaded[section.name] = _faces_of(section, built.path)
        own = np.flatnonzero(log.pair == index)
        errors = _audit_pair(built, result, index, own, *loaded[section.name])
        depth_error[own], normal_error[own] = errors.T
        known = errors[np.isfinite(errors[:, 0])]
        pairs.append(
            PairAudit(
                built.scene.pairs[index].name,
                str(section.file),
                len(own),
                len(own) - len(known),
                *_largest_and_rms(known[:, 0]),
                *_largest_and_rms(known[:, 1]),
            )
        )
    return CadAudit(tuple(pairs), depth_error, normal_error)


def _cad_pairs(built: Built) -> Iterator[tuple[int, ShellSection]]:
    """Walk the pairs whose shell is of a CAD file."""
    sections = {section.name: section for section in built.scenario.shell}
    for index, pair in enumerate(built.scene.pairs):
        if pair.shell is None or pair.shell.name not in sections:
            continue
        section = sections[pair.shell.name]
        if section.file is not None and Path(section.file).suffix.lower() in CAD_SUFFIXES:
            yield index, section


def _faces_of(section: ShellSection, path: Path) -> tuple[TrimmedFaces, float]:
    """Return the exact faces of a shell, and metres per unit of their coordinates."""
    from sphshell_pin.shell.cad.surface import load_cad
    from sphshell_pin.shell.cad.trimmed import TrimmedFaces

    options = CadOptions(section.chord_error, section.bodies, section.faces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnitWarning)  # told when the shell was made
        cad = load_cad(path.parent / str(section.file), section.unit, options)
    scale = section.scale if isinstance(section.scale, int | float) else 1.0
    return TrimmedFaces(cad), cad.model.metres * scale * section.magnify


def _audit_pair(
    built: Built,
    result: Result,
    index: int,
    own: npt.NDArray[Any],
    faces: TrimmedFaces,
    unit: float,
) -> Array:
    """Return what depth [m] and normal [rad] of the logged contacts `own` are off (k, 2)."""
    pair, log = built.scene.pairs[index], result.contacts
    assert pair.sphere is not None  # pairs of shells have one
    model, data = built.scene.model, built.scene.model.createData()
    errors = np.full((len(own), 2), np.nan)
    shown = -1
    for place, i in enumerate(own.tolist()):
        if log.row[i] != shown:
            shown = int(log.row[i])
            pin.forwardKinematics(model, data, np.asarray(result.q[shown], dtype=float))
            shell = data.oMi[pair.joint_j] * pair.shell_placement
        normal = shell.rotation.T @ log.normal_world[i]
        point = shell.actInv(log.point_world[i])
        center = point + (pair.sphere.radius - log.depth[i]) * normal
        foot = faces.foot(center / unit, point / unit)
        if foot is None:
            continue
        way = center - unit * foot.point
        exact = way if foot.normal is None else foot.normal
        length = float(np.linalg.norm(exact))
        if length == 0.0:
            continue
        # On the side of the surface on which the contact is.
        exact = exact * np.sign(exact @ normal) / length
        errors[place, 0] = log.depth[i] - (pair.sphere.radius - float(way @ exact))
        errors[place, 1] = np.arctan2(np.linalg.norm(np.cross(exact, normal)), exact @ normal)
    return errors


def _largest_and_rms(values: Array) -> tuple[float, float]:
    if not len(values):
        return 0.0, 0.0
    return float(np.abs(values).max()), float(np.sqrt(np.mean(values**2)))
