"""Arguments and results of the derivatives of the dynamics."""

from dataclasses import replace

import numpy as np
import pytest

from sphshell_pin import CoulombFriction, HuntCrossleyLaw, Simulation
from sphshell_pin.errors import InvalidParameter, NameNotFound
from tests import models
from tests.dynamics.scenes import COULOMB, FRICTIONS, LAWS, State, in_bowl, in_touch, two_spheres

SCENE = in_bowl(LAWS["impact"], COULOMB)


UNKNOWN = {
    "tip.law.stifness": "tip.law.stiffness",
    "top.law.stiffness": "tip.law.stiffness",
    "tip.law": "tip.law.stiffness",
    "tip.friction": "tip.friction.mu_static",
    "tip.law.young": "tip.law.stiffness",
    "tip.other_sphere.radius": "tip.sphere.radius",
    "tip.sphere.offset.w": "tip.sphere.offset",
    **dict.fromkeys(("v", "q0.9", "v0.3", "v0.", "q0.x"), "tip.placement"),
}
# Names of numbers that there are with other laws, frictions and bodies.
ELSEWHERE = [
    (in_bowl(LAWS["table"], COULOMB), "tip.law.stiffness"),
    (in_bowl(LAWS["hertz"], COULOMB), "tip.law.restitution"),
    (in_bowl(LAWS["hertz"], None), "tip.friction.mu_static"),
    (in_bowl(LAWS["hertz"], FRICTIONS["soft finger"]), "tip.friction.torsional"),
    (in_bowl(LAWS["hertz"], FRICTIONS["rings"]), "tip.friction.rings"),
    ((two_spheres(LAWS["impact"]), *in_touch(3)), "balls.placement"),
]


@pytest.mark.parametrize(
    ("state", "name", "said"),
    [*((SCENE, *one) for one in UNKNOWN.items()), *((*one, "") for one in ELSEWHERE)],
)
def test_an_unknown_name_lists_the_valid_ones(state: State, name: str, said: str) -> None:
    scene, q, v = state
    with pytest.raises(NameNotFound, match=f"'{name}'.*{said}"):
        scene.dynamics_derivatives(q, v, parameters=[name])
    with pytest.raises(NameNotFound, match=f"'{name}'.*, q0, v0"):
        Simulation(scene).run(q, v, 0.1, sensitivities=[name])


STIFFNESS = "tip.law.stiffness"


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ([STIFFNESS, "tip.sphere.radius", STIFFNESS], f"{STIFFNESS}.*twice"),
        (["tip.placement", "tip.placement.vx"], "tip.placement.vx.*twice"),
        (3, "must be names"),
        (None, "must be names"),
        (b"x", "must be names"),
    ],
)
def test_names_that_are_refused(names: object, said: str) -> None:
    scene, q, v = SCENE
    with pytest.raises(InvalidParameter, match=f"parameters.*{said}"):
        scene.dynamics_derivatives(q, v, parameters=names)  # type: ignore[arg-type]
    with pytest.raises(InvalidParameter, match=f"sensitivities.*{said}"):
        Simulation(scene).run(q, v, 0.1, sensitivities=names)  # type: ignore[arg-type]
    with pytest.raises(InvalidParameter, match="parameters"):
        scene.dynamics_derivatives(q, v, parameters=STIFFNESS)


def test_a_number_that_no_side_allows_has_no_derivative() -> None:
    scene, q, v = in_bowl(LAWS["impact"], CoulombFriction(0.0, 0.0, 0.1, 1.0))
    # More than mu_static and less than 0 are refused; mu_static may grow.
    with pytest.raises(InvalidParameter, match=r"mu_dynamic = 0\.0 .*neither a larger nor"):
        scene.dynamics_derivatives(q, v, parameters=["tip.friction.mu_dynamic"])
    d = scene.dynamics_derivatives(q, v, parameters=["tip.friction.mu_static"])
    assert np.isfinite(d.by_parameters).all()


def test_numbers_at_their_bounds() -> None:
    """F = k depth^n (1 - b gap_rate) by b = 0, and mu_dynamic F by a mu_dynamic = mu_static."""
    law, friction = HuntCrossleyLaw(1e5, 1.5, 0.0), CoulombFriction(0.3, 0.3, 0.01, 0.1)
    scene = models.on_plate(models.block(), law, friction)
    names = ["ball-plate.law.dissipation", "ball-plate.friction.mu_dynamic"]
    got = scene.contact_force_derivatives([0, 0, 0.049], [1.0, 0, -0.2], parameters=names)
    load = 1e5 * 1e-3**1.5
    expected = [[-0.3 * 0.2 * load, -load], [0, 0], [0.2 * load, 0]]
    np.testing.assert_allclose(got.by_parameters[0], expected, rtol=0, atol=1e-6 * load)


def test_single_columns_of_the_start_of_a_run() -> None:
    scene, q, v = SCENE
    names = ["v0.2", "tip.placement.vz", "q0.0", "v0.0"]
    every = ["q0", "v0", "tip.placement"]
    runs = [Simulation(scene).run(q, v, 0.01, sensitivities=one) for one in (names, every)]
    some, all_of_them = (run.sensitivities for run in runs)
    assert some.parameters == tuple(names)
    at = [all_of_them.column(name) for name in names]
    np.testing.assert_array_equal(some.v, all_of_them.v[..., at])
    np.testing.assert_array_equal(some.force_world, all_of_them.force_world[..., at])
    with pytest.raises(InvalidParameter, match=r"v0\.1.*twice"):
        Simulation(scene).run(q, v, 0.01, sensitivities=["v0.1", "v0"])


def test_pairs_whose_names_begin_alike() -> None:
    """Names of pairs may have dots."""
    scene, q, v = SCENE
    pair = scene.pairs[0]
    names = ("tip", "tip.law")
    twins = tuple(replace(pair, name=name) for name in names)
    scene = scene.with_pairs(twins)
    got = scene.dynamics_derivatives(q, v, parameters=[f"{one}.law.stiffness" for one in names])
    assert got.by_parameters[:, 0].any()
    np.testing.assert_allclose(got.by_parameters[:, 1], got.by_parameters[:, 0], rtol=1e-9)
