"""All spheres of a body or a robot in one entry: as one by one, but cheaper."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import testing
from tests import meshes, models

R = 0.006
LAW = sp.HuntCrossleyLaw(1e6, 1.5, 0.5)
BRISTLE = sp.BristleFriction(0.6, 0.5, 1e5, 30.0)


def pad(count: int = 8, lift: float = 0.0005) -> list[sp.Sphere]:
    """Square of spheres below the frame "ball", curved upwards to its rim."""
    places = 0.012 * (np.arange(count) - 0.5 * (count - 1))
    return [
        sp.Sphere(R, "ball", (x, y, lift * ((x / 0.012 - 1) ** 2 + (y / 0.012) ** 2)))
        for x in places.tolist()
        for y in places.tolist()
    ]


def scene_of(spheres, *, together: bool, shell=None, model=None, **more) -> sp.Scene:  # type: ignore[no-untyped-def]
    scene = sp.Scene(model or models.ball())
    shell = shell or models.plate()
    more = {"law": LAW, "friction": BRISTLE, "method": "facets", **more}
    if together:
        scene.add_contacts(spheres, shell, **more)
    else:
        for sphere in spheres:
            scene.add_contact(sphere, shell, **more)
    return scene


def both(spheres, **more) -> tuple[sp.Scene, sp.Scene]:  # type: ignore[no-untyped-def]
    """The scene of all spheres in one entry, and of an entry for each."""
    together, alone = (scene_of(spheres, together=one, **more) for one in (True, False))
    return together, alone


def test_together_they_are_the_same_pairs() -> None:
    spheres = pad()
    together, alone = both(spheres)
    assert [pair.side_i.sphere for pair in together.pairs] == spheres
    assert {pair.group for pair in together.pairs} == {"shell"}
    assert [pair.name for pair in together.pairs[:2]] == ["shell/ball-0", "shell/ball-1"]
    q = models.free_q([0.01, 0.02, 0.005])
    v = np.array([0.1, 0.2, -0.3, 1.0, 2.0, 3.0])
    assert len(together.contacts(q, v)) == 4
    for a, b in zip(together.external_forces(q, v), alone.external_forces(q, v), strict=True):
        assert (a.vector == b.vector).all()
    assert np.array_equal(together.contact_derivatives(q, v), alone.contact_derivatives(q, v))


@pytest.mark.parametrize("method", ["smooth", "facets", "elements"])
def test_no_contact_is_missed_at_the_border_of_the_shell(method: str) -> None:
    # A dome, which bulges over its flat elements: far, near its box, and in touch at its rim.
    shell = sp.Shell(*meshes.dome(6))
    together, alone = both(pad(4), shell=shell, method=method, friction=None)
    rng, (low, high), met = np.random.default_rng(0), shell.box, 0
    for _ in range(300):
        place = low + rng.uniform(-0.3, 1.3, 3) * (high - low)
        q = np.concatenate([place, pin.Quaternion(rng.normal(size=4)).normalized().coeffs()])
        a, b = together.contacts(q), alone.contacts(q)
        assert (a.pair == b.pair).all()
        assert (a.depth == b.depth).all()
        met += len(a)
    assert met > 50


INTEGRATORS = [sp.SemiImplicitEuler(1e-4), sp.Adaptive(1e-8, 1e-10), sp.Implicit(1e-8, 1e-10)]


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda one: type(one).__name__)
def test_together_they_move_as_one_by_one(integrator) -> None:  # type: ignore[no-untyped-def]
    # Falls, hits, tumbles.
    q, v = models.free_q([0.0, 0.0, 0.012]), np.array([0.3, 0.1, -0.5, 1.0, -2.0, 5.0])
    exact, ends = isinstance(integrator, sp.SemiImplicitEuler), []
    for scene in both(pad(3)):
        result = models.run(scene, integrator, q, v, 0.05)
        assert sum(figures.touches for figures in result.stats.pairs.values()) > 3
        if not exact:
            testing.assert_energy_kept(result, 1e-5)
        ends.append(np.concatenate([result.q[-1], result.v[-1]]))
    assert np.allclose(*ends, rtol=0, atol=1e-12 if exact else 2e-5)


def test_contacts_that_begin_at_once_have_rings_of_their_own() -> None:
    law, ends = sp.ImpactLaw.hertz(0.05, 1e6, 0.4, 1e6, 0.4), []
    friction = sp.MindlinFriction(0.3, 0.3, 1e6, 0.4, rings=4, torsional=True)
    spheres = [sp.Sphere(0.02, "ball", (x, 0.0, -0.03)) for x in (-0.02, 0.02)]
    q, v = models.free_q([0, 0, 0.055]), [0.3, 0.1, -0.5, 0.0, 0.0, 3.0]
    for scene in both(spheres, law=law, friction=friction):
        result = models.run(scene, sp.RungeKutta4(1e-4), q, v, 0.2)
        assert result.stats.pairs[scene.pairs[0].name].touches > 0
        ends.append(np.concatenate([result.q[-1], result.v[-1]]))
    assert ends[0] == pytest.approx(ends[1], abs=1e-10)


@pytest.mark.parametrize("speed", [30.0, 3000.0])
@pytest.mark.parametrize("integrator", [sp.SemiImplicitEuler(1e-2), sp.Adaptive(1e-5)])
def test_a_fast_pad_passes_through_nothing(integrator, speed: float) -> None:  # type: ignore[no-untyped-def]
    law = models.linear_law(1.0 * (speed / (0.3 * R)) ** 2)
    more = {"shell": models.square(1.0), "model": models.block(0.0), "law": law, "friction": None}
    scene = scene_of(pad(), together=True, **more)
    start = np.array([-0.03, 0.02, 0.2137])
    result = sp.Simulation(scene, integrator).run(start, [0.1 * speed, 0, -speed], 0.42 / speed)
    assert result.v[-1, 2] > 0.5 * speed
    assert {event.kind for event in result.events} == {"touch", "lift_off"}


@pytest.mark.parametrize("integrator", [sp.SemiImplicitEuler(2e-5), sp.Adaptive(1e-7, 1e-9)])
def test_more_contacts_begin_at_once_than_there_is_room_for(integrator) -> None:  # type: ignore[no-untyped-def]
    # 64 spheres land at the same instant, and hold on a slope of 0.3 with friction 0.6.
    model, law = models.ball(), sp.HuntCrossleyLaw(1e5, 1.5, 5.0)
    model.gravity.linear = np.array([9.81 * np.sin(0.3), 0.0, -9.81 * np.cos(0.3)])
    scene = scene_of(pad(lift=0.0), together=True, model=model, law=law)
    q = models.free_q([0, 0, R + 1e-4])
    result = models.run(scene, integrator, q, duration=0.4, record_dt=0.1)
    assert [figures.touches > 0 for figures in result.stats.pairs.values()] == [True] * 64
    assert np.abs(result.v[-1]).max() < 1e-3
    assert abs(result.q[-1, 0] - result.q[-2, 0]) < 1e-6
    if isinstance(integrator, sp.Adaptive):
        testing.assert_energy_kept(result, 1e-4)


def test_a_group_over_the_bulge_of_a_coarse_shell_is_not_far() -> None:
    """A ball of 80 flat triangles: the surface is the sphere, beyond the middles of the flats."""
    vertices, triangles = meshes.icosphere(1)
    # With a flat on top, boxes end where it does.
    out, up = vertices[triangles[0]].mean(axis=0), np.array([0.0, 0.0, 1.0])
    bulge = 1 - float(np.linalg.norm(out))
    turn = pin.Quaternion.FromTwoVectors(out, up).toRotationMatrix()
    vertices, out = vertices @ turn.T, up
    shell = sp.Shell(vertices, triangles, normals=vertices)
    # All spheres of the group on a line out of the flat's middle: none reaches the flat itself.
    radius = 0.25 * bulge
    spheres = [sp.Sphere(radius, "ball", tuple(0.1 * k * bulge * out)) for k in range(4)]
    more = {"law": sp.ImpactLaw(1e6, 1.0), "friction": None, "method": "smooth"}
    together, alone = both(spheres, shell=shell, model=models.block(), **more)
    q = out * (1 + 0.5 * radius)
    found = together.contacts(q)
    assert len(found) == len(alone.contacts(q)) > 0
    assert found.depth == pytest.approx(alone.contacts(q).depth, rel=1e-12)


def test_names_tell_frames() -> None:
    model = models.ball()
    models.add_body(model, "other", pin.JointModelFreeFlyer())
    scene = sp.Scene(model)
    spheres = [sp.Sphere(R, "ball"), sp.Sphere(R, "other"), sp.Sphere(R, "other", (0, 0, 0.01))]
    made = scene.add_contacts(spheres, models.plate(), law=LAW, name="hand")
    assert [pair.name for pair in made] == ["hand/ball", "hand/other-0", "hand/other-1"]
    ball = scene.add_contacts(spheres[1:], sp.Sphere(0.1, "ball"), law=LAW)
    assert [pair.name for pair in ball] == ["ball/other-0", "ball/other-1"]
    assert {len(pair.spheres) for pair in ball} == {2}
    assert scene.pairs == (*made, *ball)


def test_they_are_explained_by_the_nearest() -> None:
    scene = scene_of(pad(), together=True, law=sp.ImpactLaw(50.0, 1.0))
    told = str(scene.explain(models.free_q([0, 0, 0.02])))
    assert told.count("Contact 'shell/ball-") == 1
    assert ", the nearest of 64 of 'shell':" in told
    assert told.count("the law is soft for this mass") == 0
    assert told.count("the law cannot stop the sphere, make it stiffer (and 63 others of ") == 1
