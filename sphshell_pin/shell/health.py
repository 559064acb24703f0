"""What was found in a surface, what was repaired, and what is left to look at."""

from __future__ import annotations

import string
from dataclasses import dataclass, fields, replace

import numpy as np

from sphshell_pin.base.arrays import Array

Place = tuple[float, float, float]

LARGE_OF_TURNS = 8.0
"""A curved element farther off, over what the turns around it account for, is one to look at: on
round surfaces it is up to 3."""

LARGE_SHARE = 0.5
"""Share of the given normals: if more than that are not used, they are not those of the surface."""

_WRONG_NORMALS = (
    "the normals are wrong (noisy, averaged over sharp edges, or of another surface): correct them "
    "or leave them out"
)

_REPAIRS = (
    "{welded_vertices:vertex} merged with another within {weld_tolerance:.3g} m (farthest "
    "{weld_distance:.3g} m)",
    "{unused_vertices:vertex is} used by no element and dropped",
    "{degenerate_elements:element} without area dropped",
    "{duplicate_elements:duplicate element} dropped ({opposite_duplicates} of opposite winding)",
    "{t_junctions:vertex} put into open edges on which they lie (T-junctions)",
    "{split_quads:quad} split into triangles ({warped_quads} not planar, {concave_quads} not "
    "convex)",
    "{polygons:polygon} of up to {largest_polygon} corners triangulated",
    "the largest warp of a split element is {largest_warp:.3g} m (its farthest corner from its "
    "mean plane)",
    "{flipped_elements:element} turned over, among them {reversed_components:whole component}",
    "{cavities:closed component} inside another taken as a cavity and wound toward its inside",
    "{missing_normals:normal} zero or not finite, replaced by the element's own",
    "{rescaled_normals:normal} not of unit length, made so",
    "{turned_normals:normal} turned to the side of their element",
)
"""Sentences, each for a surface whose field that it names first is not zero."""

_PROBLEMS = (
    "{missing_faces:face} of the file missing, which could not be read or be given triangles: "
    "export the part again, or mend the face in the CAD system",
    "{holes:hole} in the surface, the largest of {hole_edges} open edges and "
    "{largest_hole_area:.3g} m^2 near {hole_at:place}: unless it is meant, an element is "
    "missing or has a wrong number of corners",
    "{non_manifold_edges:edge} of three or more elements (non-manifold), one near "
    "{non_manifold_at:place}: inside and outside are not defined there",
    "{pinched_vertices:vertex} at which elements meet that share no edge there (pinched), one "
    "at {pinched_at:place}: unless it is meant, an element is missing beside it",
    "{overlapping_components:closed component} partly inside another, or equal to it: taken as "
    "a solid, not as a cavity",
    "{one_sided_components:component} one-sided (like a Moebius strip): only "
    'side="both" makes sense',
    "{tangled_polygons:polygon} whose outline crosses itself: triangulated as well as possible",
    "{opposing_normals:normal} more than 90 degrees off the element (the worst by "
    "{largest_normal_angle:degrees} degrees)",
)


_POWERS = {
    **dict.fromkeys(("scale", "size", "weld_tolerance", "weld_distance", "largest_warp"), 1),
    **dict.fromkeys(("area", "largest_hole_area"), 2),
    "volume": 3,
}
"""Powers of the length in fields that grow with the surface."""


class _Sentences(string.Formatter):
    """Fills in sentences: `{count:noun}` counts, `{at:place}` and `{angle:degrees}` convert."""

    def format_field(self, value: object, spec: str) -> str:
        if spec == "degrees" and isinstance(value, float):
            return f"{np.degrees(value):.3g}"
        if spec == "place":
            if not isinstance(value, tuple):
                return "an unknown place"
            return "({:.4g}, {:.4g}, {:.4g}) m".format(*value)
        if isinstance(value, int) and spec:
            plural = {"vertex": "vertices", "vertex is": "vertices are"}.get(spec, spec + "s")
            return f"{value} {spec if value == 1 else plural}"
        return format(value, spec)


_fill, _PARSE = _Sentences().format, string.Formatter().parse


@dataclass(frozen=True)
class CurvatureReport:
    """How the curved elements of the method "smooth" differ from the flat ones.

    Attributes
    ----------
    elements, curved : how many there are; how many bend
    flat_because : how many stayed flat for each reason
    largest : largest distance between a point of a curved element and its flat one [m]
    at : that point [m]; None if all elements are flat
    of_size, of_height : the same as a share of the box diagonal, and of the smallest height of the
        triangle it is in
    large : elements whose distance is large for the turns around them, which say how far the flat
        elements are from the surface: their normals are doubtful
    large_distance, large_at : the largest distance of these [m], and where [m]
    normals_set_aside : corners whose given normal was not used, as the elements contradict it
    set_aside_at : one of them [m], or None; share_set_aside : how many of all given ones
    faces : the faces recognized in a mesh, in words
    not_exact : by reason, those that do not give closest points, with their share of the area and
        how far elements are off them [m]
    """

    elements: int
    curved: int
    flat_because: tuple[tuple[str, int], ...]
    largest: float
    at: Place | None
    of_size: float
    of_height: float
    large: int
    normals_set_aside: int
    set_aside_at: Place | None
    large_distance: float = 0.0
    large_at: Place | None = None
    share_set_aside: float = 0.0
    faces: str = ""
    not_exact: tuple[str, ...] = ()

    @property
    def flat(self) -> int:
        """Elements that are flat."""
        return self.elements - self.curved

    @property
    def problems(self) -> tuple[str, ...]:
        """A sentence about elements that bend too much, and one about normals not used."""
        found = []
        if self.large:
            are = "element bends" if self.large == 1 else "elements bend"
            found.append(
                f"{self.large} curved {are} by more than {LARGE_OF_TURNS:g} times what the turns "
                f"around account for, the worst by {self.large_distance:.3g} m at "
                f"{_fill('{:place}', self.large_at)}: {_WRONG_NORMALS}; crease_angle=0 or method "
                '"facets" keep the elements flat'
            )
        if self.share_set_aside > LARGE_SHARE:
            found.append(
                f"{self.share_set_aside:.0%} of the given normals are not used, as the elements "
                f"contradict them: {_WRONG_NORMALS}"
            )
        return tuple(found)

    def rows(self) -> tuple[tuple[str, str], ...]:
        """Labels and texts for a table."""
        text = f"{self.curved} of {self.elements} elements"
        if self.curved:
            text += f", off the flat ones by up to {self._distance()}"
        rows = [("curved", text)]
        rows += [("flat", _fill("{:element}: {}", count, why)) for why, count in self.flat_because]
        if self.faces:
            rows.append(("faces", self.faces))
        rows += [("not exact", text) for text in self.not_exact]
        if self.normals_set_aside:
            rows.append(
                (
                    "set aside",
                    f"{self.normals_set_aside} given normals that the elements contradict, one at "
                    f"{_fill('{:place}', self.set_aside_at)}",
                )
            )
        return tuple(rows)

    def _distance(self) -> str:
        return (
            f"{self.largest:.3g} m ({self.of_size:.2g} of the size, {self.of_height:.2g} of the "
            f"element's height) at {_fill('{:place}', self.at)}"
        )


@dataclass(frozen=True, repr=False)
class ShellHealth:
    """Findings about a surface: counts, worst values, and sentences about both.

    Nothing is repaired in silence: whatever the cleaning changed is counted here. `str()` gives a
    table; `repairs` and `problems` give sentences; `ok` is True if no problem is left. Lengths are
    in [m].

    Attributes
    ----------
    name, source, unit, scale : of the surface; the file it came from, the unit its numbers were
        taken in, the factor from the numbers of the file to meters
    cleaned : False if the surface was taken as it came (`clean=False`)
    input_vertices, input_elements : as given
    missing_faces : of the CAD file, which could not be read or be given triangles
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
    overlapping_components : closed, partly inside another one or in its place
    one_sided_components : without a consistent winding (a Moebius strip)
    edges, boundary_edges, boundary_loops, non_manifold_edges : edges of any, of one, of three and
        more elements
    holes, largest_hole_area, hole_at, hole_edges : boundary loops so small that an element may be
        missing; the largest [m^2], its middle, its edges
    non_manifold_at : middle of one non-manifold edge
    pinched_vertices, pinched_at : vertices whose elements are not all connected across the edges
        that meet there, counted by `Shell`; one of them
    euler_number : vertices - edges + elements, those that solids share once for each
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
    missing_faces: int = 0
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
    overlapping_components: int = 0
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
    pinched_vertices: int = 0
    pinched_at: Place | None = None
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
        return self._said(_REPAIRS)

    @property
    def problems(self) -> tuple[str, ...]:
        """One sentence for each thing no repair can settle."""
        curved = () if self.curvature is None else self.curvature.problems
        return (*self._said(_PROBLEMS), *curved)

    def _said(self, sentences: tuple[str, ...]) -> tuple[str, ...]:
        found = {**vars(self), "split_quads": self.warped_quads + self.concave_quads}
        firsts = (next(filter(None, (one[1] for one in _PARSE(text)))) for text in sentences)
        said = zip(sentences, firsts, strict=True)
        return tuple(_fill(text, **found) for text, name in said if found[name])

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

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        """Lay the findings out as a table."""
        rows = [
            ("surface", self.name),
            ("file", self.source or ""),
            ("unit", f"{self.unit}, {self.scale:.6g} m per file unit" if self.unit else ""),
            ("elements", f"{self.elements} ({self._kinds()}), given {self.input_elements}"),
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
                f"{_fill('{:loop}', self.boundary_loops)}, {self.non_manifold_edges} non-manifold",
            ),
            ("worst shape", f"{self.worst_shape:.3g} (2 area / longest edge^2)"),
            ("normals", self._normals()),
            *(() if self.curvature is None else self.curvature.rows()),
            *(("note", note) for note in self.notes),
            *(("repaired", sentence) for sentence in self.repairs),
            *(("look at", sentence) for sentence in self.problems),
            (
                "verdict",
                "ok" if self.ok else _fill("ok, with {:thing} to look at", len(self.problems)),
            ),
        ]
        shown = [(label, value) for label, value in rows if value]
        width = max(len(label) for label, _ in shown)
        return "\n".join(f"{label:<{width}}  {value}" for label, value in shown)

    def _kinds(self) -> str:
        return _fill("{:triangle}, {:quad}", self.triangles_alone, self.quads)

    def _normals(self) -> str:
        if not self.has_normals:
            return "none given" + ("" if self.cleaned else "; taken as it came, not cleaned")
        return _fill("given, up to {:degrees} degrees off their element", self.largest_normal_angle)

    def moved(self, scale: float, rotation: Array, translation: Array) -> ShellHealth:
        """Return the findings about the surface made `scale` times larger, turned and moved."""
        changes: dict[str, object] = {"curvature": None}
        for name, power in _POWERS.items():
            changes[name] = getattr(self, name) * scale**power
        for name in ("hole_at", "non_manifold_at", "pinched_at"):
            if (at := getattr(self, name)) is not None:
                place = rotation @ (scale * np.array(at)) + translation
                changes[name] = tuple(place.tolist())
        return self.labelled(**changes)

    def to_dict(self) -> dict[str, object]:
        """All fields by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def labelled(self, **changes: object) -> ShellHealth:
        """Return the same findings under another name, source or unit."""
        return replace(self, **changes)  # type: ignore[arg-type]
