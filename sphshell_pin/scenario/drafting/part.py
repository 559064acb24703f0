"""A free part in the fingertips of a hand: its mass and its URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.materials import Material
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import LoadedRobot
from sphshell_pin.robots.inertia import inertia_of_solid, inertial_element
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.schema import RobotSection
from sphshell_pin.shell.shell import Shell

GRAVITY = 9.81


@dataclass(frozen=True)
class Part:
    """The free body that carries the surface, with its `inertia` in the frame of that."""

    inertia: pin.Inertia

    @classmethod
    def of(cls, shell: Shell, material: Material) -> Part:
        """Return the part that is of `material` all through; SphshellError if it is open."""
        if not shell.is_closed:
            raise SphshellError(
                f"the surface '{shell.name}' is open, so it has no weight: --tips all holds a "
                "closed part"
            )
        return cls(inertia_of_solid(shell, material.density))

    def urdf(self) -> str:
        """Return its description: the link `part`."""
        robot = ET.Element("robot", name="part")
        ET.SubElement(robot, "link", name="part").append(inertial_element(self.inertia))
        ET.indent(robot)
        return f'<?xml version="1.0"?>\n{ET.tostring(robot, "unicode")}\n'

    def loaded(self) -> LoadedRobot:
        """Return it as a robot with a free root."""
        model = pin.buildModelFromXML(self.urdf(), pin.JointModelFreeFlyer())
        bare = pin.GeometryModel()
        return LoadedRobot("part", model, bare, bare, pin.neutral(model))

    def beside(self, built: Built, name: str) -> Built:
        """Return `built` with it as a second robot, so that neither is read from files."""
        loaded = (built.assembly.loaded[0], self.loaded())
        section = RobotSection(urdf=part_file(name), free_flyer=True, label="part")
        scenario = built.scenario.model_copy(update={"robot": [*built.scenario.robot, section]})
        return replace(built, scenario=scenario, assembly=replace(built.assembly, loaded=loaded))

    def weight(self, placement: pin.SE3) -> Array:
        """Return its weight at `placement` (6,): force [N], torque about the world's origin."""
        force = np.array([0.0, 0.0, -GRAVITY * self.inertia.mass])
        return np.concatenate([force, np.cross(placement.act(self.inertia.lever), force)])


def part_file(name: str) -> str:
    """Return the name of the part's URDF, beside the scenario `name`."""
    return f"{name}_part.urdf"
