"""Where a part stands before the tip: as on a table, one side of it towards the tip."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.scenario.drafting.clearance import Links
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.poses import Limb, Stance, stances
from sphshell_pin.scenario.drafting.touch_points import TouchPoint, touches_once
from sphshell_pin.scenario.drafting.vectors import turned_to
from sphshell_pin.scenario.drafting.wording import axis_name, mm, rounded

# Turns of the part about the approach, tried in this order [rad].
_YAWS = tuple(np.deg2rad((0, 180, 90, -90, 45, -45, 135, -135)))
# Cosine between the normal that is touched and the side of the part, which is turned to the tip:
# below it the part is turned to the normal itself, or another place is looked for.
STEEP = 0.8
# Places and turns at which links are held against the part: of one side and height, of these once
# so many were tried in all, and places of one posture that are offered.
_MOST_TRIED, _FEWER, _MANY, _MOST_OF_STANCE = 160, 16, 1000, 2
# Lengths of stubs that carry a ball out of its limb, in radii, which one may have that is longer
# than the limb, and at how many of the places that were tried they are looked for.
_STUBS, _LONG, _LOOKED = 1.5 ** np.arange(1.0, 13.0), 20.0, 200
# How far joints may be under the floor [m]: not at all, but for rounding.
_AT_FLOOR = 1e-6


@dataclass(frozen=True)
class Place:
    """A posture of the robot and a part before its tip.

    The part is at `placement` in the world, its `side` (3,) turned to the tip and its underside
    `raised` [m] above the floor. `on_face` says whether the sphere touches one face there, once.
    """

    stance: Stance
    touch: TouchPoint
    placement: pin.SE3
    on_face: bool
    raised: float
    side: Array

    def with_gap(self, gap: float) -> Place:
        """Return the place with the sphere at the `gap` [m] to the part, which stays if it can."""
        touch, stance = self.touch, self.stance
        center = touch.point + (stance.tip.radius + gap) * touch.normal
        moved, touched = stance.at(self.placement.act(center)), replace(touch, center=center)
        if moved is None:  # its joints do not move the tip that way
            way = self.placement.rotation @ (center - touch.center)
            part, raised = nearer(self.placement, way), self.raised - float(way[2])
            return replace(self, touch=touched, placement=part, raised=raised)
        return replace(self, stance=moved, touch=touched)

    @property
    def told(self) -> str:
        """A sentence that says how the part stands."""
        side = f"{axis_name(self.side)} side" if axis_name(self.side) else "touched place"
        upright = self.placement.rotation[2, 2] > 0.999
        stands = "upright, as in its file" if upright else f"with its {side} towards the tip"
        if abs(self.raised) < 1e-4:
            return f"the surface stands {stands}, on the floor of the robot's base"
        high = f"{mm(abs(self.raised))} {'above' if self.raised > 0 else 'below'} the floor of the"
        return (
            f"the surface stands {stands}, {high} robot's base: there the tip would not come to it"
        )


class Bench:
    """A robot and a part that is put before the tip of a `limb`, on the floor of the robot's base.

    `links` are held against the part; q (nq,) is the posture to start from; the sphere may come
    into the part by `depth` [m].
    """

    def __init__(self, links: Links, limb: Limb, q: Array, depth: float) -> None:
        self.q, self._limb, self._links, self._depth = q, limb, links, depth
        self._found: dict[tuple[float | None, ...], list[Stance]] = {}
        # What was come across: postures, places that were tried, and links that were in the part.
        self.postures, self.tried, self.blocked = 0, 0, Counter[str]()
        self._covered: list[tuple[Stance, pin.SE3, bool]] = []

    def places(
        self, side: Array, spots: Sequence[TouchPoint], approach: Array, on_floor: bool, room: float
    ) -> Iterator[Place]:
        """Yield places where the part has `side` (3,) to a tip that presses along `approach` (3,).

        It stands on the floor, or wherever the posture has the tip, `room` [m] before the links.
        First those of each posture where the sphere touches one face.
        """
        links, shell, facing = self._links, self._links.shell, turned_to(side, -approach)
        above = links.floor - float((shell.vertices @ facing[2]).min())
        heights = [above + float(facing[2] @ spot.center) if on_floor else None for spot in spots]
        uneven: list[Place] = []
        most = self.tried + (_FEWER if self.tried > _MANY else _MOST_TRIED)
        for posture in self._stances(approach, heights[0]):
            self.postures += 1
            offered = 0
            for spot, z in zip(spots, heights, strict=True):
                faces, tip = spot.normal @ side > STEEP, self._limb.tip
                on_face = faces and touches_once(
                    shell, spot, spot.point[None], tip.radius, self._depth
                )
                # What moves along one line alone presses along the normal there.
                line = posture.slide is None
                at = posture.center if line or z is None else np.array([*posture.center[:2], z])
                stance = posture.at(at)
                if stance is None or (not on_face and uneven):
                    continue
                front = spot.normal if line else side
                turn = turned_to(front, -stance.approach) if line else facing
                for angle in _YAWS:
                    turned = pin.AngleAxis(angle, stance.approach).toRotationMatrix() @ turn
                    placement = pin.SE3(turned, stance.center - turned @ spot.center)
                    self.tried += 1
                    # With a little room, as the tip yields when it is pressed on and slides.
                    part = nearer(placement, room * stance.approach)
                    found = links.within(stance.q, part, whole=True)
                    if found is not None:
                        self.blocked[found] += 1
                        self._covered.append((stance, part, bool(on_face)))
                        continue
                    bottom = float((shell.vertices @ turned[2]).min())
                    raised = bottom + float(placement.translation[2]) - links.floor
                    place = Place(stance, spot, placement, bool(on_face), raised, front)
                    if on_face:
                        yield place
                        offered += 1
                    else:
                        uneven.append(place)
                    break
                if offered >= _MOST_OF_STANCE or self.tried >= most:
                    break
            if self.tried >= most:
                break
        yield from uneven

    def out_of_limb(self) -> Tip | None:
        """Return the ball on the shortest stub with which the links would be free of the part.

        None where that would be too long at each place that was tried.
        """
        tip, even = self._limb.tip, [one for one in self._covered if one[2]] or self._covered
        for length in [rounded(one) for one in _STUBS * tip.radius]:
            for stance, part, _ in even[:: len(even) // _LOOKED + 1]:
                away = -length * stance.approach
                longest = max(stance.reach, _LONG * tip.radius)
                if length > longest or self._links.within(stance.q, nearer(part, away), whole=True):
                    continue
                self._limb.center(stance.q)
                ahead = self._limb.data.oMf[self._limb.frame].rotation.T @ stance.approach
                source = f"{tip.source}, on a stub of {mm(length)}: else links would be in the part"
                offset = (tip.offset + length * ahead).round(6)
                return replace(tip, offset=offset, source=source, ahead=ahead)
        return None

    def _stances(self, approach: Array, height: float | None) -> list[Stance]:
        """Return postures for an approach, at a `height` [m] above the floor if it is given."""
        key = (*approach, height)

        def usable(q: Array) -> bool:
            low = height is not None and self._links.lowest(q) <= self._links.floor - _AT_FLOOR
            return not (low or self._links.crossed(q))

        if key not in self._found:
            self._found[key] = stances(self._limb, self.q, approach, height, usable)
        return self._found[key]


def nearer(placement: pin.SE3, way: Array) -> pin.SE3:
    """Return the placement of a part that stands nearer to a tip, moved against the `way` (3,)."""
    return pin.SE3(placement.rotation, placement.translation - way)
