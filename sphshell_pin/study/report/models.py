"""Small models: bodies on joints at the world, each with a frame of its name."""

import numpy as np
import pinocchio as pin


def model_of(*bodies: tuple[str, pin.JointModel, pin.Inertia], gravity: float = 0.0) -> pin.Model:
    """Return a model of bodies (name, joint, inertia) under `gravity` [m/s^2] along -z."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    for name, joint, inertia in bodies:
        index = model.addJoint(0, joint, pin.SE3.Identity(), f"{name}_joint")
        model.addJointFrame(index)
        model.appendBodyToJoint(index, inertia, pin.SE3.Identity())
        model.addFrame(pin.Frame(name, index, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    return model
