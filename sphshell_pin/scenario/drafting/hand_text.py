"""The text of a scenario in which a hand holds a part, and the values in it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.materials import Material, friction_between
from sphshell_pin.dynamics.scene.joint_components import JointComponents
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.scenario.drafting.draft_text import toml
from sphshell_pin.scenario.drafting.grasp import Grasp, Hand
from sphshell_pin.scenario.drafting.part import Part, part_file
from sphshell_pin.scenario.drafting.tip_contact import Contact, bearable, hertz_stiffness, sticking
from sphshell_pin.scenario.drafting.wording import rounded
from sphshell_pin.scenario.format.bodies import joint_spans
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.schema import ShellSection

GAP = 1e-4
"""Gap of each fingertip at the start [m]."""

DURATION, HELD = 1.5, 0.15
"""Duration of the run [s], and how well the largest force is held in it."""

_TEMPLATE = Path(__file__).with_name("hand.template").read_text("utf-8")
# How far the joints' springs are drawn by the largest torque [rad].
_DRAWN = 0.1
_NO_LIMIT = 1e9
# What may keep fingers from pressing as their motors do.
_BRAKES = ("friction", "damping")


@dataclass(frozen=True)
class HandDraft:
    """A grasp that becomes a scenario `name`."""

    built: Built
    """The robot and the surface, without contacts."""
    hand: Hand
    grasp: Grasp
    part: Part
    materials: tuple[Material, Material]
    lock: tuple[str, ...]
    name: str

    @property
    def shell(self) -> ShellSection:
        """The table of the surface."""
        return self.built.scenario.shell[0]

    @property
    def contact(self) -> Contact:
        """Contact of its tips with the part."""
        radius, share = float(self.hand.radii.min()), self.part.mass / len(self.hand.tips)
        return sticking(self.materials, radius, 0.1, self.press, share)

    @property
    def press(self) -> float:
        """Largest normal force [N]."""
        return float(self.grasp.normal_forces().max())

    def fault(self) -> str:
        """Say what is wrong before anything is run."""
        model, torques = self.hand.model, self.hand.torques(self.grasp)
        weight = pin.computeGeneralizedGravity(model, model.createData(), self.grasp.q)
        limits = np.array(model.upperEffortLimit)
        stated = (limits > 0) & (limits < _NO_LIMIT)
        over = np.flatnonzero(stated & (np.abs(torques + weight) > limits))
        if len(over):
            k = int(over[0])
            return f"the effort limit of {limits[k]:g} N m allows no press of {self.press:.3g} N"
        radius = float(self.hand.radii.min())
        if self.press > bearable(radius, *self.materials) * 7.5**1.5:
            return (
                f"{self.press:.3g} N would press a {self.materials[0].name} sphere of radius "
                f"{1e3 * radius:.3g} mm in by more than half of it"
            )
        return ""

    def gains(self) -> tuple[float, float]:
        """Return stiffness [N m/rad] and damping [N m s/rad] of the joints."""
        model = self.hand.model
        torque = float(np.abs(self.hand.torques(self.grasp)).max())
        kp = rounded(torque / _DRAWN)
        inertia = np.diag(mass_matrix(model, self.grasp.q))
        moved = [model.joints[j].idx_v for j in self.hand.joints]
        return kp, rounded(1.4 * math.sqrt(kp * float(np.median(inertia[moved]))))

    def pressed_in(self) -> Array:
        """Return the configuration (nq,) in which the tips are as deep in the part as pressed."""
        (surface,) = self.built.shells.values()
        radii = self.hand.radii
        stiffness = [hertz_stiffness(float(radius), *self.materials) for radius in radii]
        depths = (self.grasp.normal_forces() / stiffness) ** (2 / 3)
        found = self.hand.close_on(self.grasp.q, surface, self.grasp.placement, -depths)
        return self.grasp.q if found is None else found[0]

    def choices(self, kinds: list[str]) -> list[list[str]]:
        """Return what may act in the joints: what the file states, then without what brakes."""
        free = [kind for kind in kinds if kind not in _BRAKES]
        pushes = float(np.abs(self.hand.torques(self.grasp)).max())
        dry = JointComponents.from_model(self.hand.model, ["friction"]).friction.values()
        stuck = any(one.torque > pushes for one in dry)
        return [free] if stuck or free == kinds else [kinds, free]

    def text(self, joints: list[str]) -> str:
        """Return the scenario's text, with `joints` of what the robot's file states."""
        model, grasp, hand = self.hand.model, self.grasp, self.hand
        kp, kd = self.gains()
        drawn = pin.integrate(model, self.pressed_in(), hand.torques(grasp) / kp)
        one, other = self.materials
        place = grasp.placement
        root = [*place.translation.tolist(), *pin.Quaternion(place.rotation).coeffs().tolist()]
        stated = self.built.scenario.robot[0].model_dump(exclude_defaults=True)
        keys = ("name", "urdf", "file", "package_dirs", "xacro_args", "density", "mimic")
        source = "\n".join(f"{key} = {toml(stated[key])}" for key in keys if key in stated)
        if self.lock:
            source += f"\nlock = {toml(list(self.lock))} # they move no fingertip"
        surface = self.shell.model_dump(exclude_defaults=True, exclude={"frame", "placement"})
        spheres = "\n".join(
            f"  {{ frame = {toml('hand/' + tip.frame)}, radius = {tip.radius!r}, "
            f"offset = {toml(tip.offset.tolist())} }},"
            for tip in hand.tips
        )
        strongest = f"tips/hand/{hand.tips[int(np.argmax(grasp.normal_forces()))].frame}"
        title = f"{len(hand.tips)} fingertips hold {self.shell.name}"
        return _TEMPLATE.format(
            draft=self,
            tip=one,
            part=other,
            contact=self.contact,
            title=title,
            title_text=toml(title),
            source=source,
            joints=toml(joints),
            gap=1e3 * GAP,
            start=_joints(model, grasp.q, hand.joints, ""),
            urdf=toml(part_file(self.name)),
            root=toml([round(x, 9) for x in root]),
            surface="\n".join(f"{key} = {toml(value)}" for key, value in surface.items()),
            spheres=spheres,
            shell=toml(self.shell.name),
            radius=float(hand.radii.min()),
            kp=kp,
            kd=kd,
            drawn=_joints(model, drawn, hand.joints, "hand/"),
            duration=DURATION,
            mean_force=toml(f"pairs.{strongest}.mean_force"),
            touches=toml(f"pairs.{strongest}.touches"),
            force=rounded(self.press, 3),
            held=HELD,
        )

    def why(self, kinds: list[str], joints: list[str]) -> tuple[str, ...]:
        """Return one sentence for each choice that was made."""
        left_out = [kind for kind in kinds if kind not in joints]
        note = f"of what the file states of the joints, without {' and '.join(left_out)}: with "
        notes = (note + "that the fingers would not press as they should",) if left_out else ()
        one, other = self.materials
        frames = ", ".join(f"'{tip.frame}'" for tip in self.hand.tips)
        used = self.grasp.friction / friction_between(one, other)[0]
        return (
            f"{len(self.hand.tips)} fingertips, {self.hand.tips[0].source}: {frames}",
            f"the part is {other.name} all through and weighs {self.part.mass:.3g} kg",
            f"the fingertips press with {self.press:.3g} N at most; its weight and their forces "
            f"use {100 * used:.0f} % of the friction",
            self.contact.note,
            *notes,
        )


def _joints(model: pin.Model, q: Array, joints: Sequence[int], prefix: str) -> str:
    lines = []
    for j in joints:
        span, _ = joint_spans(model, model.names[j])
        values = [round(float(x), 6) for x in q[span]]
        stated = values[0] if len(values) == 1 else values
        lines.append(f"{toml(prefix + model.names[j])} = {toml(stated)}")
    return "\n".join(lines)
