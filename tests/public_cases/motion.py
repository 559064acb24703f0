"""Reports about motion: balls that follow seams, creep, sink, fall through."""

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots
from tests import meshes, models
from tests.public_cases import case
from tests.public_cases.shapes import terrain

GRAVITY = 9.81
HARD, ELASTIC = sp.HuntCrossleyLaw(1e6, 1.5, 0.5), sp.HuntCrossleyLaw(1e6, 1.5, 0.0)
DEPTH = HARD.depth_at(GRAVITY)  # of a ball of 1 kg at rest
SQUARE = sp.Shell(*meshes.grid_plate(16, 16, 8.0))
EULER = sp.SemiImplicitEuler(1e-4)


def plate_scene(model: pin.Model, friction: object, law: object = None) -> sp.Scene:
    """Return a scene of a ball of 0.1 m over a level square of 2 x 16 x 16 triangles."""
    return models.on_shell(model, SQUARE, law or HARD, friction, radius=0.1)


def late_speed(result: sp.Result, begin: float, k: int) -> float:
    """Return the size of the mean rate of q[k] after `begin` [s]."""
    late = result.t > begin
    return float(abs(np.polyfit(result.t[late], result.q[late, k], 1)[0]))


def ramp(strips: int) -> tuple[float, float]:
    """Return the distance over that of the closed form, and how far the ball leaves its line [m].

    The lever of friction is the distance of center and contact point, r - d.
    """
    slope, radius = np.radians(20), 0.1
    along = np.array([np.cos(slope), 0.0, -np.sin(slope)])
    normal = np.array([np.sin(slope), 0.0, np.cos(slope)])
    vertices = [s * along + [0, y, 0] for s in np.linspace(-2, 2, strips + 1) for y in (-1, 1)]
    k = 2 * np.arange(strips)[:, None]
    elements = np.vstack((k + [0, 2, 3], k + [0, 3, 1]))
    law, friction = sp.HuntCrossleyLaw(1e6, 1.5, 0.2), sp.BristleFriction(0.6, 0.5, 1e5, 20.0)
    scene = models.on_shell(
        models.ball(radius=radius), sp.Shell(vertices, elements), law, friction, radius=radius
    )
    depth = law.depth_at(GRAVITY * np.cos(slope))
    start = -1.5 * along + 0.3 * np.eye(3)[1] + (radius - depth) * normal
    result = models.run(scene, EULER, models.free_q(start), duration=1.0, record_dt=0.01)
    places = result.q[:, :3]
    acceleration = GRAVITY * np.sin(slope) / (1 + 0.4 * (radius / (radius - depth)) ** 2)
    rolled = np.linalg.norm(places[-1] - places[0]) / (0.5 * acceleration * result.t[-1] ** 2)
    return float(rolled), float(max(np.ptp(places[:, 1]), np.ptp(places @ normal)))


@case
def straight_down_a_ramp() -> float:
    return ramp(3)[1]


@case
def rolling_down_a_ramp() -> float:
    return ramp(40)[0]


@case
def over_the_seam_of_two_cubes() -> float:
    corners, triangles = meshes.cube(2.0)
    both = np.vstack((corners - [0, 0, 1], corners + [2, 0, -1]))
    shell = sp.Shell(both, np.vstack((triangles, triangles + len(corners))))
    law, friction = sp.HuntCrossleyLaw(1e5, 1.5, 0.3), sp.CoulombFriction(0.3, 0.3, 0.01, 0.02)
    scene = models.on_shell(models.ball(radius=0.1), shell, law, friction, radius=0.1)
    start = models.free_q([0, 0, 0.1 - law.depth_at(GRAVITY)]), [5, 0, 0, 0, 50, 0]
    result = models.run(scene, sp.SemiImplicitEuler(5e-5), *start, duration=0.5, record_dt=1e-3)
    return float(np.ptp(result.q[:, 2]))


@case
def restitution_one_keeps_the_height() -> float:
    height = 1.0
    plate = sp.Shell(*meshes.grid_plate(size=18.0, quads=True))
    scene = models.on_shell(models.ball(radius=0.1), plate, ELASTIC, radius=0.1)
    start, duration = models.free_q([0, 0, 0.1 + height]), 40 * np.sqrt(2 * height / GRAVITY)
    result = models.run(scene, sp.Adaptive(1e-8), start, duration=duration, record_dt=2e-3)
    # A row may miss the top: height and speed give it.
    energy = result.q[:, 2] - 0.1 + result.v[:, 2] ** 2 / (2 * GRAVITY)
    return float(energy[result.q[:, 2] > 0.1 + 0.3 * height][-1] / height)


@case
def onto_open_hills() -> float:
    shell = terrain(60, 2.0, lambda x, y: 0.3 * np.sin(4 * x) * np.sin(3 * y))
    law, friction = sp.HuntCrossleyLaw(5e4, 1.5, 0.3), sp.CoulombFriction(0.5, 0.4, 0.01, 0.02)
    scene = models.on_shell(models.ball(mass=0.1), shell, law, friction)
    sim, rng, fell = sp.Simulation(scene, sp.SemiImplicitEuler(1e-3)), np.random.default_rng(1), 0
    for _ in range(12):
        start = models.free_q([*rng.uniform(-0.7, 0.7, 2), 1.5])
        falling = [0, 0, -rng.uniform(0, 60), 0, 0, 0]
        x, y, z = sim.run(start, v0=falling, duration=1.0, record_dt=0.01).q[:, :3].T
        above = z > 0.3 * np.sin(4 * x) * np.sin(3 * y)
        fell += not above[(np.abs(x) < 1.9) & (np.abs(y) < 1.9)].all()
    return fell


@case
def pinched_rod() -> float:
    model, radius, force = models.empty(), 0.004, 12.0
    for name in ("left", "right"):
        pad = pin.Inertia.FromSphere(0.05, 0.01)
        models.add_body(model, name, pin.JointModelPX(), inertia=pad)
    across, along = 0.045 * 0.03**2 / 3, 0.5 * 0.045 * radius**2
    inertia = pin.Inertia(0.045, np.zeros(3), np.diag([across, along, across]))
    models.add_body(model, "held", pin.JointModelFreeFlyer(), inertia=inertia)
    vertices, elements = meshes.revolved([(radius, y) for y in np.linspace(-0.03, 0.03, 13)], 48)
    rod = sp.Shell(vertices[:, [1, 2, 0]], elements)
    scene, law = sp.Scene(model), sp.HuntCrossleyLaw(1e8, 1.5, 0.5)
    friction = sp.BristleFriction(0.7, 0.7, 2e5, 30.0, torsional=True)
    for name in ("left", "right"):
        pad = sp.Sphere(0.01, frame=name)
        scene.add_contact(pad, rod, frame="held", law=law, friction=friction, name=name)
    x = 0.01 + radius - law.depth_at(force)

    def squeeze(_t, _q, v, _contacts):
        return np.array([force - 2 * v[0], -force - 2 * v[1], *np.zeros(6)])

    more = {"controller": squeeze, "control_dt": 1e-3, "record_dt": 0.01}
    start = np.array([-x, x, 0, 0, 0, 0, 0, 0, 1.0])
    result = models.run(scene, sp.SemiImplicitEuler(2e-5), start, duration=2.0, **more)
    return late_speed(result, 1.0, 4)


@case
def pressing_hard_on_a_wall() -> float:
    finger = robots.load_file(robots.URDF_FOLDER / "three_link_finger.urdf")
    corners = [[0.07, -0.1, 0], [0.07, 0.1, 0], [0.07, 0.1, 0.2], [0.07, -0.1, 0.2]]
    scene, wall = sp.Scene(finger.model), sp.Shell(corners, [range(4)])
    laws = sp.ImpactLaw(1e6, 1.5, 20.0, 1e-4), sp.BristleFriction(0.5, 0.4, 1e5, 20.0)
    scene.add_contact(sp.Sphere(0.01, frame="tip"), wall, "universe", None, *laws)
    start = np.array([0.2, 0.6, 0.4])
    press = sp.JointPD(kp=20.0, kd=0.02, q_ref=start + 0.4)
    more = {"controller": press, "record_dt": 1e-3}
    result = models.run(scene, sp.SemiImplicitEuler(2e-5), start, duration=2.0, **more)
    log = result.contacts
    force = log.normal_force[result.t[log.row] > 1.0]
    return float(np.ptp(force) / force.mean())


@case
def weight_of_a_ball_at_rest() -> float:
    scene, start = plate_scene(models.ball(radius=0.1), None), models.free_q([0, 0, 0.1 - DEPTH])
    log = models.run(scene, EULER, start, duration=0.5, record_dt=1e-2).contacts
    return float(log.normal_force[log.row == log.row[-1]].sum() / GRAVITY)


def rolled(spin: float) -> tuple[np.ndarray, np.ndarray]:
    """Return velocity and spin in the world of a ball that slid at first, spinning about z."""
    scene = plate_scene(models.ball(radius=0.1), sp.CoulombFriction(0.2, 0.2, 1e-3, 2e-3))
    start = models.free_q([-1.5, 0.2, 0.1 - DEPTH]), [2.0, 0, 0, 0, 0, spin]
    result = models.run(scene, EULER, *start, duration=0.6, record_dt=0.01)
    rotation = pin.Quaternion(result.q[-1, 3:]).toRotationMatrix()
    return rotation @ result.v[-1, :3], rotation @ result.v[-1, 3:]


@case
def sliding_then_rolling() -> float:
    velocity, _ = rolled(0.0)
    lever = 1.0 - DEPTH / 0.1
    return float(velocity[0] / 2.0 * (1 + 0.4 / lever**2) / 1.4)


@case
def spin_while_rolling() -> float:
    return float(rolled(5.0)[1][2] / 5.0)


@case
def reflected_at_a_seam() -> float:
    model = models.ball(gravity=0.0, radius=0.1)
    scene = plate_scene(model, None, sp.HuntCrossleyLaw(1e7, 1.5, 0.0))
    start = models.free_q([-0.2, 0.01, 0.3]), [3.0, 0, -3.0, 0, 0, 0]
    result = models.run(scene, sp.Adaptive(1e-9), *start, duration=0.2, record_dt=0.01)
    return float(result.v[-1, 2] / np.hypot(*result.v[-1, :2]))


@case
def held_on_a_slope() -> float:
    slope = np.radians(20)
    model = models.block(radius=0.1, tilt=slope)
    scene = plate_scene(model, sp.BristleFriction(0.5, 0.4, 1e5, 20.0))
    result = models.run(scene, EULER, np.array([0.0, 0.0, 0.1]), duration=4.0, record_dt=0.01)
    return late_speed(result, 3.0, 0)
