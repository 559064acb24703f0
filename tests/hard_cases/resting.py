"""Balls that rest on several places.

In a groove, in a cone that it touches along a ring, on eight spikes.
"""

import math
from typing import Any

import numpy as np

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.normal_law import bisect
from tests import meshes, models
from tests.hard_cases.verdict import Verdicts, at_most, case, compare

RADIUS, MASS, GRAVITY = 0.02, 0.3, 9.81
WEIGHT = MASS * GRAVITY


def rest(model, shell, law, q, integrator, duration, method="smooth"):
    """Let the ball settle on `shell`."""
    scene = models.on_shell(model, shell, law, radius=RADIUS, method=method)
    return sp.Simulation(scene, integrator).run(q, duration=duration, record_dt=duration)


def last_forces(result: sp.Result) -> Array:
    """Return normal forces [N] of the last row, saddles with a minus."""
    log = result.contacts
    return np.asarray(log.normal_force[log.row == len(result.t) - 1])


def damped(stiffness: float, damping: float) -> sp.ImpactLaw:
    """Return a spring whose damping is constant from 1 nm on."""
    return sp.ImpactLaw(stiffness, 1.0, damping, 1e-9)


def wedge(half_angle: float, integrator: Any, method: str) -> tuple[Array, Array]:
    """Let a ball settle in a V; return both forces, and its depth there, and what is right.

    N = m g / (2 sin a) with half the angle of the V, a.
    """
    force = WEIGHT / (2 * math.sin(half_angle))
    depth = 2e-4 * RADIUS
    stiffness = force / depth
    shell = sp.Shell(*meshes.v_groove(math.pi / 2 - half_angle), crease_angle=0.0)
    # Critical for the slower way, up and down.
    damping = math.sqrt(2 * stiffness * MASS) / math.sin(half_angle)
    height = (RADIUS - 0.9 * depth) / math.sin(half_angle)
    slow = math.sqrt(MASS / (2 * stiffness)) / math.sin(half_angle)
    result = rest(
        models.block(GRAVITY, MASS),
        shell,
        damped(stiffness, damping),
        np.array([0.0, 0.01, height]),
        integrator,
        60 * slow,
        method,
    )
    found = np.append(last_forces(result), RADIUS - result.q[-1, 2] * math.sin(half_angle))
    return found, np.array([force, force, depth])


@case("ball wedged in a V")
def wedged() -> Verdicts:
    for integrator in (sp.Implicit(), sp.LinearlyImplicitEuler(1e-3)):
        for degrees in (2.0, 10.0, 45.0, 80.0):
            for method in ("smooth", "facets"):
                found, right = wedge(math.radians(degrees), integrator, method)
                tried = f"{type(integrator).__name__}, {degrees:g} deg to each side, {method}"
                laws = ("N = m g / (2 sin a)", "N, other plate", "depth = N / k")
                if len(found) != 3:
                    yield at_most("wedge", tried, "two contacts", len(found) - 3, 0)
                    continue
                for law, a, b in zip(laws, found, right, strict=True):
                    yield compare("wedge", tried, law, float(b), float(a), 1e-6)


def cone(half_angle: float, columns: int, rows: int, flat: bool) -> sp.Shell:
    """Return a seat that opens upward, round z: with its own normals, or of flat facets."""
    turn, rho = 2 * np.pi * np.arange(columns) / columns, np.linspace(0.4, 1.6, rows + 1) * RADIUS
    cos, sin = math.cos(half_angle), math.sin(half_angle)
    out = np.stack([np.cos(turn), np.sin(turn), np.full(columns, cos / sin)], axis=1)
    vertices = (rho[:, None, None] * out).reshape(-1, 3)
    normals = np.tile(out * [-cos, -cos, sin * sin / cos], (rows + 1, 1))
    first = (np.arange(rows)[:, None] * columns + np.arange(columns)).ravel()
    second = first // columns * columns + (first + 1) % columns
    quads = np.stack([first, first + columns, second + columns, second], axis=1)
    if flat:
        return sp.Shell(vertices, quads, crease_angle=0.0)
    # As bent elements: on the exact cone the radial force would jump at the axis.
    return sp.Shell(vertices, quads, normals=normals, faces=False)


def ring_depth(half_angle: float, columns: int, flat: bool, stiffness: float) -> float:
    """Return by how much the ball at rest overlaps the round cone, r - z sin a [m].

    A ring of contact counts once: k depth sin a = m g, but for the sum of what the bent elements'
    minima and the saddles between them differ by. Of n flat facets the ball touches each, and
    between them n saddles, of which the highest n - 1 count:
    k (n depth_f sin f - (n - 1) depth sin a) = m g, where tan f = tan a cos(pi / n) is the facet's
    own angle.
    """
    a = half_angle
    if not flat:
        return WEIGHT / (stiffness * math.sin(a))
    f = math.atan(math.tan(a) * math.cos(math.pi / columns))
    # depth_f = r - z sin f, depth = r - z sin a: linear in z.
    n, sin_f, sin_a = columns, math.sin(f), math.sin(a)
    z = (RADIUS * (n * sin_f - (n - 1) * sin_a) - WEIGHT / stiffness) / (
        n * sin_f**2 - (n - 1) * sin_a**2
    )
    return RADIUS - z * sin_a


def seated(integrator, columns, flat, free):
    """Let a ball settle in a cone; return its depth, what is right, the force up, and how far
    from the axis it is [m]. `free`: it may leave the axis.
    """
    a = math.radians(40.0)
    depth = 0.05 * RADIUS
    stiffness = WEIGHT / (depth * math.sin(a))
    right = ring_depth(a, columns, flat, stiffness)
    law = damped(stiffness, 2 * math.sqrt(stiffness * MASS))
    model = models.block(GRAVITY, MASS) if free else models.slider(GRAVITY, MASS)
    height = (RADIUS - 0.9 * right) / math.sin(a)
    q = np.array([1e-5 * RADIUS, 0.0, height]) if free else np.array([height])
    shell = cone(a, columns, max(columns // 8, 2), flat)
    # Times of decay: as many as the error of the forces asks for.
    duration = (20 if free else 50) * math.sqrt(depth / GRAVITY)
    result = rest(model, shell, law, q, integrator, duration)
    last = result.contacts.row == len(result.t) - 1
    up = float(result.contacts.force_world[last, 2].sum())
    aside = float(np.hypot(*result.q[-1, :2])) if free else 0.0
    return RADIUS - float(result.q[-1, -1]) * math.sin(a), right, up, aside


@case("ball in a cone, touched along a ring", slow=True)
def coned() -> Verdicts:
    for integrator in (sp.Implicit(), sp.LinearlyImplicitEuler(1e-3)):
        for columns, flat, bound in ((64, True, 1e-6), (64, False, 5e-3)):
            depth, right, up, _ = seated(integrator, columns, flat, free=False)
            surface = "flat facets" if flat else "columns of bent elements"
            tried = f"{type(integrator).__name__}, {columns} {surface}, on the axis"
            law = "64 contacts less 63 saddles" if flat else "k depth sin a = m g"
            yield compare("cone", tried, law, right, depth, bound)
            yield compare("cone", tried, "forces up = m g", WEIGHT, up, 1e-6)
    # Beside the axis the force jumps where links of the ring tie: the steps must resolve that.
    integrator = sp.LinearlyImplicitEuler(1e-4)
    depth, right, _, aside = seated(integrator, 64, False, free=True)
    tried = f"{type(integrator).__name__}, 64 columns, free"
    yield compare("cone", tried, "k depth sin a = m g", right, depth, 5e-3)
    yield at_most("cone", tried, "stays on the axis, of the depth", aside / right, 0.05)


SPIKES = 8


def spikes() -> sp.Shell:
    """Return eight spikes whose tips stand at z = 0 on a circle of 0.6 r."""
    vertices, elements = [], []
    foot = np.array([[1.0, 0.0], [-0.5, 0.75**0.5], [-0.5, -(0.75**0.5)]]) * 0.15 * RADIUS
    for k in range(SPIKES):
        turn = 2 * math.pi * k / SPIKES
        x, y = 0.6 * RADIUS * math.cos(turn), 0.6 * RADIUS * math.sin(turn)
        vertices.append([x, y, 0.0])
        vertices += [[x + fx, y + fy, -RADIUS] for fx, fy in foot]
        elements += [[4 * k, 4 * k + 1 + i, 4 * k + 1 + (i + 1) % 3] for i in range(3)]
    return sp.Shell(np.array(vertices), elements)


def height_on_spikes(stiffness: float) -> float:
    """Return the height z at rest [m] where 8 k (r - l) z / l = m g, l^2 = z^2 + (0.6 r)^2."""

    def left(z: float) -> float:
        length = math.hypot(z, 0.6 * RADIUS)
        return WEIGHT - SPIKES * stiffness * (RADIUS - length) * z / length

    return bisect(left, 0.5 * RADIUS, 0.8 * RADIUS)


def on_spikes(integrator: Any, method: str) -> tuple[Array, float, float]:
    """Let a ball settle on the spikes; return the forces, the force that is right, its height
    over the one that is right.
    """
    stiffness = WEIGHT / (SPIKES * 0.8 * 0.01 * RADIUS)
    law = damped(stiffness, math.sqrt(stiffness * MASS / SPIKES))
    z = height_on_spikes(stiffness)
    q = np.array([1e-4 * RADIUS, 2e-4 * RADIUS, z + 1e-3 * RADIUS])
    duration = 120 * math.sqrt(0.02 * RADIUS / GRAVITY)
    result = rest(models.block(GRAVITY, MASS), spikes(), law, q, integrator, duration, method)
    form = WEIGHT / (SPIKES * z / math.hypot(z, 0.6 * RADIUS))
    return last_forces(result), form, float(result.q[-1, 2]) / z


@case("ball on eight spikes")
def spiked() -> Verdicts:
    for integrator in (sp.Implicit(), sp.LinearlyImplicitEuler(1e-3)):
        for method in ("smooth", "facets"):
            forces, form, height = on_spikes(integrator, method)
            tried = f"{type(integrator).__name__}, {method}"
            if len(forces) != SPIKES:
                count = len(forces) - SPIKES
                yield at_most("spikes", tried, "eight contacts", count, 0)
                continue
            worst = float(forces[np.argmax(np.abs(forces - form))])
            law = "N = m g / (8 cos), each"
            yield compare("spikes", tried, law, form, worst, 1e-6)
            yield compare("spikes", tried, "height, of what is right", 1, height, 1e-8)
