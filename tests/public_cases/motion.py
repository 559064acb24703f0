"""Reports about motion: balls that follow seams, creep, sink, fall through."""

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots
from tests import meshes, models
from tests.public_cases import case
from tests.public_cases.shapes import terrain

GRAVITY = 9.81


def ramp(strips: int) -> tuple[float, float]:
    """Return the distance over that of the closed form, and how far the ball leaves its line [m].

    The lever of friction is the distance of center and contact point, r - d.
    """
    slope, radius, stiffness = np.radians(20), 0.1, 1e6
    along = np.array([np.cos(slope), 0.0, -np.sin(slope)])
    normal = np.array([np.sin(slope), 0.0, np.cos(slope)])
    vertices = [s * along + [0, y, 0] for s in np.linspace(-2, 2, strips + 1) for y in (-1, 1)]
    k = 2 * np.arange(strips)[:, None]
    elements = np.vstack((k + [0, 2, 3], k + [0, 3, 1]))
    scene = sp.Scene(models.ball(radius=radius))
    scene.add_contact(
        sp.Sphere(radius, frame="ball"),
        sp.Shell(vertices, elements),
        law=sp.HuntCrossleyLaw(stiffness, 1.5, 0.2),
        friction=sp.BristleFriction(0.6, 0.5, 1e5, 20.0),
        name="ball-ramp",
    )
    depth = (GRAVITY * np.cos(slope) / stiffness) ** (2 / 3)
    start = -1.5 * along + 0.3 * np.eye(3)[1] + (radius - depth) * normal
    result = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4)).run(
        models.free_q(start), duration=1.0, record_dt=0.01
    )
    places = result.q[:, :3]
    acceleration = GRAVITY * np.sin(slope) / (1 + 0.4 * (radius / (radius - depth)) ** 2)
    rolled = np.linalg.norm(places[-1] - places[0]) / (0.5 * acceleration * result.t[-1] ** 2)
    return float(rolled), float(max(np.ptp(places[:, 1]), np.ptp(places @ normal)))


@case(
    "dimforge/rapier#95",
    wanted="a ball rolls straight down a ramp of 6 triangles, and does not follow their seams",
    figure="distance sideways and off the plane [m]",
    truth=0.0,
    bound=1e-12,
)
def straight_down_a_ramp() -> float:
    return ramp(3)[1]


@case(
    "dimforge/rapier#95",
    wanted="the same ball, on 80 triangles, rolls as far as rigid rolling says",
    figure="distance over that of the closed form",
    truth=1.0,
    bound=5e-4,
)
def rolling_down_a_ramp() -> float:
    return ramp(40)[0]


@case(
    "jrouwe/JoltPhysics#717",
    "jrouwe/JoltPhysics#1155",
    "godot-jolt/godot-jolt#587",
    "raisimTech/raisimLib#161",
    wanted="a ball rolls at 5 m/s over the seam of two touching cubes of one mesh without a bump",
    figure="range of its height [m]",
    truth=0.0,
    bound=1e-12,
)
def over_the_seam_of_two_cubes() -> float:
    corners, triangles = meshes.cube(2.0)
    shell = sp.Shell(
        np.vstack((corners - [0, 0, 1], corners + [2, 0, -1])),
        np.vstack((triangles, triangles + len(corners))),
    )
    scene = sp.Scene(models.ball(radius=0.1))
    scene.add_contact(
        sp.Sphere(0.1, frame="ball"),
        shell,
        law=sp.HuntCrossleyLaw(1e5, 1.5, 0.3),
        friction=sp.CoulombFriction(0.3, 0.3, 0.01, 0.02),
        name="ball-cubes",
    )
    depth = (GRAVITY / 1e5) ** (2 / 3)
    result = sp.Simulation(scene, sp.SemiImplicitEuler(5e-5)).run(
        models.free_q([0, 0, 0.1 - depth]), v0=[5, 0, 0, 0, 50, 0], duration=0.5, record_dt=1e-3
    )
    return float(np.ptp(result.q[:, 2]))


@case(
    "jrouwe/JoltPhysics#1286",
    "erincatto/box2d#167",
    "bulletphysics/bullet3#1530",
    wanted="a ball with restitution 1 keeps its height",
    figure="height of the last top over the first drop, after 19 bounces",
    truth=1.0,
    bound=1e-5,
)
def restitution_one_keeps_the_height() -> float:
    height = 1.0
    scene = sp.Scene(models.ball(radius=0.1))
    plate = sp.Shell([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2, 3]])
    law = sp.HuntCrossleyLaw(1e6, 1.5, 0.0)
    scene.add_contact(sp.Sphere(0.1, frame="ball"), plate, law=law, name="ball-plate")
    result = sp.Simulation(scene, sp.Adaptive(1e-8)).run(
        models.free_q([0, 0, 0.1 + height]),
        duration=40 * np.sqrt(2 * height / GRAVITY),
        record_dt=2e-3,
    )
    # A row may miss the top: height and speed give it.
    energy = result.q[:, 2] - 0.1 + result.v[:, 2] ** 2 / (2 * GRAVITY)
    return float(energy[result.q[:, 2] > 0.1 + 0.3 * height][-1] / height)


@case(
    "keenon/nimblephysics#46",
    wanted="balls at up to 60 m/s do not fall through an open mesh of hills at a step of 1 ms",
    figure="balls of 12 that fell through",
    truth=0,
    bound=0,
)
def onto_open_hills() -> float:
    shell = terrain(60, 2.0, lambda x, y: 0.3 * np.sin(4 * x) * np.sin(3 * y))
    scene = sp.Scene(models.ball(mass=0.1))
    scene.add_contact(
        sp.Sphere(0.05, frame="ball"),
        shell,
        law=sp.HuntCrossleyLaw(5e4, 1.5, 0.3),
        friction=sp.CoulombFriction(0.5, 0.4, 0.01, 0.02),
        name="ball-hills",
    )
    sim, rng, fell = sp.Simulation(scene, sp.SemiImplicitEuler(1e-3)), np.random.default_rng(1), 0
    for _ in range(12):
        start = models.free_q([*rng.uniform(-0.7, 0.7, 2), 1.5])
        falling = [0, 0, -rng.uniform(0, 60), 0, 0, 0]
        x, y, z = sim.run(start, v0=falling, duration=1.0, record_dt=0.01).q[:, :3].T
        above = z > 0.3 * np.sin(4 * x) * np.sin(3 * y)
        fell += not above[(np.abs(x) < 1.9) & (np.abs(y) < 1.9)].all()
    return fell


@case(
    "google-deepmind/mujoco#3328",
    wanted="a rod of 45 g that two pads pinch with 12 N does not creep out of them",
    figure="speed at which it sinks, after 1 s [m/s]",
    truth=0.0,
    bound=1e-12,
)
def pinched_rod() -> float:
    model, radius, force = models.empty(), 0.004, 12.0
    for name in ("left", "right"):
        pad = pin.Inertia.FromSphere(0.05, 0.01)
        models.add_body(model, name, pin.JointModelPX(), inertia=pad)
    across, along = 0.045 * 0.03**2 / 3, 0.5 * 0.045 * radius**2
    inertia = pin.Inertia(0.045, np.zeros(3), np.diag([across, along, across]))
    models.add_body(model, "held", pin.JointModelFreeFlyer(), inertia=inertia)
    turn = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    vertices = [
        [radius * np.cos(a), y, radius * np.sin(a)]
        for y in np.linspace(-0.03, 0.03, 13)
        for a in turn
    ]
    k, row = np.arange(48), 48 * np.arange(12)[:, None]
    following = (k + 1) % 48
    corners = (row + k, row + following, row + 48 + following, row + 48 + k)
    rod = sp.Shell(vertices, np.stack(corners, axis=-1).reshape(-1, 4))
    scene, law = sp.Scene(model), sp.HuntCrossleyLaw(1e8, 1.5, 0.5)
    friction = sp.BristleFriction(0.7, 0.7, 2e5, 30.0, torsional=True)
    for name in ("left", "right"):
        pad = sp.Sphere(0.01, frame=name)
        scene.add_contact(pad, rod, frame="held", law=law, friction=friction, name=name)
    x = 0.01 + radius - (force / 1e8) ** (2 / 3)
    result = sp.Simulation(scene, sp.SemiImplicitEuler(2e-5)).run(
        np.array([-x, x, 0, 0, 0, 0, 0, 0, 1.0]),
        duration=2.0,
        controller=lambda _t, _q, v, _c: np.array(
            [force - 2 * v[0], -force - 2 * v[1], *np.zeros(6)]
        ),
        control_dt=1e-3,
        record_dt=0.01,
    )
    late = result.t > 1.0
    return float(abs(np.polyfit(result.t[late], result.q[late, 4], 1)[0]))


@case(
    "raisimTech/raisimLib#322",
    wanted="the force does not chatter while a finger presses hard on a wall",
    figure="range of the normal force over its mean, after 1 s",
    truth=0.0,
    bound=1e-9,
)
def pressing_hard_on_a_wall() -> float:
    finger = robots.load_file(robots.URDF_FOLDER / "three_link_finger.urdf")
    wall = sp.Shell(
        [[0.07, -0.1, 0], [0.07, 0.1, 0], [0.07, 0.1, 0.2], [0.07, -0.1, 0.2]], [range(4)]
    )
    scene = sp.Scene(finger.model)
    scene.add_contact(
        sp.Sphere(0.01, frame="tip"),
        wall,
        law=sp.ImpactLaw(1e6, 1.5, 20.0, 1e-4),
        friction=sp.BristleFriction(0.5, 0.4, 1e5, 20.0),
        name="tip-wall",
    )
    start = np.array([0.2, 0.6, 0.4])
    press = sp.JointPD(kp=20.0, kd=0.02, q_ref=start + 0.4)
    result = sp.Simulation(scene, sp.SemiImplicitEuler(2e-5)).run(
        start, duration=2.0, controller=press, record_dt=1e-3
    )
    log = result.contacts
    force = log.normal_force[result.t[log.row] > 1.0]
    return float(np.ptp(force) / force.mean())


def plate_scene(model: pin.Model, friction: object, law: object = None) -> sp.Scene:
    """Return a scene of a ball of 0.1 m over a level square of 2 x 16 x 16 triangles."""
    shell = sp.Shell(*meshes.grid_plate(16, 16, 8.0))
    scene = sp.Scene(model)
    law = sp.HuntCrossleyLaw(1e6, 1.5, 0.5) if law is None else law
    sphere = sp.Sphere(0.1, frame="ball")
    scene.add_contact(sphere, shell, law=law, friction=friction, name="ball-plate")
    return scene


@case(
    "google-deepmind/mujoco#1823",
    "newton-physics/newton#2107",
    wanted="the contact forces on a ball at rest on a mesh are its weight",
    figure="normal force over weight, on a vertex of six triangles",
    truth=1.0,
    bound=1e-9,
)
def weight_of_a_ball_at_rest() -> float:
    depth = (GRAVITY / 1e6) ** (2 / 3)
    sim = sp.Simulation(plate_scene(models.ball(radius=0.1), None), sp.SemiImplicitEuler(1e-4))
    log = sim.run(models.free_q([0, 0, 0.1 - depth]), duration=0.5, record_dt=1e-2).contacts
    return float(log.normal_force[log.row == log.row[-1]].sum() / GRAVITY)


def rolled(spin: float) -> tuple[np.ndarray, np.ndarray]:
    """Return velocity and spin in the world of a ball that slid at first, spinning about z."""
    depth = (GRAVITY / 1e6) ** (2 / 3)
    scene = plate_scene(models.ball(radius=0.1), sp.CoulombFriction(0.2, 0.2, 1e-3, 2e-3))
    result = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4)).run(
        models.free_q([-1.5, 0.2, 0.1 - depth]), [2.0, 0, 0, 0, 0, spin], 0.6, record_dt=0.01
    )
    rotation = pin.Quaternion(result.q[-1, 3:]).toRotationMatrix()
    return rotation @ result.v[-1, :3], rotation @ result.v[-1, 3:]


@case(
    "ekiefl/pooltool#39",
    wanted="a ball that slides at first rolls on at 5/7 of its speed",
    figure="speed over the first one; the lever of friction is radius - depth",
    truth=5 / 7,
    bound=2e-4,
)
def sliding_then_rolling() -> float:
    velocity, _ = rolled(0.0)
    lever = 1.0 - (GRAVITY / 1e6) ** (2 / 3) / 0.1
    return float(velocity[0] / 2.0 * (1 + 0.4 / lever**2) / 1.4)


@case(
    "Xiexe/VRCBilliards#8",
    wanted="a ball keeps its spin about the vertical when it begins to roll",
    figure="spin over the first one",
    truth=1.0,
    bound=1e-9,
)
def spin_while_rolling() -> float:
    return float(rolled(5.0)[1][2] / 5.0)


@case(
    "schteppe/cannon.js#328",
    wanted="a ball that hits the seam of two triangles is reflected as by a plane",
    figure="tangent of the angle it leaves at, having come at 45 degrees",
    truth=1.0,
    bound=1e-6,
)
def reflected_at_a_seam() -> float:
    model = models.ball(gravity=0.0, radius=0.1)
    scene = plate_scene(model, None, sp.HuntCrossleyLaw(1e7, 1.5, 0.0))
    result = sp.Simulation(scene, sp.Adaptive(1e-9)).run(
        models.free_q([-0.2, 0.01, 0.3]), v0=[3.0, 0, -3.0, 0, 0, 0], duration=0.2, record_dt=0.01
    )
    return float(result.v[-1, 2] / np.hypot(*result.v[-1, :2]))


@case(
    "liabru/matter-js#752",
    "newton-physics/newton#3943",
    wanted="what friction can hold on a slope of 20 degrees stays where it is",
    figure="speed downhill, after 3 s [m/s]",
    truth=0.0,
    bound=1e-12,
)
def held_on_a_slope() -> float:
    slope = np.radians(20)
    model = models.ball(radius=0.1, joint=pin.JointModelTranslation())
    model.gravity.linear = GRAVITY * np.array([np.sin(slope), 0.0, -np.cos(slope)])
    scene = plate_scene(model, sp.BristleFriction(0.5, 0.4, 1e5, 20.0))
    result = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4)).run(
        np.array([0.0, 0.0, 0.1]), duration=4.0, record_dt=0.01
    )
    late = result.t > 3.0
    return float(abs(np.polyfit(result.t[late], result.q[late, 0], 1)[0]))
