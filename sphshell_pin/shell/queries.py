"""Queries of a shell: contacts with spheres, and closest points."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sphshell_pin.base import checks
from sphshell_pin.base.arrays import Array, Ints
from sphshell_pin.base.summary import Summarized
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell.base import ShellBase
from sphshell_pin.shell.contact_set import ContactSet, Method
from sphshell_pin.shell.options import thread_count


@dataclass(frozen=True, repr=False)
class ClosestPoints(Summarized):
    """Where the surface is nearest to each of n points, in the shell's frame.

    Attributes
    ----------
    points : (n, 3) on the surface [m]
    normals : (n, 3) unit, toward the point, or with flat elements that of the element, or the mean
        one of the edge or vertex; on the outer side by the winding
    distances : (n,) [m], negative behind the surface
    elements : (n,) row of shell.elements
    """

    points: Array
    normals: Array
    distances: Array
    elements: Ints

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.distances)


_FLOAT64 = np.dtype(np.float64)


def _is_sphere(center: npt.ArrayLike, radius: float) -> bool:
    """Whether both are sound as they are, which is found faster than what is wrong with them."""
    return (
        type(center) is np.ndarray
        and center.dtype is _FLOAT64
        and center.shape == (3,)
        and isinstance(radius, float)
        and 0.0 < radius < math.inf
        and center.dot(center) < math.inf  # not of nan
    )


class Queries(ShellBase):
    """The contact and closest-point queries of a shell."""

    def contacts(
        self, center: npt.ArrayLike, radius: float, method: str = "smooth", gradient: bool = False
    ) -> ContactSet:
        """Find every place where a sphere touches, deepest first.

        Parameters
        ----------
        center : (3,) of the sphere, in the shell's frame [m]
        radius : of the sphere [m]
        method : "smooth" (elements curved to meet the vertex normals; a connected piece of surface
            inside the sphere counts once), "facets" (each true feature of the polyhedron once) or
            "elements" (every touched element by itself, as ADAMS's SPHSHL3 has it: counts shared
            edges twice)
        gradient : also find how the normals turn as the sphere moves, for
            `ContactSet.force_gradient`; not with "elements"

        Raises
        ------
        InvalidParameter, NameNotFound
            If center or radius is out of range, or the method unknown.
        """
        number = Method.from_name(method)
        if not _is_sphere(center, radius):
            center = checks.check_vector("center", center, 3, " [m]")
            radius = checks.check_positive("radius", radius, "m")
        gradient = checks.check_flag("gradient", gradient)
        if gradient and number is Method.ELEMENTS:
            raise InvalidParameter("gradient", gradient, "is not known with method 'elements'")
        core = self.core_for(method)
        shown, terms = core.contacts(center, radius, number, gradient)  # type: ignore[arg-type]
        return ContactSet.from_rows(shown, terms, gradient, self.element_patch)

    def contacts_batch(
        self,
        centers: npt.ArrayLike,
        radii: npt.ArrayLike | float,
        method: str = "smooth",
        threads: int | None = None,
    ) -> tuple[Array, Ints]:
        """Find the contacts of many spheres at once.

        Parameters
        ----------
        centers : (n, 3) in the shell's frame [m]
        radii : (n,) or one number [m]
        method : as of `contacts`
        threads : how many to use; all processors unless given. The results do not depend on it

        Returns
        -------
        depth (n,) : the largest of each sphere [m], 0 if it does not touch
        count (n,) : how many contacts it has

        Raises
        ------
        InvalidParameter, NameNotFound
            If centers or radii are out of range, or the method unknown.
        """
        places = checks.check_points("centers", centers)
        sizes = checks.check_each_positive("radii", radii, len(places), "m")
        workers, number = thread_count(threads), Method.from_name(method)
        depth, count = self.core_for(method).contacts_batch(places, sizes, int(number), workers)
        return depth, count

    def closest_points(
        self, points: npt.ArrayLike, threads: int | None = 1, method: str = "smooth"
    ) -> ClosestPoints:
        """Project points (n, 3) [m] of the shell's frame on the surface.

        On that of the method "smooth", or else on the flat elements. Raises InvalidParameter if
        the points are out of range, NameNotFound if the method is unknown.
        """
        smooth = Method.from_name(method) is Method.SMOOTH
        places = checks.check_points("points", points)
        core = self.core_for(method)
        found = core.closest_points(places, smooth, thread_count(threads))
        for column in found:
            checks.read_only(column)
        return ClosestPoints(*found)
