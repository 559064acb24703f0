"""Where a contact begins, on a curved shell: runs by the radius, whose touch comes with no slope.

There the rise of the shell beyond its element comes on with the square of the depth.
"""

from itertools import product

import numpy as np
import pytest

import sphshell_pin as sp
from tests import meshes, models
from tests.sensitivities import BRISTLE, COULOMB, HUNT, Case, R
from tests.studies import mostly_studies

LAWS = {
    "hertz": sp.HertzLaw(2e7, 0.3, restitution=0.7, speed=0.5),
    "viscoelastic": sp.HertzLaw(2e7, 0.3, loss_tangent=0.1, frequency=100.0),
    "hunt": HUNT,
}
FRICTIONS = {
    "coulomb": COULOMB,
    "bristle": BRISTLE,
    "mindlin": sp.MindlinFriction(0.4, 0.3, 2e7, 0.3, damping_time=1e-5),
}
# Half axes of an ellipsoid [m].
AXES = np.array([0.25, 0.2, 0.15])


def off_an_ellipsoid(law: sp.NormalLaw, friction: object, inside: bool, place: list[float]) -> Case:
    """A ball that meets an ellipsoid at an angle, from outside, or from inside a larger one."""
    vertices, triangles = meshes.icosphere(3, 1.0)
    axes, sign = (1.3 * AXES, -1.0) if inside else (AXES, 1.0)
    normals = vertices / axes
    normals *= sign / np.linalg.norm(normals, axis=1, keepdims=True)
    shell = sp.Shell(vertices * axes, triangles[:, :: int(sign)], normals=normals, faces=False)
    scene = models.on_shell(models.ball(gravity=0.0), shell, law, friction)
    at = np.array(place) / np.linalg.norm(place)
    normal = sign * at / axes / np.linalg.norm(at / axes)
    q0 = models.free_q(at * axes + 1.02 * R * normal)
    v0 = np.r_[-0.5 * normal + [0.15, -0.1, 0.1], 2.0, -3.0, 1.0]
    return Case(scene, q0, v0, 0.012, sp.Implicit(1e-9))


# Each law, each friction and both sides; studies combine all.
SOME = {("hertz", "coulomb", True), ("viscoelastic", "bristle", False), ("hunt", "mindlin", True)}


@pytest.mark.parametrize(
    ("law", "friction", "inside"),
    mostly_studies(product(LAWS, FRICTIONS, (False, True)), SOME.__contains__),
)
def test_a_bounce_by_the_radius(law: str, friction: str, inside: bool) -> None:
    case = off_an_ellipsoid(LAWS[law], FRICTIONS[friction], inside, [0.3, 0.5, 0.8])
    # A viscoelastic force begins like the square root of the depth.
    case.check(["ball.sphere.radius"], tolerance=1e-3 if law == "viscoelastic" else 1e-4)
