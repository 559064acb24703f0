"""The checks of one robot, each by the functions that `sphshell_pin.testing` asserts with."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Adaptive, Result, Scene, SemiImplicitEuler, Simulation
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.errors import SimulationDiverged, SphshellError
from sphshell_pin.study.robot_check.setting import (
    PLATE,
    Setting,
    Touch,
    meeting_posture,
    random_torques,
    stopping_law,
    touch_of,
)
from sphshell_pin.testing.conservation import elastic_energy, energy, kinetic_energy, momentum
from sphshell_pin.testing.differences import derivatives
from sphshell_pin.testing.finding import Finding, worst
from sphshell_pin.testing.forces import balance, reaction
from sphshell_pin.testing.found import contacts_of_scene, passage

# Speed of the sphere in radii per second, and depth in radii where it touches.
SPEED, _DEPTH = 25.0, 0.1
_RTOL = 1e-9
# Duration of a run [s]: to come, to touch (three times depth / speed, as the law is made) and to
# leave.
_DURATION = 1.2 * (0.05 + 3.0 * 0.2) / SPEED

_IMPACTS = 8


@dataclass(frozen=True)
class Check:
    """One thing that is checked: what it compares, and what is allowed."""

    compares: str
    tolerance: float


CHECKS: dict[str, Check] = {
    "forces": Check(
        "accelerations of ABA with `Scene.external_forces` against M^-1 (tau - nle + J^T f), with "
        "the forces f of `Scene.contacts` and the Jacobians J of their points by Pinocchio; "
        "relative to what the contacts add",
        1e-8,
    ),
    "reaction": Check(
        "sum of the wrenches on all bodies, robot and shell free to move; relative to the largest",
        1e-12,
    ),
    "momentum": Check(
        f"change of linear and angular momentum in a run of the same closed system, "
        f"`Adaptive({_RTOL:g})`; relative to the contact's impulse",
        1e-8,
    ),
    "energy": Check(
        f"energy that is not accounted for in two runs under gravity, `Adaptive({_RTOL:g})`: one "
        "with damping and friction, by the run's audit, one without, by closed forms; relative to "
        "what changes form",
        1e-6,
    ),
    "derivatives": Check(
        "analytic derivatives of contact forces by q and v, and of accelerations by q, v, torques "
        "and every number of law, friction, sphere and placement, against central differences on "
        'the tangent space, methods "smooth" and "facets", touching and not; relative to the '
        "largest entry of the column",
        1e-6,
    ),
    "contacts": Check(
        'method "facets" against the distances of all triangles: contact or none, depth, place, '
        "deep, barely touching, near and far; in radii",
        1e-9,
    ),
    "fast": Check(
        "a sphere that crosses the shell by two radii within one step, were it not stopped: "
        "how often its center passes through (`Adaptive`, and `SemiImplicitEuler` with that step)",
        0.0,
    ),
}


@dataclass(frozen=True)
class Sizes:
    """How much is checked: random `postures` for states, for `runs`, and `poses` of the patch."""

    postures: int = 4
    runs: int = 2
    poses: int = 40


QUICK = Sizes(1, 1, 12)


def run_checks(
    setting: Setting, rng: np.random.Generator, sizes: Sizes, progress: Callable[[str], object]
) -> dict[str, Finding]:
    """Return the worst finding of each check by its key in CHECKS.

    A check that ends in a fault of this package counts as failed, with the fault's sentence;
    `progress` is called with the key of each check before it starts.
    """
    speed = SPEED * setting.radius
    touches: list[tuple[Touch, Array]] = []
    for _ in range(sizes.postures):
        for free in (False, True):
            touch = touch_of(setting, rng, -_DEPTH, speed, free=free)
            touches.append((touch, random_torques(touch.scene.model, touch.q, rng)))

    def runs(measure: Callable[[Setting, np.random.Generator], list[Finding]]) -> list[Finding]:
        return [one for _ in range(sizes.runs) for one in measure(setting, rng)]

    ways: dict[str, Callable[[], list[Finding]]] = {
        "forces": lambda: [balance(t.scene, t.q, t.v, tau) for t, tau in touches],
        "reaction": lambda: [reaction(t.scene, t.q, t.v) for t, _ in touches[1::2]],
        "momentum": lambda: runs(_momentum),
        "energy": lambda: runs(_energies),
        "derivatives": lambda: [
            derivatives(scene, t.q, t.v, tau) for t, tau in touches for scene in _variants(t.scene)
        ],
        "contacts": lambda: _contacts(setting, rng, sizes.poses),
        "fast": lambda: runs(_fast),
    }
    found = {}
    for key in CHECKS:
        progress(key)
        try:
            found[key] = worst(ways[key](), "nothing was tried")
        except KeyboardInterrupt:
            raise
        except SphshellError as error:
            found[key] = Finding(math.inf, str(error))
    return found


def _variants(scene: Scene) -> list[Scene]:
    """Return a scene that touches, the same with method "facets", and out of touch."""
    (pair,) = scene.pairs
    (on_shell,) = pair.shells
    flat = replace(pair, side_j=replace(on_shell, method="facets"))
    # The patch goes behind itself.
    away = pin.SE3(np.eye(3), np.array([0.0, 0.0, -10.0 * pair.least_radius]))
    far = replace(pair, side_j=replace(on_shell, placement=on_shell.placement * away))
    return [scene, scene.with_pairs((flat,)), scene.with_pairs((far,))]


def _momentum(setting: Setting, rng: np.random.Generator) -> list[Finding]:
    touch = touch_of(setting, rng, 0.05, SPEED * setting.radius, free=True)
    return [momentum(_run(touch, Adaptive(_RTOL), _DURATION))]


def _energies(setting: Setting, rng: np.random.Generator) -> list[Finding]:
    touch = touch_of(setting, rng, 0.05, SPEED * setting.radius)
    pair = touch.scene.pairs[0]
    lossless = Scene(touch.scene.model)
    law = stopping_law(touch.mass, touch.speed, 0.2 * setting.radius)
    lossless.add_contact(setting.sphere, setting.shell, pair.frame_j, pair.shells[0].placement, law)
    results = [
        _run(replace(touch, scene=scene), Adaptive(_RTOL), _DURATION)
        for scene in (touch.scene, lossless)
    ]
    if not all(len(result.contacts) for result in results):
        return [Finding(math.inf, "the sphere never met the shell: the runs say nothing")]
    return [energy(results[0]), elastic_energy(results[1])]


def _fast(setting: Setting, rng: np.random.Generator) -> list[Finding]:
    """Let the sphere hit the patch: without contact a step would end two radii behind it."""
    for _ in range(_IMPACTS):
        try:
            results = _impact(setting, rng)
        except SimulationDiverged:
            # Euler's method with so long a step: light joints spun up by those that were stopped.
            continue
        findings = [passage(result) for result in results]
        met = all(any(event.kind == "touch" for event in result.events) for result in results)
        # A limb may turn away before it meets the patch: that impact test says nothing.
        if met or any(finding.error > 0.0 for finding in findings):
            return findings
    return [Finding(math.inf, f"none of {_IMPACTS} impact tests met the shell")]


def _impact(setting: Setting, rng: np.random.Generator) -> list[Result]:
    """Return an impact test by each of two integrators."""
    radius, step, gap = setting.radius, 1e-2, 2.0
    # From gap + 1 radii before the surface to 2 behind it, for the center.
    speed = (gap + 3.0) * radius / step
    touch = touch_of(setting, rng, gap, speed, least=True)
    pair = touch.scene.pairs[0]
    scene = Scene(touch.scene.model)
    # Whatever the joints do, the law can take up all the energy they have.
    heavy = 2.0 * kinetic_energy(scene.model, touch.q, touch.v) / speed**2
    law = stopping_law(heavy, speed, 0.3 * radius)
    scene.add_contact(setting.sphere, setting.shell, pair.frame_j, pair.shells[0].placement, law)
    start = replace(touch, scene=scene)
    return [_run(start, how, step) for how in (Adaptive(), SemiImplicitEuler(step))]


def _contacts(setting: Setting, rng: np.random.Generator, poses: int) -> list[Finding]:
    """Ask the scene for contacts at many postures, the patch deep in the sphere to far from it."""
    touch = touch_of(setting, rng, 0.0, SPEED * setting.radius, free=True)
    scene = Scene(touch.scene.model)
    law = touch.scene.pairs[0].law
    scene.add_contact(setting.sphere, setting.shell, PLATE, law=law, method="facets")
    model, data = scene.model, scene.model.createData()
    kinds = ((-0.9, 0.0), (-1e-6, 1e-6), (0.0, 1.0), (5.0, 50.0))
    findings = []
    for k in range(poses):
        q = meeting_posture(model, data, setting, rng, rng.uniform(*kinds[k % len(kinds)]))
        findings.append(contacts_of_scene(scene, q, data))
    return findings


def _run(touch: Touch, integrator: Integrator, duration: float) -> Result:
    with warnings.catch_warnings(action="ignore"):
        return Simulation(touch.scene, integrator).run(touch.q, touch.v, duration)
