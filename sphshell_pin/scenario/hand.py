"""A new scenario in which a hand holds a free part between all its fingertips."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import trimesh

from sphshell_pin.dynamics.joints import JointIngredients
from sphshell_pin.dynamics.mimic import mimics
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import LoadedRobot, end_spheres, load_file
from sphshell_pin.scenario.balance import least_friction
from sphshell_pin.scenario.bodies import joint_spans
from sphshell_pin.scenario.build import Built
from sphshell_pin.scenario.clearance import Links, SelfContact
from sphshell_pin.scenario.figures import judge
from sphshell_pin.scenario.grasp import Grasp, Hand, grasps
from sphshell_pin.scenario.materials import Material, friction_between, restitution_between
from sphshell_pin.scenario.plan import GRAVITY, bearable, hertz_stiffness
from sphshell_pin.scenario.primitives import Ball, Box, Cylinder, Primitive
from sphshell_pin.scenario.run import simulate
from sphshell_pin.scenario.schema import RobotSection, ShellSection
from sphshell_pin.scenario.search import stated_kinds
from sphshell_pin.scenario.tips import Tip, floats
from sphshell_pin.shell.shell import Shell

Array = npt.NDArray[np.float64]

GAP = 1e-4
"""Of each fingertip at the start [m]."""

# Weights that friction could carry under the forces by default.
_SAFETY = 3.0
# How far the joints' springs are drawn by the largest torque [rad].
_DRAWN = 0.1
# Of the drafts of a search, how many are run; of a run, how long [s], and the part of it after
# which the hand holds.
_MOST_RUNS, _DURATION, _SETTLED = 6, 1.5, 0.4
# How far the part may move in that time, in radii, and how well the largest force is held.
_MOVED, _HELD = 0.2, 0.05
_NO_LIMIT = 1e9
# What may keep fingers from pressing as their motors do.
_BRAKES = ("friction", "damping")


@dataclass(frozen=True)
class Part:
    """The free body that carries the surface."""

    mass: float
    center: Array
    """Of its mass (3,) [m], in the frame of the surface."""
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
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "part.urdf"
            file.write_text(self.urdf())
            return load_file(file, free_flyer=True, mimic=True, name="part")

    def weight(self, placement: pin.SE3) -> Array:
        """Return its weight at `placement` (6,): force [N], torque about the world's origin."""
        force = np.array([0.0, 0.0, -GRAVITY * self.mass])
        return np.concatenate([force, np.cross(placement.act(self.center), force)])


@dataclass(frozen=True)
class Held:
    """A scenario that works: its text, the part's URDF, and why it is as it is."""

    text: str
    urdf: str
    built: Built
    why: tuple[str, ...]


def word_primitive(word: str, radius: float) -> Primitive:
    """Return what a word stands for between fingertips of `radius` [m]; SphshellError if nothing.

    It is five radii wide.
    """
    sizes: dict[str, Primitive] = {
        "sphere": Ball(2.5 * radius),
        "cylinder": Cylinder(radius=2.5 * radius, length=10 * radius),
        "box": Box([5 * radius, 5 * radius, 10 * radius]),
    }
    if word not in sizes:
        raise SphshellError(f"a hand cannot hold a {word}: --tips all takes {', '.join(sizes)}")
    return sizes[word]


def every_tip(
    robot: LoadedRobot, frame: str | None, radius: float | None, place: str | None
) -> list[Tip]:
    """Return all fingertips of `robot`; SphshellError for options that belong to a single one."""
    for option, value in (("--frame", frame), ("--radius", radius), ("--place", place)):
        if value is not None:
            raise SphshellError(f"{option} belongs to a single tip: leave it out with --tips all")
    return [
        Tip(one.frame, one.radius, np.array(one.offset), "the sphere of its collision geometry")
        for one in end_spheres(robot)
    ]


def hold_in_hand(
    section: RobotSection,
    shell_section: ShellSection,
    built: Built,
    tips: Sequence[Tip],
    materials: tuple[Material, Material],
    press: float | None,
    name: str,
    make: Callable[[str, Built], Built],
) -> Held:
    """Return a scenario `name` in which the `tips` of a robot hold the surface of `built`.

    `materials` are those of tips and part, `press` [N] the largest normal force of a tip;
    `make(text, reuse)` builds a text. Each draft is run; the first that holds the part is taken.

    Raises
    ------
    SphshellError
        None does; the text says why, and what to change.
    """
    model = built.assembly.model
    if floats(model):
        raise SphshellError("a hand with a free root cannot hold a part: leave out --free-flyer")
    if len(tips) < 2:
        raise SphshellError(
            f"--tips all needs two fingertips or more; the collision geometry of this robot has "
            f"{len(tips)} with a sphere"
        )
    (shell,) = built.shells.values()
    part = Part.of(shell, materials[1])
    hand = Hand(model, tips)
    mu, _ = friction_between(*materials)
    total = _SAFETY * part.mass * GRAVITY / mu if press is None else 2.0 * press
    hand_geometry = built.assembly.loaded[0].collision_model
    rules = mimics(model)
    moving = {model.names[j] for j in hand.joints}
    lock = tuple(name for name in list(model.names)[1:] if name not in rules and name not in moving)
    links = Links(model, hand_geometry, shell, tips, lock)
    touching = SelfContact(model, hand_geometry, built.assembly.q0)
    blocked: list[str] = []

    def free_of_part(q: Array, placement: pin.SE3) -> bool:
        found = links.within(q, placement, whole=True)
        if found is not None:
            blocked.append(found.link)
        return found is None

    found = grasps(
        hand,
        built.assembly.q0,
        shell,
        part.weight,
        total,
        mu,
        GAP,
        lambda q: not touching.found(q),
        free_of_part,
    )
    if not found:
        raise _no_grasp(shell, len(tips), blocked)
    reuse = _with_part(built, section, part, name)
    kinds = stated_kinds(model, lock)
    fault = ""
    for one in found[:_MOST_RUNS]:
        grasp = _pressed(one, part, press, mu)
        draft = _Draft(section, shell_section, shell, hand, grasp, part, materials, lock, name)
        fault = draft.fault()
        if fault:
            continue
        for joints in draft.choices(kinds):
            text = draft.text(joints)
            made = make(text, reuse)
            fault = _try(made, draft, links)
            if not fault:
                return Held(text, part.urdf(), made, draft.why(kinds, joints))
    raise SphshellError(
        f"no grasp of {min(len(found), _MOST_RUNS)} that were tried works: {fault}; a lighter "
        "--against, another --press, or a smaller part"
    )


def _no_grasp(shell: Shell, count: int, blocked: Sequence[str]) -> SphshellError:
    sizes = " x ".join(f"{1e3 * one:.3g}" for one in shell.box[1] - shell.box[0])
    if blocked:
        link = max(set(blocked), key=blocked.count)
        return SphshellError(
            f"link '{link}' would be in the part, or another one, wherever all {count} fingertips "
            f"touch it and could hold it: take a part of another size than {sizes} mm"
        )
    return SphshellError(
        f"the {count} fingertips cannot hold a part of {sizes} mm: nowhere that was tried do all "
        "touch it with forces inside their friction cones; take a part of another size, or its "
        "--unit"
    )


def _with_part(built: Built, section: RobotSection, part: Part, name: str) -> Built:
    """Return `built` with the part as a second robot, so that neither is read from files."""
    loaded = (built.assembly.loaded[0], part.loaded())
    scenario = built.scenario.model_copy(update={"robot": [section, _part_section(name)]})
    return replace(built, scenario=scenario, assembly=replace(built.assembly, loaded=loaded))


def _part_section(name: str) -> RobotSection:
    return RobotSection(urdf=part_file(name), free_flyer=True, label="part")


def part_file(name: str) -> str:
    """Return the name of the part's URDF, beside the scenario `name`."""
    return f"{name}_part.urdf"


def _pressed(grasp: Grasp, part: Part, press: float | None, mu: float) -> Grasp:
    """Return the grasp with forces of which the largest normal one is `press` [N]."""
    if press is None:
        return grasp
    total = 2.0 * press
    for _ in range(4):
        wrench = part.weight(grasp.placement)
        found = least_friction(grasp.points, grasp.normals, wrench, total, mu)
        if found is None:
            break
        grasp = replace(grasp, friction=found[0], forces=found[1])
        total *= press / grasp.normal_forces().max()
    return grasp


@dataclass(frozen=True)
class _Draft:
    section: RobotSection
    shell: ShellSection
    surface: Shell
    hand: Hand
    grasp: Grasp
    part: Part
    materials: tuple[Material, Material]
    lock: tuple[str, ...]
    name: str

    @property
    def press(self) -> float:
        """Largest normal force [N]."""
        return float(self.grasp.normal_forces().max())

    @property
    def strongest(self) -> int:
        """The tip that presses hardest."""
        return int(np.argmax(self.grasp.normal_forces()))

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
        kp = _round(torque / _DRAWN)
        inertia = np.diag(pin.crba(model, model.createData(), self.grasp.q))
        moved = [model.joints[j].idx_v for j in self.hand.joints]
        return kp, _round(1.4 * math.sqrt(kp * float(np.median(inertia[moved]))))

    def pressed_in(self) -> Array:
        """Return the configuration (nq,) in which the tips are as deep in the part as pressed."""
        radii = self.hand.radii
        stiffness = [hertz_stiffness(float(radius), *self.materials) for radius in radii]
        depths = (self.grasp.normal_forces() / stiffness) ** (2 / 3)
        found = self.hand.close_on(self.grasp.q, self.surface, self.grasp.placement, -depths)
        return self.grasp.q if found is None else found[0]

    def choices(self, kinds: list[str]) -> list[list[str]]:
        """Return what may act in the joints: what the file states, then without what brakes."""
        free = [kind for kind in kinds if kind not in _BRAKES]
        pushes = float(np.abs(self.hand.torques(self.grasp)).max())
        dry = JointIngredients.from_model(self.hand.model, ["friction"]).friction.values()
        stuck = any(one.torque > pushes for one in dry)
        return [free] if stuck or free == kinds else [kinds, free]

    def text(self, joints: list[str]) -> str:
        """Return the scenario's text, with `joints` of what the robot's file states."""
        model, grasp, hand = self.hand.model, self.grasp, self.hand
        kp, kd = self.gains()
        drawn = pin.integrate(model, self.pressed_in(), hand.torques(grasp) / kp)
        one, other = self.materials
        static, dynamic = friction_between(one, other)
        radius, load = float(hand.radii.min()), self.press
        slope = 1.5 * hertz_stiffness(radius, one, other) ** (2 / 3) * load ** (1 / 3)
        damping = 0.2 * math.sqrt(slope * self.part.mass / len(hand.tips))
        place = grasp.placement
        root = [*place.translation.tolist(), *pin.Quaternion(place.rotation).coeffs().tolist()]
        stated = self.section.model_dump(exclude_defaults=True)
        keys = ("name", "urdf", "file", "package_dirs", "xacro_args")
        source = "\n".join(f"{key} = {_toml(stated[key])}" for key in keys if key in stated)
        if self.lock:
            source += f"\nlock = {_toml(list(self.lock))} # they move no fingertip"
        surface = self.shell.model_dump(exclude_defaults=True, exclude={"frame", "placement"})
        spheres = "\n".join(
            f"  {{ frame = {_toml('hand/' + tip.frame)}, radius = {tip.radius!r}, "
            f"offset = {_toml(tip.offset.tolist())} }},"
            for tip in hand.tips
        )
        strongest = f"tips/hand/{hand.tips[self.strongest].frame}"
        return f"""\
# {len(hand.tips)} fingertips hold {self.shell.name}.
#
#   sphshell-pin run {self.name}.toml
#   sphshell-pin view {self.name}.toml
#
# Units are SI (m, kg, s, N, rad) unless a key says otherwise.

title = {_toml(f"{len(hand.tips)} fingertips hold {self.shell.name}")}

[[robot]]
{source}
label = "hand"
joints = {_toml(joints)}

# All fingertips are {1e3 * GAP:g} mm away from the part.
[robot.start]
{_joints(model, grasp.q, hand.joints, "")}

# {self.part.mass:.3g} kg, {other.name} all through: {other.density:g} kg/m^3.
[[robot]]
urdf = {_toml(part_file(self.name))}
free_flyer = true
label = "part"

[robot.start]
# x y z [m] and the quaternion x y z w
root_joint = {_toml([round(x, 9) for x in root])}

[[shell]]
{chr(10).join(f"{key} = {_toml(value)}" for key, value in surface.items())}
frame = "part/part"

# Hertz: {one.name} balls on {other.name}; friction that sticks.
[[contact]]
name = "tips"
spheres = [
{spheres}
]
shell = {_toml(self.shell.name)}

[contact.law]
type = "hertz"
radius = {radius!r}
young_1 = {_toml(one.young)}
poisson_1 = {one.poisson}
young_2 = {_toml(other.young)}
poisson_2 = {other.poisson}
restitution = {restitution_between(one, other)}
speed = 0.1

[contact.friction]
type = "bristle"
mu_static = {round(static, 3)}
mu_dynamic = {round(dynamic, 3)}
stiffness = {_toml(_round(slope))} # [N/m] as stiff as the law under the load
damping = {_toml(_round(damping))} # [N s/m] a tenth of critical
torsional = true # a fingertip is soft

[controller]
type = "joint-pd"
kp = {_toml(kp)} # [N m/rad]
kd = {_toml(kd)} # [N m s/rad]

# Where the springs would take the fingers if the part were not there: {self.press:.3g} N at most.
[controller.q_ref]
{_joints(model, drawn, hand.joints, "hand/")}

[run]
duration = {_DURATION}
integrator = "implicit"
rtol = 1e-5
record_dt = 5e-3

[[knob]]
key = "controller.kp"

[[knob]]
key = "contact.tips.friction.mu_static"
min = {round(dynamic, 3)}
max = 1.5

[[knob]]
key = "gravity.2"
min = -20.0
max = 0.0

# What the run is checked against.
[expect]
{_toml(f"pairs.{strongest}.mean_force")} = {{ value = {_round(self.press, 3)}, rtol = {_HELD} }}
{_toml(f"pairs.{strongest}.touches")} = {{ min = 1 }}
"energy.relative_residual" = {{ max = 1e-3 }}
"""

    def why(self, kinds: list[str], joints: list[str]) -> tuple[str, ...]:
        """Return one sentence for each choice that was made."""
        left_out = [kind for kind in kinds if kind not in joints]
        note = f"the joints' {' and '.join(left_out)}, which the file states, is left out: with it "
        notes = (note + "the fingers do not press as they should",) if left_out else ()
        one, other = self.materials
        frames = ", ".join(f"'{tip.frame}'" for tip in self.hand.tips)
        used = self.grasp.friction / friction_between(one, other)[0]
        return (
            f"{len(self.hand.tips)} fingertips, the spheres of the collision geometry: {frames}",
            f"the part is {other.name} all through and weighs {self.part.mass:.3g} kg",
            f"the fingertips press with {self.press:.3g} N at most; its weight and their forces "
            f"use {100 * used:.0f} % of the friction",
            f"law and friction of {one.name} on {other.name}, typical values: --law and --against "
            "name others",
            *notes,
        )


def _try(built: Built, draft: _Draft, links: Links) -> str:
    """Run a draft; return what fails, or an empty text."""
    result, stopped = simulate(built)
    if stopped is not None:
        return f"the run stops: {stopped}"
    for name, pair in result.stats.pairs.items():
        if pair.contact_time < 0.9 * _DURATION:
            return f"'{name}' loses the part"
    model = built.scene.model
    span, _ = joint_spans(model, "part/root_joint")
    held = result.q[result.t >= _SETTLED * _DURATION]
    moved = float(np.linalg.norm(held[:, span][:, :3] - held[0, span][:3], axis=1).max())
    if moved > _MOVED * float(draft.hand.radii.min()):
        return f"the part moves by {1e3 * moved:.2g} mm in the hand"
    q = draft.grasp.q.copy()
    for row in result.q[:: max(1, len(result.q) // 60)]:
        for j in draft.hand.joints:
            name = draft.hand.model.names[j]
            to_q, _ = joint_spans(draft.hand.model, name)
            from_q, _ = joint_spans(model, f"hand/{name}")
            q[to_q] = row[from_q]
        found = links.within(q, pin.XYZQUATToSE3(row[span]))
        if found is not None:
            return f"link '{found.link}' is in the part"
    for one in judge(built, result):
        if not one.met:
            return f"{one.figure} is {one.measured:.3g}, not {one.expected}"
    return ""


def _joints(model: pin.Model, q: Array, joints: Sequence[int], prefix: str) -> str:
    lines = []
    for j in joints:
        span, _ = joint_spans(model, model.names[j])
        values = [round(float(x), 6) for x in q[span]]
        stated = values[0] if len(values) == 1 else values
        lines.append(f"{_toml(prefix + model.names[j])} = {_toml(stated)}")
    return "\n".join(lines)


def _round(x: float, digits: int = 2) -> float:
    return float(f"{x:.{digits}g}")


def _toml(value: object) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False)
