"""The frames of a scene as a tree of transforms: links, spheres and shells."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.dynamics.scene.scene import Scene

Message = Mapping[str, object]
"""Fields of a ROS 2 message by their names; those that are left out are zero or empty."""

WORLD = "universe"
"""The root of all frames, as Pinocchio calls it."""


@dataclass(frozen=True)
class Fixed:
    """A frame called `name` at `placement` in the frame `parent`, for the whole run."""

    name: str
    parent: str
    placement: pin.SE3


@dataclass(frozen=True)
class Moving:
    """A frame called `name` at `placement` in a moving joint."""

    name: str
    joint: int
    placement: pin.SE3


@dataclass(frozen=True)
class Frames:
    """The frames of a scene.

    `moving`: one for each moving joint, in the world; `fixed`: all others,
    in one of those or in the world. `spheres`, `other_spheres` name the frames of the spheres by
    the name of their pair, `shells` those of the shells by the key of their side; `contacts` are
    names for frames of the contacts of each pair.
    """

    moving: tuple[Moving, ...]
    fixed: tuple[Fixed, ...]
    spheres: dict[str, str]
    other_spheres: dict[str, str]
    contacts: dict[str, str]
    shells: dict[tuple[int, int, bytes], str]

    def on(self, joint: int) -> tuple[str, pin.SE3]:
        """Return the frame that moves with `joint`, and where it is in the joint."""
        one = next((one for one in self.moving if one.joint == joint), None)
        return (WORLD, pin.SE3.Identity()) if one is None else (one.name, one.placement)

    @classmethod
    def of(cls, scene: Scene, also: Iterable[str] = ()) -> Frames:
        """Return the frames of the links, spheres and shells of `scene`, and those called `also`.

        A joint's first link stands for all that is fixed to it, its own frame where it has none.
        Spheres are called sphere/PAIR, the second of a pair sphere/PAIR/other, shells shell/NAME,
        with a number if names repeat.
        """
        model = scene.model
        named = {name for pair in scene.pairs for name in (pair.frame_i, pair.frame_j)}
        wanted = {k for k, one in enumerate(model.frames) if one.type == pin.FrameType.BODY}
        wanted |= {find_frame(model, name) for name in (*named, *also)}
        wanted.discard(0)
        moving: dict[int, Moving] = {}
        fixed: list[Fixed] = []
        for frame in (model.frames[k] for k in sorted(wanted)):
            joint, place = int(frame.parentJoint), pin.SE3(frame.placement)
            if joint and joint not in moving:
                moving[joint] = Moving(frame.name, joint, place)
            else:
                fixed.append(_hung(frame.name, joint, place, moving))
        taken = {WORLD, *(one.name for one in moving.values()), *(one.name for one in fixed)}
        # A joint that carries nothing itself may carry other joints.
        for joint in range(1, model.njoints):
            if joint not in moving:
                name = free_name(model.names[joint], taken)
                moving[joint] = Moving(name, joint, pin.SE3.Identity())
        spheres: dict[str, str] = {}
        others: dict[str, str] = {}
        contacts: dict[str, str] = {}
        shells: dict[tuple[int, int, bytes], str] = {}
        for pair in scene.pairs:
            contacts[pair.name] = free_name(f"contact/{pair.name}", taken)
            ends = (spheres, ""), (others, "/other")
            for ball, (known, end) in zip(pair.spheres, ends, strict=False):
                name = known[pair.name] = free_name(f"sphere/{pair.name}{end}", taken)
                fixed.append(_hung(name, ball.joint, ball.in_joint, moving))
            for one in pair.shells:
                if one.key not in shells:
                    name = shells[one.key] = free_name(f"shell/{one.shell.name}", taken)
                    fixed.append(_hung(name, one.joint, one.in_joint, moving))
        return cls(tuple(moving.values()), tuple(fixed), spheres, others, contacts, shells)


def xyz(vector: Array) -> Message:
    """Return a point or vector (3,) as a message."""
    return dict(zip("xyz", np.asarray(vector, dtype=float).tolist(), strict=True))


def quaternion(rotation: Array) -> Message:
    """Return a rotation matrix as a message."""
    return dict(zip("xyzw", pin.Quaternion(rotation).coeffs().tolist(), strict=True))


def _hung(name: str, joint: int, place: pin.SE3, moving: dict[int, Moving]) -> Fixed:
    """Return a frame at `place` in `joint` as hung on what moves with the joint."""
    if joint == 0:
        return Fixed(name, WORLD, place)
    return Fixed(name, moving[joint].name, moving[joint].placement.actInv(place))


def free_name(wanted: str, taken: set[str], mark: str = "-") -> str:
    """Return the name `wanted`, with `mark` and a number if it is taken; take it."""
    name, k = wanted, 2
    while name in taken:
        name, k = f"{wanted}{mark}{k}", k + 1
    taken.add(name)
    return name
