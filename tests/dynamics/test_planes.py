"""A shell on a plane in scenes: derivatives, energy, momentum, rows and events."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from tests.contact.test_planes import egg as egg_shell
from tests.contact.test_planes import rotations, scene_of, support
from tests.meshes import cube
from tests.models import add_body, empty, pose_of

EGG = np.array([0.03, 0.02, 0.025])
INERTIA = pin.Inertia(0.5, np.array([0.002, -0.001, -0.003]), np.diag([1.5e-4, 2e-4, 1.8e-4]))


def over_plane(shell: sp.Shell, law, friction=None, *, ground: bool = True) -> sp.Scene:
    """A body over a plane of the world, or of a body that moves as well."""
    model, frame = empty(), "universe" if ground else "table"
    if not ground:
        add_body(model, frame, pin.JointModelFreeFlyer())
    add_body(model, "body", pin.JointModelFreeFlyer(), inertia=INERTIA)
    scene = sp.Scene(model)
    plane = sp.Plane(frame, (0.0, 0.0, 0.01), (0.1, -0.05, 1.0))
    scene.add_contact(plane, shell, "body", None, law, friction)
    return scene


def egg(law, friction=None, *, ground: bool = True) -> sp.Scene:
    return over_plane(egg_shell(10, EGG), law, friction, ground=ground)


def reach_of(shell: sp.Shell):
    """How far a shell that is turned goes down from its origin, by its vertices."""
    return lambda turned: -(shell.vertices @ turned.T)[:, 2].min()


def touching(scene: sp.Scene, depth: float = 2e-4, seed: int = 0, turned=None, reach=None):
    """A state of `over_plane` with the body `depth` deep, `turned` from the plane or anyhow.

    `reach(turned)` is how far down it goes from its origin; an egg's unless given.
    """
    rng = np.random.default_rng(seed)
    q = pin.neutral(scene.model)
    plane = scene.pairs[0].side_i.plane.placement
    if scene.model.nq > 7:
        q = pin.integrate(scene.model, q, 0.3 * rng.normal(size=scene.model.nv))
        plane = pose_of(scene.model, q, "table") * plane
    turn = rotations(1, seed)[0] if turned is None else plane.rotation @ turned
    down = (reach or (lambda turned: support(EGG, turned)))(plane.rotation.T @ turn)
    q[-7:-4] = plane.act(np.array([0.01, 0.02, down - depth]))
    q[-4:] = pin.Quaternion(turn).coeffs()
    return q, rng.normal(size=scene.model.nv) * 0.3


LAW = sp.ImpactLaw(2e7, 1.5, 20.0, 1e-4)
FRICTIONS = [None, sp.CoulombFriction(0.3, 0.2, 0.05, 0.5), sp.BristleFriction(0.4, 0.3, 2e4, 5.0)]


def test_rolling_loses_no_energy() -> None:
    """Free of friction and damping."""
    scene = egg(sp.ImpactLaw(2e7, 1.5, 0.0, 1e-4))
    q, v = touching(scene, 1e-4)
    result = sp.Simulation(scene, sp.Adaptive(rtol=1e-9, atol=1e-12)).run(q, v, 0.05)
    kept = result.energy.kinetic + result.energy.potential + result.energy.elastic
    assert np.ptp(kept) < 3e-6 * np.ptp(result.energy.kinetic)


@pytest.mark.parametrize("face", [0.0, np.pi / 2])
def test_a_box_stays_on_its_face(face: float) -> None:
    """Put down level it neither falls over nor jitters, whatever its direction."""
    shell, law = sp.Shell(*cube(0.2)), sp.ImpactLaw(1e6, 1.0, 500.0, 1e-4)
    scene = scene_of(shell, law, sp.BristleFriction(0.4, 0.3, 1e5, 50.0))
    turn = pin.utils.rotate("z", 0.3) @ pin.utils.rotate("x", face)
    low = float((np.asarray(shell.vertices) @ turn[2]).min())
    q = np.concatenate(([0.1, 0.2, -low], pin.Quaternion(turn).coeffs()))
    result = sp.Simulation(scene, sp.RungeKutta4(1e-4)).run(q, np.zeros(6), 1.0)
    assert np.abs(result.v[:, 3:]).max() < 1e-9
    assert np.abs(result.q[:, 3:] - q[3:]).max() < 1e-9
    assert np.abs(result.q[:, :2] - q[:2]).max() < 1e-9
    crown = 0.02 / (2000 * shell.size)  # of the face
    assert result.q[-1, 2] == pytest.approx(-low + crown - 9.81 / 1e6, abs=1e-6)


def test_a_sensor_and_rows_show_the_force_on_the_body_of_the_plane() -> None:
    scene = egg(LAW, FRICTIONS[1], ground=False)
    q, v = touching(scene)
    rows = scene.contacts(q, v)
    place = pose_of(scene.model, q, "table")
    on_table = place.act(scene.external_forces(q, v)[1]).linear
    assert rows.normal_force * rows.normal_world[0] + rows.friction_force_world[0] == pytest.approx(
        on_table, rel=1e-12
    )


def test_an_egg_falls_and_is_an_event_of_touch() -> None:
    scene = egg(LAW, FRICTIONS[2])
    q, v = touching(scene, -0.01)
    result = sp.Simulation(scene, sp.Adaptive(rtol=1e-8)).run(q, 0 * v, 0.1)
    first = next(event for event in result.events if event.kind == "touch")
    plane = scene.pairs[0].side_i.plane.placement
    fall = 0.01 / plane.rotation[2, 2]
    assert first.t == pytest.approx(np.sqrt(2 * fall / 9.81), rel=1e-5)


def test_explanation_of_a_plane() -> None:
    """The gap of the vertices, and the mass with which the egg resists along the normal."""
    scene = egg(LAW)
    q, v = touching(scene, -0.01)
    figures = scene.explain(q, v).pairs[0]
    assert "plane on frame 'universe' against shell 'shell' on frame 'body'" in figures.modelled
    assert figures.gap == pytest.approx(0.01, abs=2e-4)
    assert 0 < figures.effective_mass < INERTIA.mass
