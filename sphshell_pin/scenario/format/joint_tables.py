"""What a scenario models in the joints: of its robots' files, and by its own tables."""

import math
from pathlib import Path

import pinocchio as pin

from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.dynamics.scene.joint_components import (
    JointComponents,
    JointFriction,
    JointLimits,
)
from sphshell_pin.dynamics.scene.models import find_joint
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.format.bodies import Assembly, blamed_on
from sphshell_pin.scenario.format.reading import item_key
from sphshell_pin.scenario.format.schema import JointSection, Scenario


def joint_components(scenario: Scenario, assembly: Assembly, path: Path) -> JointComponents | None:
    """Return the components of all joints of `assembly`; None where none is asked for.

    Raises ScenarioError for a joint that does not exist, or that cannot have what its table says.
    """
    if not scenario.joint and not any(robot.joints for robot in scenario.robot):
        return None
    joints = JointComponents()
    for robot, loaded, prefix in zip(
        scenario.robot, assembly.loaded, assembly.prefixes, strict=True
    ):
        own = JointComponents.from_model(loaded.model, robot.joints)
        for kind in own.kinds():
            for name, value in getattr(own, kind).items():
                joints = joints.replaced(prefix + name, **{kind: value})
    for i, section in enumerate(scenario.joint):
        with blamed_on(path, item_key("joint", scenario.joint, i)):
            find_joint(assembly.model, section.name)
            joints = _with(joints, section, assembly.model, path.parent)
    return joints


def _with(
    joints: JointComponents, section: JointSection, model: pin.Model, folder: Path
) -> JointComponents:
    changes: dict[str, object] = {
        kind: value
        for kind in ("damping", "armature", "effort", "speed")
        if (value := getattr(section, kind)) is not None
    }
    if section.friction is not None:
        changes["friction"] = JointFriction(
            section.friction, section.friction_stiffness, section.friction_damping
        )
    if any(one is not None for one in (section.lower, section.upper, section.stop)):
        changes["limits"] = _limits(joints, section, model, folder)
    return joints.replaced(section.name, **changes)


def _limits(
    joints: JointComponents, section: JointSection, model: pin.Model, folder: Path
) -> JointLimits:
    name = section.name
    stated = joints.limits.get(name)
    if stated is None:
        stated = JointComponents.from_model(model, ["limits"]).limits.get(name)
    law: NormalLaw | None = None if stated is None else stated.law
    if section.stop is not None:
        law = section.stop._build(folder)
    if law is None:
        raise SphshellError(
            "needs the law of its stops, `stop = { type = ... }`: the robot's file states no "
            "range, from which a default would follow"
        )
    ends = (-math.inf, math.inf) if stated is None else (stated.lower, stated.upper)
    lower = ends[0] if section.lower is None else section.lower
    upper = ends[1] if section.upper is None else section.upper
    return JointLimits(lower, upper, law)
