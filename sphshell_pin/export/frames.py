"""The frames of a scene as a tree of transforms: links, spheres and shells."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.texts import free_name
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.dynamics.scene.scene import Scene

Message = Mapping[str, object]
"""Fields of a ROS 2 message by their names; those that are left out are zero or empty."""

WORLD = "universe"
"""The root of all frames, as Pinocchio calls it."""


@dataclass(frozen=True)
class Frames:
    """The frames of a scene.

    `moving`: name and placement in the joint of one frame for each moving joint; `fixed`: name,
    parent and placement of all others. `names` are those of the frames of spheres, by pair and
    number, of contacts, by pair, and of shells, by the key of their side.
    """

    moving: dict[int, tuple[str, pin.SE3]] = field(default_factory=dict)
    fixed: list[tuple[str, str, pin.SE3]] = field(default_factory=list)
    names: dict[object, str] = field(default_factory=dict)

    @classmethod
    def of(cls, scene: Scene) -> Frames:
        """Return the frames of the links, spheres and shells of `scene`.

        A joint's first link stands for all that is fixed to it, its own frame where it has none.
        Spheres are called sphere/PAIR, the second of a pair sphere/PAIR/other, shells shell/NAME,
        with a number if names repeat.
        """
        model, made = scene.model, cls()
        named = {name for pair in scene.pairs for name in (pair.frame_i, pair.frame_j)}
        wanted = {k for k, one in enumerate(model.frames) if one.type == pin.FrameType.BODY}
        wanted |= {find_frame(model, name) for name in named}
        taken = {WORLD, *(model.frames[k].name for k in wanted)}
        links = [model.frames[k] for k in sorted(wanted - {0})]
        for frame in links:
            joint, place = int(frame.parentJoint), pin.SE3(frame.placement)
            if joint and joint not in made.moving:
                made.moving[joint] = frame.name, place
            else:
                made._hang(frame.name, joint, place)
        # A joint that carries nothing itself may carry other joints.
        for joint in range(1, model.njoints):
            if joint not in made.moving:
                made.moving[joint] = take_name(model.names[joint], taken), pin.SE3.Identity()
        for pair in scene.pairs:
            made.names[pair.name] = take_name(f"contact/{pair.name}", taken)
            for k, ball in enumerate(pair.spheres):
                name = take_name(f"sphere/{pair.name}{'/other' * k}", taken)
                made.names[pair.name, k] = name
                made._hang(name, ball.joint, ball.in_joint)
            for one in pair.shells:
                if one.key not in made.names:
                    made.names[one.key] = take_name(f"shell/{one.shell.name}", taken)
                    made._hang(made.names[one.key], one.joint, one.in_joint)
        return made

    def _hang(self, name: str, joint: int, place: pin.SE3) -> None:
        """Add a frame at `place` in `joint`, fixed to what moves with the joint."""
        parent, at = self.moving.get(joint, (WORLD, pin.SE3.Identity()))
        self.fixed.append((name, parent, at.actInv(place)))


def xyz(vector: Array) -> Message:
    """Return a point or vector (3,) as a message."""
    return dict(zip("xyz", np.asarray(vector, dtype=float).tolist(), strict=True))


def header(time: int, frame: str) -> Message:
    """Return the header of a message at a time [ns] in a frame."""
    stamp = dict(zip(("sec", "nanosec"), divmod(time, 10**9), strict=True))
    return {"stamp": stamp, "frame_id": frame}


def transform(time: int, parent: str, name: str, place: pin.SE3) -> Message:
    """Return where the frame `name` is in its parent, at a time [ns]."""
    turn = dict(zip("xyzw", pin.Quaternion(place.rotation).coeffs().tolist(), strict=True))
    at = {"translation": xyz(place.translation), "rotation": turn}
    return {"header": header(time, parent), "child_frame_id": name, "transform": at}


def take_name(wanted: str, taken: set[str], mark: str = "-") -> str:
    """Return the name `wanted`, with `mark` and a number if it is taken; take it."""
    name = free_name(wanted, taken, f"{mark}{{}}")
    taken.add(name)
    return name
