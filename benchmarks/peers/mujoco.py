"""The scenes in MuJoCo: height fields and boxes, since it takes meshes by their convex hulls."""

import math
from typing import Any

import numpy as np

from benchmarks.peers.engine import CpuClock, Engine, Params, Trajectory
from benchmarks.peers.merged import text
from benchmarks.peers.press import FRAME, PressScene, at_the_end
from benchmarks.peers.scenes import Scene
from benchmarks.peers.shapes import Surface
from benchmarks.peers.truths import BallScene, Bowl, Cylinder, Groove, Impact, Plate, Turntable
from sphshell_pin.base.arrays import Array

# A contact of impedance d answers the share d of a load by itself and leaves 1 - d to the spring:
# at the least impedance that MuJoCo has it is the spring of the scene. Friction needs more of it.
SPRING, FIRM = 1e-4, 0.95
IMPRATIO = 100.0
BASE = 0.01  # thickness of a height field below its lowest place [m]
TABLE_INERTIA = 1e4  # [kg m^2]: the ball does not slow the table
FIELD, BOXES = "height field", "boxes"


class MuJoCo(Engine):
    """MuJoCo, stepped by mujoco.rollout: no Python between steps."""

    name, package = "MuJoCo", "mujoco"

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return the options and the chapters of the documentation that recommend them."""
        settings = {
            "surface": "height field or boxes (XML reference, geom: a mesh collides as its convex "
            "hull)",
            "law": "direct solref (Modeling, Reference: recommended for identification), "
            + ("the scene's depth at rest" if scene.mu else "impedance 1e-4: the scene's spring"),
            "solver": "Newton, tolerance 1e-10 (Modeling, Solver settings)",
        }
        if scene.mu:
            settings["friction"] = (
                f"elliptic cones, impratio {IMPRATIO:g} (Modeling, Solver settings: against slip)"
            )
        if isinstance(scene, Impact):
            settings["flag"] = "speculative, on and off (Changelog 4.0: against tunnelling)"
        if isinstance(scene, PressScene):
            settings["control"] = "position actuators with kv; gravcomp = 1, or gravity off"
        return settings

    def param_sets(self, scene: Scene) -> list[Params]:
        """Return integrators, steps, and the surface: boxes, or cells of a height field [m]."""
        if isinstance(scene, PressScene):
            common = {"integrator": "implicitfast", "dt": scene.dt, "surface": FIELD}
            common["cell"] = scene.surface.spacing
            return [
                {**common, "gravity": gravity, "cone": cone, "impedance": d}
                for gravity, cone, d in (
                    ("gravcomp", "elliptic", FIRM),
                    ("off", "elliptic", FIRM),
                    ("off", "pyramidal", FIRM),
                    ("off", "elliptic", SPRING),
                )
            ]
        if isinstance(scene, Bowl):
            # Several contacts at one place add up to less at the middle impedance.
            tried = (
                (1, "RK4", 1e-3, SPRING), (1, "implicitfast", 1e-3, 0.3),
                (2, "implicitfast", 1e-3, 0.3), (2, "RK4", 1e-3, 0.3),
                (4, "implicitfast", 1e-3, 0.3), (2, "implicitfast", 2e-4, 0.3),
                (4, "RK4", 1e-3, 0.3), (4, "implicitfast", 2e-4, 0.3), (8, "RK4", 1e-3, 0.3),
            )  # fmt: skip
            return [
                {"integrator": integrator, "dt": dt, "surface": FIELD, "impedance": d}
                | {"cell": scene.surface.spacing / share}
                for share, integrator, dt, d in tried
            ]
        if isinstance(scene, Impact):
            return [
                {"integrator": "RK4", "dt": dt, "surface": BOXES, "speculative": speculative}
                for speculative in (False, True)
                for dt in scene.dts
            ]
        surfaces: list[Params] = []
        if not isinstance(scene, Cylinder | Turntable):
            surfaces.append({"surface": FIELD, "cell": scene.surface.spacing})
        if not isinstance(scene, Plate):
            surfaces.append({"surface": BOXES})
        return [
            {"integrator": integrator, "dt": dt, **surface}
            for surface in surfaces
            for integrator in ("implicitfast", "RK4")
            for dt in scene.dts
        ]

    def run(self, scene: Scene, params: Params) -> Trajectory:
        """Run in one call of rollout."""
        return (
            run_press(scene, params) if isinstance(scene, PressScene) else run_ball(scene, params)
        )


def option_of(scene: Scene, params: Params) -> str:
    """Return the element of the options."""
    gravity = (0, 0, 0) if params.get("gravity") == "off" else scene.gravity
    cone = params.get("cone", "elliptic")
    friction = f'cone="{cone}" impratio="{IMPRATIO if cone == "elliptic" else 1}"'
    flag = '<flag speculative="enable"/>' if params.get("speculative") else ""
    return (
        f'<option timestep="{params["dt"]}" integrator="{params["integrator"]}" solver="Newton" '
        f'tolerance="1e-10" gravity="{text(gravity)}" {friction}>{flag}</option>'
    )


def law_of(scene: Scene, mass: float, d: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return solref and solimp, for a moving mass of `mass` [kg] and an impedance d."""
    solref = -scene.stiffness * (1 - d) / mass, -scene.damping / mass
    return solref, (d, d, 1.0, 0.5, 1.0)


def pairs(scene: BallScene, params: Params, count: int) -> str:
    """Return the elements of the contacts between the ball and `count` geoms of the surface."""
    solref, solimp = law_of(
        scene, scene.mass, params.get("impedance", FIRM if scene.mu else SPRING)
    )
    law = f'solref="{text(solref)}" solimp="{text(solimp)}" margin="0"'
    if scene.mu:
        # What slips stops within two steps, the shortest that the documentation allows.
        stop = f'solreffriction="{2 * params["dt"]} 1"'
        law += f' condim="3" friction="{scene.mu} {scene.mu} 0 0 0" {stop}'
    else:
        law += ' condim="1"'
    return "".join(f'<pair geom1="surface{k}" geom2="ball" {law}/>' for k in range(count))


class Field:
    """A height field of square cells of about `cell` [m] over a surface."""

    def __init__(self, surface: Surface, cell: float, middle: tuple[float, float]) -> None:
        assert surface.height is not None
        self.count = 2 * math.ceil(surface.reach / cell) + 1
        line = np.linspace(-surface.reach, surface.reach, self.count)
        x, y = np.meshgrid(line + middle[0], line + middle[1])
        heights = surface.height(x, y)
        self.low, high = float(heights.min()), float(heights.max())
        self.top = max(high - self.low, 1e-3)
        self.shares = ((heights - self.low) / self.top).ravel()
        self.reach, self.middle = surface.reach, middle

    def asset(self) -> str:
        """Return the element of the asset; its heights are set in the compiled model."""
        size = text([self.reach, self.reach, self.top, BASE])
        return f'<hfield name="field" nrow="{self.count}" ncol="{self.count}" size="{size}"/>'

    def geom(self) -> str:
        """Return the element of the geom."""
        place = text([*self.middle, self.low])
        return f'<geom name="surface0" type="hfield" hfield="field" pos="{place}"/>'


def boxes(surface: Surface) -> str:
    """Return the surface as boxes."""
    geoms = []
    for k, box in enumerate(surface.boxes):
        axes = text([box.rotation[:, 0], box.rotation[:, 1]])
        geoms.append(
            f'<geom name="surface{k}" type="box" pos="{text(box.center)}" '
            f'size="{text(box.half)}" xyaxes="{axes}"/>'
        )
    return "".join(geoms)


def compiled(xml: str, field: Field | None) -> Any:
    """Return the compiled model."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(xml)
    if field is not None:
        model.hfield_data[:] = field.shares
    return model


def ball_model(scene: BallScene, params: Params) -> Any:
    """Return the compiled model of a ball on a surface."""
    field = None
    if params["surface"] == FIELD:
        field = Field(scene.surface, params["cell"], (0.0, 0.0))
    surface = field.geom() if field else boxes(scene.surface)
    count = 1 if field else len(scene.surface.boxes)
    if scene.table_speed:
        hinge = f'<joint type="hinge" axis="0 0 1" armature="{TABLE_INERTIA}"/>'
        surface = (
            f'<body>{hinge}<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{surface}</body>'
        )
    slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    inertia = text([scene.inertia] * 3)
    xml = f"""<mujoco>{option_of(scene, params)}
      <default><geom contype="0" conaffinity="0"/></default>
      <asset>{field.asset() if field else ""}</asset>
      <worldbody>
        <body name="ball">
          {"<freejoint/>" if scene.rolls else slides}
          <inertial pos="0 0 0" mass="{scene.mass}" diaginertia="{inertia}"/>
          <geom name="ball" type="sphere" size="{scene.radius}"/>
        </body>
        {surface}
      </worldbody>
      <contact>{pairs(scene, params, count)}</contact></mujoco>"""
    return compiled(xml, field)


def rolled_out(model: Any, data: Any, steps: int) -> tuple[Array, float]:
    """Return the states (steps, n) after each step, and the CPU time [s]."""
    import mujoco
    from mujoco import rollout

    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, start, kind)
    control = np.tile(data.ctrl, (1, 1, 1)) if model.nu else None
    states = np.empty((1, steps, len(start)))
    with CpuClock() as clock:
        rollout.rollout(model, data, start[None], control, nstep=steps, state=states)
    return np.concatenate([start[None], states[0]]), clock.spent


def run_ball(scene: BallScene, params: Params) -> Trajectory:
    """Run a ball."""
    import mujoco

    model = ball_model(scene, params)
    data = mujoco.MjData(model)
    q, v = np.array(scene.position), np.array(scene.velocity)
    if scene.rolls:
        q, v = np.r_[q, 1.0, 0.0, 0.0, 0.0], np.r_[v, scene.angular_velocity]
    data.qpos[: len(q)], data.qvel[: len(v)] = q, v
    if scene.table_speed:
        data.qvel[-1] = scene.table_speed
    steps = round(scene.duration / params["dt"])
    states, cpu = rolled_out(model, data, steps)
    states = states[:: max(1, round(scene.record_dt / params["dt"]))]
    qpos, qvel = states[:, 1 : 1 + model.nq], states[:, 1 + model.nq : 1 + model.nq + model.nv]
    spin = np.zeros((len(states), 3))
    if scene.rolls:
        for row, (turn, local) in enumerate(zip(qpos[:, 3:7], qvel[:, 3:6], strict=True)):
            mujoco.mju_rotVecQuat(spin[row], local, turn)
    forces = []
    if isinstance(scene, Plate | Groove):
        forces = [contact_forces(model, data, state) for state in states]
    return Trajectory(
        t=states[:, 0],
        position=qpos[:, :3],
        velocity=qvel[:, :3],
        angular_velocity=spin,
        cpu=cpu,
        simulated=steps * params["dt"],
        steps=steps,
        force=np.array([force.sum(axis=0) for force in forces]) if forces else None,
        contact_forces=forces[-1] if forces else None,
    )


def contact_forces(model: Any, data: Any, state: Array) -> Array:
    """Return the force of each contact on the ball or fingertip (k, 3) [N] at a state."""
    import mujoco

    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_forward(model, data)
    forces = np.zeros((data.ncon, 3))
    local = np.zeros(6)
    for k in range(data.ncon):
        mujoco.mj_contactForce(model, data, k, local)
        contact = data.contact[k]
        # Axes are the rows; the force is that of the first geom on the second.
        sign = 1.0 if model.geom_type[contact.geom2] == mujoco.mjtGeom.mjGEOM_SPHERE else -1.0
        forces[k] = sign * local[:3] @ contact.frame.reshape(3, 3)
    return forces


def press_model(scene: PressScene, params: Params) -> Any:
    """Return the compiled model of the Panda, its inertias and frames those of the URDF."""
    import mujoco

    spec = mujoco.MjSpec.from_string(scene.urdf)
    spec.compiler.fusestatic = True
    x, y, _ = scene.place
    field = Field(scene.surface, params["cell"], (x, y))
    joints = [joint.name for joint in spec.joints]
    for joint in joints:
        servo = spec.add_actuator(target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=scene.kp, kv=scene.kd)
    spec.add_hfield(
        name="field",
        nrow=field.count,
        ncol=field.count,
        size=[field.reach, field.reach, field.top, BASE],
        userdata=field.shares.tolist(),
    )
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="field", pos=[x, y, field.low]
    )
    for body in spec.bodies:
        body.gravcomp = 1.0 if params["gravity"] == "gravcomp" else 0.0
    tip = next(g for g in spec.geoms if g.type == mujoco.mjtGeom.mjGEOM_SPHERE)
    tip.name = FRAME
    option = mujoco.MjModel.from_xml_string(f"<mujoco>{option_of(scene, params)}</mujoco>").opt
    model = spec.compile()
    for name in ("timestep", "integrator", "solver", "tolerance", "gravity", "cone", "impratio"):
        setattr(model.opt, name, getattr(option, name))
    # The mass by which MuJoCo scales the law of the fingertip.
    mass = 1 / float(model.body_invweight0[-1, 0])
    model.geom_solref[:], model.geom_solimp[:] = law_of(scene, mass, params["impedance"])
    model.geom_friction[:] = scene.mu, 0.0, 0.0
    return model


def run_press(scene: PressScene, params: Params) -> Trajectory:
    """Run the Panda; the only row is the last."""
    import mujoco

    model = press_model(scene, params)
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = scene.q0, scene.q_ref
    states, cpu = rolled_out(model, data, scene.steps)
    force = contact_forces(model, data, states[-1]).sum(axis=0)
    return at_the_end(scene, data.qpos, data.qvel, cpu, scene.steps, force)
