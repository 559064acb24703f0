"""Real CAD files, and surfaces whose contact forces are known."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from tests.shell import cad_shapes as shapes

REAL_FILES = {
    "gmsh_mesh_T106_V3.step": None,
    "gmsh_capot.brep": "mm",
    "gmsh_sphere_Rhino3D_default.igs": None,
    "dealii_DTMB-5415_bulbous_bow.iges": None,
    "bladex_upper.iges": None,
    "occt_hammer.iges": None,
    "occt_screw.step": None,
    "trimesh_featuretype.STEP": None,
}
"""Unit to state of each, None where the header has one."""


@dataclass(frozen=True)
class Known:
    """A surface of which `normals(rng, n)` gives n points [m] and outer unit normals.

    A ball of `radius` [m] on its outer side touches it at one place alone; `make` gives its shape,
    `chord` is a chord error [m] from which on triangles shrink in all directions alike, with every
    `step` by which it is divided.
    """

    make: Callable[[], Any]
    radius: float
    normals: Callable[[np.random.Generator, int], tuple[Array, Array]]
    chord: float = 1e-4
    step: float = 4.0


def _on_ball(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return shapes.BALL * 1e-3 * normal, normal


def _on_ring(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    # The outer half: inside, a ball would touch twice.
    along, round_ = rng.uniform(0, 2 * np.pi, count), rng.uniform(-1.2, 1.2, count)
    out = np.stack([np.cos(along), np.sin(along), np.zeros(count)], axis=1)
    normal = np.cos(round_)[:, None] * out
    normal[:, 2] = np.sin(round_)
    return 1e-3 * (shapes.RING * out + shapes.TUBE * normal), normal


def _on_cylinder(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    angle = rng.uniform(0, 2 * np.pi, count)
    normal = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    point = 5e-3 * normal
    point[:, 2] = rng.uniform(5e-3, 15e-3, count)
    return point, normal


KNOWN = {
    "ball": Known(shapes.ball, 4e-3, _on_ball),
    "ball as splines": Known(lambda: shapes.nurbs(shapes.ball()), 4e-3, _on_ball, 2e-4),
    "ring": Known(shapes.ring, 1e-3, _on_ring, 4e-5, 3.0),
    "cylinder": Known(shapes.cylinder, 2e-3, _on_cylinder, 1e-4, 8.0),
}


def force_errors(shell: Shell, known: Known, count: int = 200) -> Array:
    """Relative errors (n,) of the force k depth^1.5 on n balls.

    They stand so deep in the exact surface that the depth is a tenth of their radius.
    """
    point, normal = known.normals(np.random.default_rng(7), count)
    depth = 0.1 * known.radius
    errors = []
    for center, way in zip(point + (known.radius - depth) * normal, normal, strict=True):
        contacts = shell.contacts(center, known.radius)
        force = (contacts.depth[:, None] ** 1.5 * contacts.normal).sum(axis=0)
        errors.append(np.linalg.norm(force - depth**1.5 * way) / depth**1.5)
    return np.array(errors)


def stated_and_measured(shell: Shell) -> tuple[float, float, bool]:
    """Chord errors [m] that the reader says were asked for and found, and whether it held."""
    (note,) = [note for note in shell.health.notes if note.startswith("chord error")]
    stated, measured = re.findall(r"([\d.e+-]+) m (?:stated|measured)", note)
    return float(stated), float(measured), note.endswith("held")
