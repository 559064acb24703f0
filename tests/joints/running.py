"""Walks over one part: as a file, and back."""

from pathlib import Path

import sphshell_pin as sp
from tests.joints.boxes import BOXES
from tests.joints.solid_walk import judge_solid, read_step, spheres_of
from tests.joints.solids import FAMILIES, write_step, write_stl
from tests.joints.trimmed import TrimmedSolid
from tests.joints.verdict import Verdict, exact_share
from tests.parts.occ import Rng, checked

PER_PART = 4000

CHORD = 3e-4
"""Deflection of STL files over the size."""

STEP_CHORD = 1e-3
"""That of STEP files, unless asked for another."""

DIGITS = {False: 2e-12, True: 2e-7}
"""What the digits of STEP files leave open, and the single precision of STL, over the size."""


def walk_part(family, folder, rng, stl=False, most=PER_PART):
    """Walk over a random part of a family."""
    solid = checked(BOXES[family](rng)) if family in BOXES else FAMILIES[family](rng).solid()
    path = write_step(solid, folder / "part.step")
    return walk_file(path, family, min(PER_PART, most), rng, stl)


def walk_file(path: Path, name: str, count: int, rng: Rng, stl: bool = False) -> Verdict:
    """Walk over a STEP file, or the STL file of its solid; judged by its trimmed faces."""
    solid = read_step(path)
    trimmed = TrimmedSolid(solid)
    centers, radii = spheres_of(trimmed, count, rng)
    chord = (CHORD if stl else STEP_CHORD) * trimmed.size
    if stl:
        mesh = write_stl(solid, path.with_suffix(".stl"), chord)
        shell = sp.Shell.from_file(mesh, unit="mm")
    else:
        shell = sp.Shell.from_file(path)
    rough = 2 * chord  # OpenCASCADE's deflection is no guarantee
    verdict = judge_solid(shell, trimmed, name, centers, radii, DIGITS[stl] * trimmed.size, rough)
    exact = sum(face.exact for face in shell.faces)
    verdict.part += f" (exact {exact} of {len(shell.faces)}, {100 * exact_share(shell):.1f} %)"
    return verdict
