"""Derivatives of contact forces, accelerations, rows and bristles' rates, against differences."""

from collections.abc import Callable, Iterable
from functools import partial
from itertools import product

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import testing
from sphshell_pin.base.arrays import Array
from tests import differences, meshes, models
from tests.contact.smooth.surfaces import SURFACES
from tests.dynamics import scenes
from tests.dynamics.test_external_forces import CASES
from tests.dynamics.test_mimic import CASES as MIMIC
from tests.models import ARM_Q, TURNING, free_q

LAWS, FRICTIONS = scenes.LAWS, scenes.FRICTIONS
IMPACT = LAWS["impact"]
WHERE: dict[str, Callable[..., scenes.State]] = {
    "on a plate": scenes.on_plate,
    "in a bowl": scenes.in_bowl,
    "moving": scenes.moving,
    "in a groove": scenes.in_groove,
}
WHERE |= {name: partial(scenes.on_surface, name) for name in SURFACES}
ELLIPSES = ("dome", "torus inside", "wavy above")
HERTZ = sp.HertzLaw(1e5, 0.3, restitution=0.8, speed=1.0)


def at_corner(center: list[float], method: str) -> scenes.State:
    scene = scenes.free_ball(sp.Shell(*meshes.cube(2.0)), friction=scenes.COULOMB, method=method)
    return scene, scenes.turned(free_q(center), 2), np.full(6, 0.1)


def on_elements() -> scenes.State:
    """They are exact on a plane."""
    shell = sp.Shell(*meshes.grid_plate(1, 1, 4.0, quads=True))
    scene = scenes.free_ball(shell, friction=scenes.COULOMB, method="elements")
    return scene, scenes.turned(free_q([0.3, 0.1, 0.95]), 1), np.full(6, 0.1)


Scenes = dict[str, Callable[[], scenes.State]]
CHAINS: Scenes = {" ".join(map(str, one)): partial(scenes.on_chain, *one) for one in CASES[::4]}
CHAINS |= {
    f"{i} {j} {tree}": partial(scenes.on_chain, i, j, tree, seed)
    for joint, tree in product(TURNING, ("apart", "siblings", "chain"))
    for seed, (i, j) in enumerate([(joint, "prismatic"), ("spherical", joint), (joint, joint)])
}
NOT_IN_PINOCCHIO = {f"JointModel{name}" for name in ("SphericalZYX", "Universal", "Composite")}
CORNERS = [[1.2, 1.15, 0.1], [1.2, 1.2, 1.1], [0.2, 0.3, 1.9]]
PLACES = ("on a plate", "in a bowl", "moving", "in a groove")
SEEDS = {name: seed for seed, name in enumerate(FRICTIONS)}
DISCS = ("soft finger", "mindlin", "rings")


def family(make: Callable[..., scenes.State], *axes: Iterable[object]) -> Scenes:
    """The scenes of all combinations of what the axes list, by their names."""
    return {", ".join(map(str, one)): partial(make, *one) for one in product(*axes)}


def somewhere(where: str, law: str, friction: str = "coulomb", *more: int) -> scenes.State:
    return WHERE[where](LAWS[law], FRICTIONS[friction], *more)


def on_facets(name: str, seed: int) -> scenes.State:
    return scenes.on_surface(name, IMPACT, scenes.COULOMB, seed, method="facets")


SCENES: Scenes = {
    **family(somewhere, ("in a bowl", "moving"), LAWS),
    **family(lambda where, slip: somewhere(where, "impact", slip), PLACES, FRICTIONS),
    **family(lambda name, slip: somewhere(name, "impact", slip, SEEDS[slip]), SURFACES, FRICTIONS),
    # Mindlin's disc follows the curvature of the shell, with its slopes.
    **family(lambda at, _, slip: WHERE[at](HERTZ, FRICTIONS[slip]), ELLIPSES, ("hertz",), DISCS),
    **family(on_facets, ELLIPSES, (0, 1)),
    **family(lambda k, method: at_corner(CORNERS[k], method), range(3), ("smooth", "facets")),
    **family(scenes.balls, ("impact", "hertz, two materials"), FRICTIONS),
    **CHAINS,
    **family(scenes.mimicking, MIMIC, (3, 4)),
    # In a stop, with damping, armature and dry friction; ARM_Q is 0.1 rad beyond the range.
    "joint components": partial(scenes.in_bowl, IMPACT, scenes.COULOMB, joints=scenes.STOPS),
    "elements": on_elements,
    "locked joint": scenes.locked,
    "shell alone moves": scenes.shell_alone_moves,
    "through a sheet": scenes.through_a_sheet,
    "source": scenes.held_in_frame_j,
    "two pairs": partial(scenes.two_pairs, IMPACT, scenes.COULOMB),
    "no contacts": lambda: (sp.Scene(models.arm()), ARM_Q, scenes.ARM_V),
}


def assert_derivatives(scene: sp.Scene, q: Array, v: Array, tolerance: float = 1e-6) -> None:
    """Forces and accelerations by q, v, tau and all numbers; what is exact algebra, to round-off.

    The contact forces F alone are differentiated by `contact_derivatives`: of F = rnea(q, v, a) -
    tau that is exact algebra.
    """
    model = scene.model
    tau = np.random.default_rng(1).normal(size=model.nv)
    testing.assert_derivatives(scene, q, v, tau, tolerance)
    got = scene.dynamics_derivatives(q, v, tau)
    expected = differences.acceleration(scene, q, v, tau)
    np.testing.assert_allclose(got.acceleration, expected, rtol=0, atol=1e-9 * abs(expected).max())
    supports = model.supports.tolist()
    known = all(model.parents[j] in supports[j - 1] for j in range(1, model.njoints))
    # Pinocchio has no derivatives of joints whose axes turn.
    known &= not {joint.shortname() for joint in model.joints} & NOT_IN_PINOCCHIO
    if known and not (scene.joints.kinds() or list(model.mimicking_joints)):
        data = model.createData()
        pin.computeRNEADerivatives(model, data, q, v, got.acceleration)
        inertia = np.triu(data.M) + np.triu(data.M, 1).T
        whole = data.dtau_dq + inertia @ got.by_q, data.dtau_dv + inertia @ got.by_v
        size = max(np.abs(one).max() for one in (*whole, data.dtau_dq, data.dtau_dv))
        for of_force, by in zip(scene.contact_derivatives(q, v), whole, strict=True):
            np.testing.assert_allclose(of_force, by, rtol=0, atol=1e-10 * size)


@pytest.mark.parametrize("name", SCENES)
def test_derivatives(name: str) -> None:
    scene, q, v = SCENES[name]()
    assert len(scene.contacts(q, v)) or name == "no contacts"
    assert_derivatives(scene, q, v)


def test_scenes_touch_as_they_are_meant_to() -> None:
    scene, q, v = scenes.in_groove(IMPACT, scenes.COULOMB)
    assert np.sign(scene.contacts(q, v).normal_force).tolist() == [1, 1, -1]
    assert len(SCENES["two pairs"]()[0].contacts(ARM_Q, scenes.ARM_V)) == 2
    scene, q, v = SCENES["joint components"]()
    assert scene.joint_forces(q, v)[1] < -1.0
    assert SCENES["locked joint"]()[0].model.nv == 2


@pytest.mark.parametrize(("friction", "tolerance"), [("none", 1e-6), ("coulomb", 1e-5)])
def test_a_cluster_shown_as_one(friction: str, tolerance: float) -> None:
    """With friction it acts as one contact, right but for the square of the normals' angle."""
    shell = sp.Shell(*meshes.v_groove(np.radians(0.1), size=8.0, cells=2), crease_angle=1e-5)
    scene = scenes.free_ball(shell, friction=FRICTIONS[friction])
    found = shell.contacts(np.array([4e-4, 0.3, 0.97]), 1.0)
    assert (found.weight.tolist(), found.terms.weight.tolist()) == ([1.0], [1.0, 1.0, -1.0])
    assert_derivatives(scene, free_q([4e-4, 0.3, 0.97]), np.full(6, 0.1), tolerance)


ROWS = ["in a bowl, impact", "moving, hunt-crossley", "impact, mindlin", "two pairs"]


@pytest.mark.parametrize("name", [*ROWS, "in a groove, coulomb"])
def test_derivatives_of_rows(name: str) -> None:
    assert_rows(*SCENES[name]())


def assert_rows(scene: sp.Scene, q: Array, v: Array) -> None:
    """Forces and depths of contacts by q, v and all numbers."""
    got = scene.contact_force_derivatives(q, v, parameters=differences.names_of(scene))
    nv = scene.model.nv
    blocks = {f"q.{k}": (got.by_q[..., k], got.depth_by_q[:, k]) for k in range(nv)}
    blocks |= {f"v.{k}": (got.by_v[..., k], np.zeros(len(got.depth_by_q))) for k in range(nv)}
    for k, column in enumerate(got.parameters):
        blocks[column] = got.by_parameters[..., k], got.depth_by_parameters[:, k]
    moves = differences.moves(scene, q, v)
    for column, parts in blocks.items():
        moved, scale, ahead = moves[column]

        def rows(x: float, part: int, moved=moved) -> Array:
            other, q, v, _ = moved(x)
            found = other.contacts(q, v)
            return (found.force_world, found.depth)[part]

        for part, one in enumerate(parts):
            floor = 1e-2 * (1.0 if part else float(np.abs(got.by_q).max()))
            f = partial(rows, part=part)
            assert differences.off(one, f, scale, ahead=ahead, floor=floor) <= 1e-6, column


@pytest.mark.parametrize("name", CHAINS)
def test_rates_of_chains_of_joints(name: str) -> None:
    """The joints of "apart" are not in depth-first order."""
    scenes.assert_rate_jacobian(*CHAINS[name](), np.zeros(0))


# 1e-2 m of stretch are far over the limit, so that the sphere slides.
@pytest.mark.parametrize("stretch", [1e-4, 1e-2])
@pytest.mark.parametrize("friction", scenes.BRISTLES)
@pytest.mark.parametrize("where", [one for one in WHERE if one != "in a bowl"])
def test_rates_of_bristles(where: str, friction: str, stretch: float) -> None:
    """On curved shells and edges how the turning of normals changes is left out."""
    scene, q, v = WHERE[where](IMPACT, friction=FRICTIONS[friction])
    curved = where == "in a groove" or where in SURFACES
    turning = stretch * (30 if "rings" in friction else 1) if curved else 1e-6
    step = 1e-7 if where == "in a groove" else 1e-6
    z = scenes.stretched(scene, stretch)
    scenes.assert_rate_jacobian(scene, q, v, z, step=step, turning=turning)


# A scene, its stretches [m], and how well its turning is known.
ELSEWHERE = {
    f"{name}, {slip}": (partial(scenes.on_surface, name, HERTZ, FRICTIONS[slip]), 1e-4, 1e-2)
    for name, slip in product(ELLIPSES, DISCS)
}
ELSEWHERE |= {
    f"two spheres, {slip}": (partial(scenes.balls, "impact", slip, 4, 2.0), 2e-6, turning)
    for slip, turning in ((one, 0.3 if "rings" in one else 1e-2) for one in scenes.BRISTLES)
}
ELSEWHERE |= {name: (partial(scenes.mimicking, name), 1e-5, 1e-6) for name in MIMIC}
ELSEWHERE["two pairs"] = SCENES["two pairs"], 1e-4, 1e-6


@pytest.mark.parametrize("name", ELSEWHERE)
def test_rates_of_bristles_of_other_scenes(name: str) -> None:
    make, stretch, turning = ELSEWHERE[name]
    scene, q, v = make()
    scenes.assert_rate_jacobian(scene, q, v, scenes.stretched(scene, stretch), turning=turning)


def test_bristles_of_a_state() -> None:
    """Their stretch is held, in the shell's frame: by all numbers, the shell's place too."""
    (scene, q, v), state = scenes.stuck()
    tau, names = np.array([0.3, -0.2, 0.1]), differences.names_of(scene)
    got = scene.dynamics_derivatives(q, v, tau, parameters=names, state=state)
    without = scene.dynamics_derivatives(q, v, tau, parameters=names)
    assert np.abs(got.acceleration - without.acceleration).max() > 0.1
    # At rest the force along the plate is that of the springs alone.
    resting = scene.contacts(q, np.zeros(3), state=state)
    force, normal = resting.force_world[0], resting.normal_world[0]
    along = force - normal * (normal @ force)
    z = np.zeros(scene._binding.bristle_size)
    z[:3] = -scene.pairs[0].side_j.placement.rotation.T @ along / scenes.BRISTLE.stiffness

    def rates(scene: sp.Scene, q: Array, v: Array, tau: Array) -> Array:
        return scene._binding.rates(q, v, z, tau)[:3]

    expected = differences.acceleration(scene, q, v, tau, state)
    for found in (rates(scene, q, v, tau), got.acceleration):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    columns = {f"q.{k}": got.by_q[:, k] for k in range(3)}
    columns |= {f"v.{k}": got.by_v[:, k] for k in range(3)}
    columns |= dict(zip(got.parameters, got.by_parameters.T, strict=True))
    moves = differences.moves(scene, q, v, tau)
    for name, column in columns.items():
        moved, scale, ahead = moves[name]
        f = partial(differences.acceleration, state=state) if name[:2] in ("q.", "v.") else rates
        error = differences.off(column, lambda x, f=f, m=moved: f(*m(x)), scale, ahead=ahead)
        assert error <= 1e-6, name
