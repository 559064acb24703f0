"""Eight scenes as plain numbers, one of them with two meshes; truths.py judges them."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

from benchmarks.peers import shapes
from benchmarks.peers.press import PressScene, press
from benchmarks.peers.truths import (
    GRAVITY,
    MASS,
    ORBIT,
    RADIUS,
    STIFFNESS,
    BallScene,
    Bowl,
    Cylinder,
    Groove,
    Impact,
    Plate,
    Slope,
    Turntable,
)
from sphshell_pin.study.report import swing


@cache
def plate() -> Plate:
    spot, depth = (0.00123, -0.00087), MASS * GRAVITY / STIFFNESS
    return Plate(
        name="plate",
        title="Ball pressed by its weight into a flat plate of fine triangles",
        surface=shapes.plate(0.01, 3e-4),
        duration=0.3,
        dts=(1e-3, 1e-4),
        position=(*spot, RADIUS - 0.5 * depth),
        damping=30.0,
        mu=0.0,
        rolls=False,
    )


@cache
def bowl(side: float) -> Bowl:
    """`side` of the triangles in radii of the ball: 0.3 or 0.15."""
    return Bowl(
        name="bowl" if side == 0.3 else "bowl fine",
        title=f"Ball swings in a bowl without friction, triangles of {side:g} radii",
        surface=shapes.bowl(side),
        duration=(swing.PERIODS + 0.35) * swing.PERIOD,
        dts=(2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5),
        position=tuple(swing.start(0.0).tolist()),
        damping=0.0,
        mu=0.0,
        rolls=False,
    )


@cache
def cylinder() -> Cylinder:
    bore = swing.BOWL
    # k depth = m rate^2 (R - r + depth)
    depth = ORBIT**2 * (bore - RADIUS) / (STIFFNESS / MASS - ORBIT**2)
    orbit = bore - RADIUS + depth
    scene = Cylinder(
        name="cylinder",
        title="Ball rolls inside a vertical cylinder",
        surface=shapes.cylinder(bore, -0.045, 0.015, 3e-3),
        duration=0.6,
        position=(orbit, 0.0, 0.0),
        velocity=(0.0, ORBIT * orbit, 0.0),
        angular_velocity=(0.0, 0.0, -ORBIT * orbit / (RADIUS - depth)),
        depth=depth,
    )
    return replace(scene, duration=2 * 2 * math.pi / scene.rate)


@cache
def turntable() -> Turntable:
    speed, start, velocity = 20.0, 0.1, 0.1
    depth = MASS * GRAVITY / STIFFNESS
    # The slip against the table is along y: the ball must turn about x.
    slip = velocity - speed * start
    scene = Turntable(
        name="turntable",
        title="Ball rolls on a turning table",
        surface=shapes.plate(0.2, 5e-3),
        duration=1.0,
        record_dt=2e-3,
        position=(start, 0.0, RADIUS - depth),
        velocity=(0.0, velocity, 0.0),
        angular_velocity=(-slip / (RADIUS - depth), 0.0, 0.0),
        table_speed=speed,
    )
    b = scene.b(depth)
    return replace(scene, duration=2 * math.pi / (b / (1 + b) * speed))


@cache
def groove() -> Groove:
    opening = math.pi / 4
    depth = MASS * GRAVITY / (2 * math.sin(opening)) / STIFFNESS
    return Groove(
        name="groove",
        title="Ball lies in a V-groove: two contacts",
        surface=shapes.groove(opening, 0.02, 1e-3),
        duration=0.3,
        dts=(1e-3, 1e-4),
        position=(0.0, 0.00037, (RADIUS - 0.5 * depth) / math.sin(opening)),
        damping=30.0,
        mu=0.0,
        rolls=False,
        opening=opening,
    )


@cache
def slope() -> Slope:
    tilt = math.radians(20)
    gravity = (GRAVITY * math.sin(tilt), 0.0, -GRAVITY * math.cos(tilt))
    return Slope(
        name="slope",
        title="On a slope of 20 degrees: a ball rolls, a body that cannot turn stays",
        surface=shapes.plate(0.08, 2e-3),
        duration=0.2,
        position=(-0.04, 0.0003, RADIUS + MASS * gravity[2] / STIFFNESS),
        gravity=gravity,
    )


@cache
def impact() -> Impact:
    radius, mass, speed = 0.005, 0.004, 100.0
    return Impact(
        name="impact",
        title="Ball of 5 mm hits a thin sheet at 100 m/s",
        surface=shapes.plate(0.05, 2e-3, thickness=1e-3),
        duration=4e-3,
        record_dt=4e-3,
        dts=(1e-3, 1e-4, 1e-5, 1e-6),
        position=(0.0007, 0.0004, 0.02),
        velocity=(0.0, 0.0, -speed),
        radius=radius,
        mass=mass,
        stiffness=mass * (speed / (0.3 * radius)) ** 2,  # stops it within 0.3 r
        damping=0.0,
        mu=0.0,
        rolls=False,
        gravity=(0.0, 0.0, 0.0),
    )


Scene = BallScene | PressScene
SCENES: dict[str, Callable[[], Scene]] = {
    "plate": plate,
    "bowl": partial(bowl, 0.3),
    "bowl fine": partial(bowl, 0.15),
    "cylinder": cylinder,
    "turntable": turntable,
    "groove": groove,
    "slope": slope,
    "impact": impact,
    "press": press,
}
