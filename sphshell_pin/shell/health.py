"""What was found in a surface, what was repaired, and what is left to look at."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sphshell_pin.shell.raw import Floats

if TYPE_CHECKING:
    from sphshell_pin.shell.curvature import CurvatureReport

Place = tuple[float, float, float]


@dataclass(frozen=True)
class ShellHealth:
    """Findings about a surface: counts, worst values, and sentences about both.

    Nothing is repaired in silence: whatever the cleaning changed is counted here. `str()` gives a
    table; `repairs` and `problems` give sentences; `ok` is True if no problem is left. Lengths are
    in [m].

    Attributes
    ----------
    name, source, unit, scale : of the surface; the file it came from, the unit its numbers were
        taken in, the factor from the numbers of the file to metres
    cleaned : False if the surface was taken as it came (`clean=False`)
    input_vertices, input_elements : as given
    vertices, elements, triangles, quads : what is left; a planar quad is one element
    size, area, volume : box diagonal; surface [m^2]; enclosed by the closed components [m^3]
    weld_tolerance, welded_vertices, weld_distance : merged within; how many; the farthest
    unused_vertices : used by no element (after the cleaning)
    degenerate_elements : dropped, as they had no area
    duplicate_elements, opposite_duplicates : dropped; how many of them were wound the other way
    t_junctions : vertices put into the open edges they lie on
    warped_quads, concave_quads, largest_warp : quads split into triangles; the farthest distance of
        a corner of a split quad or polygon from its mean plane
    polygons, largest_polygon, tangled_polygons : elements of more than four corners, all
        triangulated; the most corners; outlines that cross themselves
    flipped_elements, reversed_components : winding turned
    components, closed_components, cavities : connected across edges of two elements
    one_sided_components : without a consistent winding (a Moebius strip)
    edges, boundary_edges, boundary_loops, non_manifold_edges : edges of any, of one, of three and
        more elements
    holes, largest_hole_area, hole_at, hole_edges : boundary loops so small that an element may be
        missing; the largest [m^2], its middle, its edges
    non_manifold_at : middle of one non-manifold edge
    euler_number : vertices - edges + elements
    worst_shape : smallest 2 area / longest edge^2 of a triangle
    has_normals : normals were given
    missing_normals, rescaled_normals, turned_normals : zero or not finite, replaced by the
        element's; not of unit length, made so; turned with their element
    opposing_normals, largest_normal_angle : more than 90 degrees off their element; the worst [rad]
    notes : what the reader of the file has to say
    curvature : of the curved elements, once `Shell.curvature_report` has measured them
    """

    name: str = "shell"
    source: str | None = None
    unit: str | None = None
    scale: float = 1.0
    cleaned: bool = True
    input_vertices: int = 0
    input_elements: int = 0
    vertices: int = 0
    elements: int = 0
    triangles: int = 0
    quads: int = 0
    size: float = 0.0
    area: float = 0.0
    volume: float = 0.0
    weld_tolerance: float = 0.0
    welded_vertices: int = 0
    weld_distance: float = 0.0
    unused_vertices: int = 0
    degenerate_elements: int = 0
    duplicate_elements: int = 0
    opposite_duplicates: int = 0
    t_junctions: int = 0
    warped_quads: int = 0
    concave_quads: int = 0
    largest_warp: float = 0.0
    polygons: int = 0
    largest_polygon: int = 0
    tangled_polygons: int = 0
    flipped_elements: int = 0
    reversed_components: int = 0
    components: int = 0
    closed_components: int = 0
    cavities: int = 0
    one_sided_components: int = 0
    edges: int = 0
    boundary_edges: int = 0
    boundary_loops: int = 0
    non_manifold_edges: int = 0
    holes: int = 0
    hole_edges: int = 0
    largest_hole_area: float = 0.0
    hole_at: Place | None = None
    non_manifold_at: Place | None = None
    euler_number: int = 0
    worst_shape: float = 0.0
    has_normals: bool = False
    missing_normals: int = 0
    rescaled_normals: int = 0
    turned_normals: int = 0
    opposing_normals: int = 0
    largest_normal_angle: float = 0.0
    notes: tuple[str, ...] = ()
    curvature: CurvatureReport | None = None

    @property
    def is_closed(self) -> bool:
        """True if every component is closed."""
        return self.components > 0 and self.closed_components == self.components

    @property
    def ok(self) -> bool:
        """True if nothing is left to look at; an open sheet is no problem in itself."""
        return not self.problems

    @property
    def repairs(self) -> tuple[str, ...]:
        """One sentence for each kind of repair."""
        unused = _are(self.unused_vertices, "vertex", "vertices")
        said = [
            (
                self.welded_vertices,
                f"{_many(self.welded_vertices, 'vertex', 'vertices')} merged with another within "
                f"{self.weld_tolerance:.3g} m (farthest {self.weld_distance:.3g} m)",
            ),
            (self.unused_vertices, f"{unused} used by no element and dropped"),
            (
                self.degenerate_elements,
                f"{_many(self.degenerate_elements, 'element')} without area dropped",
            ),
            (
                self.duplicate_elements,
                f"{_many(self.duplicate_elements, 'duplicate element')} dropped "
                f"({self.opposite_duplicates} of opposite winding)",
            ),
            (
                self.t_junctions,
                f"{_many(self.t_junctions, 'vertex', 'vertices')} put into open edges on which "
                "they lie (T-junctions)",
            ),
            (
                self.warped_quads + self.concave_quads,
                f"{_many(self.warped_quads + self.concave_quads, 'quad')} split into triangles "
                f"({self.warped_quads} not planar, {self.concave_quads} not convex)",
            ),
            (
                self.polygons,
                f"{_many(self.polygons, 'polygon')} of up to {self.largest_polygon} corners "
                "triangulated",
            ),
            (
                self.largest_warp > 0.0,
                f"the largest warp of a split element is {self.largest_warp:.3g} m (its farthest "
                "corner from its mean plane)",
            ),
            (
                self.flipped_elements,
                f"{_many(self.flipped_elements, 'element')} turned over, among them "
                f"{_many(self.reversed_components, 'whole component')}",
            ),
            (
                self.cavities,
                f"{_many(self.cavities, 'closed component')} inside another taken as a cavity and "
                "wound towards its inside",
            ),
            (
                self.missing_normals,
                f"{_many(self.missing_normals, 'normal')} zero or not finite, replaced by the "
                "element's own",
            ),
            (
                self.rescaled_normals,
                f"{_many(self.rescaled_normals, 'normal')} not of unit length, made so",
            ),
            (
                self.turned_normals,
                f"{_many(self.turned_normals, 'normal')} turned to the side of their element",
            ),
        ]
        return tuple(sentence for count, sentence in said if count)

    @property
    def problems(self) -> tuple[str, ...]:
        """One sentence for each thing no repair can settle."""
        said = [
            (
                self.holes,
                f"{_many(self.holes, 'hole')} in the surface, the largest of {self.hole_edges} "
                f"open edges and {self.largest_hole_area:.3g} m^2 near {place_text(self.hole_at)}: "
                "unless it is meant, an element is missing or has a wrong number of corners",
            ),
            (
                self.non_manifold_edges,
                f"{_many(self.non_manifold_edges, 'edge')} of three or more elements "
                f"(non-manifold), one near {place_text(self.non_manifold_at)}: inside and outside "
                "are not defined there",
            ),
            (
                self.one_sided_components,
                f"{_many(self.one_sided_components, 'component')} one-sided (like a Moebius "
                'strip): only side="both" makes sense',
            ),
            (
                self.tangled_polygons,
                f"{_many(self.tangled_polygons, 'polygon')} whose outline crosses itself: "
                "triangulated as well as possible",
            ),
            (
                self.opposing_normals,
                f"{_many(self.opposing_normals, 'normal')} more than 90 degrees off the element "
                f"(the worst by {_degrees(self.largest_normal_angle):.3g} degrees)",
            ),
        ]
        found = tuple(sentence for count, sentence in said if count)
        return found if self.curvature is None else (*found, *self.curvature.problems)

    def summary(self) -> str:
        """One line: what the surface is."""
        state = "closed" if self.is_closed else "open"
        return (
            f"{self.name}: {self.elements} elements ({self._kinds()}), {self.vertices} vertices, "
            f"{state}, size {self.size:.4g} m"
        )

    @property
    def triangles_alone(self) -> int:
        """Elements with three corners."""
        return self.elements - self.quads

    def __str__(self) -> str:
        """Lay the findings out as a table."""
        rows = [
            ("surface", self.name),
            ("file", self.source or ""),
            ("unit", f"{self.unit}, {self.scale:.6g} m per file unit" if self.unit else ""),
            (
                "elements",
                f"{self.elements} ({self._kinds()}), given {self.input_elements}",
            ),
            ("vertices", f"{self.vertices}, given {self.input_vertices}"),
            ("size", f"{self.size:.6g} m (box diagonal)"),
            ("area", f"{self.area:.6g} m^2"),
            ("volume", f"{self.volume:.6g} m^3" if self.closed_components else ""),
            (
                "components",
                f"{self.components}, {self.closed_components} closed, Euler number "
                f"{self.euler_number}",
            ),
            (
                "edges",
                f"{self.edges}: {self.boundary_edges} open in "
                f"{_many(self.boundary_loops, 'loop')}, {self.non_manifold_edges} non-manifold",
            ),
            ("worst shape", f"{self.worst_shape:.3g} (2 area / longest edge^2)"),
            ("normals", self._normals()),
            *(() if self.curvature is None else self.curvature.rows()),
            *(("note", note) for note in self.notes),
            *(("repaired", sentence) for sentence in self.repairs),
            *(("look at", sentence) for sentence in self.problems),
            (
                "verdict",
                "ok" if self.ok else f"ok, with {_many(len(self.problems), 'thing')} to look at",
            ),
        ]
        shown = [(label, value) for label, value in rows if value]
        width = max(len(label) for label, _ in shown)
        return "\n".join(f"{label:<{width}}  {value}" for label, value in shown)

    def _kinds(self) -> str:
        return f"{_many(self.triangles_alone, 'triangle')}, {_many(self.quads, 'quad')}"

    def _normals(self) -> str:
        if not self.has_normals:
            return "none given" + ("" if self.cleaned else "; taken as it came, not cleaned")
        return f"given, up to {_degrees(self.largest_normal_angle):.3g} degrees off their element"

    def moved(self, scale: float, rotation: Floats, translation: Floats) -> ShellHealth:
        """Return the findings about the surface made `scale` times larger, turned and moved."""

        def place(at: Place | None) -> Place | None:
            if at is None:
                return None
            x, y, z = rotation @ (scale * np.array(at)) + translation
            return (float(x), float(y), float(z))

        return replace(
            self,
            curvature=None,
            scale=self.scale * scale,
            size=self.size * scale,
            area=self.area * scale**2,
            volume=self.volume * scale**3,
            weld_tolerance=self.weld_tolerance * scale,
            weld_distance=self.weld_distance * scale,
            largest_warp=self.largest_warp * scale,
            largest_hole_area=self.largest_hole_area * scale**2,
            hole_at=place(self.hole_at),
            non_manifold_at=place(self.non_manifold_at),
        )

    def to_dict(self) -> dict[str, Any]:
        """All fields by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def labelled(self, **changes: Any) -> ShellHealth:
        """Return the same findings under another name, source or unit."""
        return replace(self, **changes)


def _many(count: int, one: str, several: str | None = None) -> str:
    return f"{count} {one if count == 1 else several or one + 's'}"


def _are(count: int, one: str, several: str) -> str:
    return f"{_many(count, one, several)} {'is' if count == 1 else 'are'}"


def _degrees(angle: float) -> float:
    return angle * 57.29577951308232


def place_text(place: Place | None) -> str:
    """Return a place [m] as text."""
    return "an unknown place" if place is None else "({:.4g}, {:.4g}, {:.4g}) m".format(*place)
