"""A free part in the fingertips of a hand: its mass and its URDF."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.materials import Material
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import LoadedRobot
from sphshell_pin.scenario.drafting.tip_contact import GRAVITY
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.schema import RobotSection
from sphshell_pin.shell.shell import Shell


@dataclass(frozen=True)
class Part:
    """The free body that carries the surface."""

    mass: float
    center: Array
    """Center of its mass (3,) [m], in the frame of the surface."""
    inertia: Array
    """About that (3, 3) [kg m^2]."""

    @classmethod
    def of(cls, shell: Shell, material: Material) -> Part:
        """Return the part that is of `material` all through; SphshellError if it is open."""
        if not shell.is_closed:
            raise SphshellError(
                f"the surface '{shell.name}' is open, so it has no weight: --tips all holds a "
                "closed part"
            )
        with interrupts_delayed():
            import trimesh

        mesh = trimesh.Trimesh(shell.vertices, shell.triangles, process=False)
        mesh.density = material.density
        return cls(float(mesh.mass), np.array(mesh.center_mass), np.array(mesh.moment_inertia))

    def urdf(self) -> str:
        """Return its description: the link `part`."""
        x, y, z = self.center
        i = self.inertia
        return f"""<?xml version="1.0"?>
<robot name="part">
  <link name="part">
    <inertial>
      <origin xyz="{x:.9g} {y:.9g} {z:.9g}"/>
      <mass value="{self.mass:.9g}"/>
      <inertia ixx="{i[0, 0]:.9g}" iyy="{i[1, 1]:.9g}" izz="{i[2, 2]:.9g}"
               ixy="{i[0, 1]:.9g}" ixz="{i[0, 2]:.9g}" iyz="{i[1, 2]:.9g}"/>
    </inertial>
  </link>
</robot>
"""

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
        force = np.array([0.0, 0.0, -GRAVITY * self.mass])
        return np.concatenate([force, np.cross(placement.act(self.center), force)])


def part_file(name: str) -> str:
    """Return the name of the part's URDF, beside the scenario `name`."""
    return f"{name}_part.urdf"
