"""Shells as arrays, to be kept in a file, and shells of such arrays, which may be anybody's."""

from dataclasses import replace

import numpy as np

from sphshell_pin.errors import InvalidShell
from sphshell_pin.shell.cleaned import ARRAYS, AnyArray, Arrays, Known, check_arrays
from sphshell_pin.shell.raw import KINDS
from sphshell_pin.shell.shell import Shell

# A shell of these finds the other two again.
_ARRAYS: Known = {
    name: one for name, one in ARRAYS.items() if name not in ("triangle_element", "source_element")
}
_ALWAYS = ("vertices", "elements", "triangles")


def arrays_of(shell: Shell) -> dict[str, AnyArray]:
    """Return the arrays that a shell is made of, which `shell_of` takes."""
    found = {name: getattr(shell, name) for name in _ARRAYS}
    return {name: array for name, array in found.items() if array is not None}


def shell_of(
    arrays: Arrays,
    *,
    name: str,
    side: str,
    crease_angle: float,
    rounding: float,
    finds_faces: bool,
    face_names: tuple[str, ...],
) -> Shell:
    """Return the shell that `arrays_of` took apart: the same bits, with all queries.

    Raises
    ------
    InvalidShell
        The arrays are of no shell: the compiled surface relies on their indices.
    InvalidParameter
        An option is out of range.
    """
    given = {key: arrays[key] for key in _ARRAYS if key in arrays}
    check_arrays(given, _ARRAYS, _ALWAYS)
    # It checks indices, areas and the options.
    base = Shell(given["vertices"], given["elements"], None, crease_angle, side, clean=False)
    surface = base.surface()
    owners = surface.elements[surface.triangle_element]
    triangles = given["triangles"]
    faces = len(given["face_shapes"]) if "face_shapes" in given else len(face_names)
    kinds, of_face = given.get("face_shapes"), given.get("element_face")
    for fits, what in (
        (np.array_equal(surface.elements, given["elements"]), "elements"),
        (triangles.shape == surface.triangles.shape, "triangles"),
        (_are_corners(triangles, owners), "triangles"),
        ("normals" not in given or _are_units(given["normals"]), "normals"),
        (of_face is None or bool(((of_face >= -1) & (of_face < faces)).all()), "element_face"),
        (of_face is not None or kinds is None, "element_face"),
        (len(face_names) in (0, faces), "face_names"),
        (kinds is None or _are_faces(kinds), "face_shapes"),
        (0.0 <= rounding < np.inf, "rounding"),
    ):
        if not fits:
            raise InvalidShell(f"the shell '{name}' cannot be made again: its {what} do not fit")
    surface = replace(
        surface,
        **{key: array for key, array in given.items() if key not in ("vertices", "elements")},
        # Names count the rows of face_shapes, which count only with normals.
        face_names=face_names if kinds is not None and "normals" in given else (),
        rounding=rounding,
        health=surface.health.labelled(cleaned=True),
    )
    return Shell.from_surface(surface, crease_angle, side, name, finds_faces=finds_faces)


def _are_corners(triangles: AnyArray, owners: AnyArray) -> bool:
    """Whether each triangle has three different corners of its element."""
    if len(triangles) != len(owners):
        return False
    of_element = (triangles[:, :, None] == owners[:, None, :]).any(axis=2).all()
    a, b, c = triangles.T
    return bool(of_element and ((a != b) & (b != c) & (c != a) & (triangles >= 0).all(1)).all())


def _are_units(normals: AnyArray) -> bool:
    return bool((np.abs(np.linalg.norm(normals.astype(float), axis=2) - 1.0) < 1e-6).all())


def _are_faces(shapes: AnyArray) -> bool:
    numbers = shapes.astype(float)
    return bool(np.isfinite(numbers).all() and np.isin(numbers[:, 0], range(-1, len(KINDS))).all())
