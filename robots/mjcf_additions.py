"""What pinocchio's reader leaves out of MJCF, put into its model afterwards."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin


@dataclass(frozen=True)
class Extras:
    """Damping and dry friction of a joint of several degrees of freedom: in SI units, for each."""

    damping: float
    friction: float

    def give(self, model: pin.Model, joint: pin.JointModel) -> None:
        """Write them into `model`."""
        span = slice(joint.idx_v, joint.idx_v + joint.nv)
        for name, value in (
            ("damping", self.damping),
            ("lowerDryFrictionLimit", -self.friction),
            ("upperDryFrictionLimit", self.friction),
        ):
            values = np.array(getattr(model, name))
            values[span] = value
            setattr(model, name, values)


@dataclass(frozen=True)
class Site:
    """A frame on a body, which pinocchio reads on bodies with joints only."""

    name: str
    body: str
    place: pin.SE3

    def give(self, model: pin.Model) -> None:
        """Add it to `model`."""
        place, frame, joint = self.place, 0, 0
        if self.body != "world":
            frame = model.getFrameId(self.body, pin.FrameType.BODY)
            place = model.frames[frame].placement * place
            joint = model.frames[frame].parentJoint
        kind = pin.FrameType.OP_FRAME
        model.addFrame(pin.Frame(self.name, joint, frame, place, kind), False)
