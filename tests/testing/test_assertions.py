"""The assertions hold where contact is right, and fail where it was broken on purpose."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import testing
from sphshell_pin.errors import InvalidParameter, WeakLawWarning
from tests import meshes, models
from tests.contact.smooth.surfaces import shell_of
from tests.models import ARM_Q, arm, ball, free_q, linear_law, on_plate, plate, pose_of, slider

LAW = sp.ImpactLaw(4e4, 1.5, 20.0, 2e-2)
FRICTION = sp.CoulombFriction(0.3, 0.1, 0.1, 1.0)
ARM_V = np.array([0.3, 0.2, -0.4])
EVERY_FRICTION = [None, FRICTION, sp.BristleFriction(0.5, 0.3, 1e4, 30.0, 0.05)]


def arm_scene(kind=sp.Scene, friction=FRICTION):
    """Arm whose tip is 5 mm deep in a plate that stands askew."""
    scene, turn = kind(arm()), meshes.random_rotation(3)
    place = pin.SE3(turn, pose_of(arm(), ARM_Q, "ball").translation - 0.045 * turn[:, 2])
    more = {"law": LAW, "friction": friction, "method": "facets"}
    scene.add_contact(sp.Sphere(0.05, "ball"), plate(), placement=place, **more)
    return scene


class Weaker(sp.Scene):
    """Tells one joint's wrench a millionth too small."""

    def external_forces(self, q, v=None):
        forces = super().external_forces(q, v)
        joint = self.model.njoints - 1
        forces[joint] = pin.Force(forces[joint].vector * (1 - 1e-6))
        return forces


class Stiffer(sp.Scene):
    """Tells one entry of a derivative a hundred-thousandth too large."""

    entry = 0

    def contact_derivatives(self, q, v=None):
        both = [np.array(one) for one in super().contact_derivatives(q, v)]
        matrix = both[self.entry]
        k = np.unravel_index(np.abs(matrix).argmax(), matrix.shape)
        matrix[k] *= 1 + 1e-5
        return tuple(both)


@pytest.mark.parametrize("friction", EVERY_FRICTION)
def test_a_right_scene_passes(friction) -> None:
    scene, tau = arm_scene(friction=friction), np.array([1.0, -2.0, 3.0])
    assert testing.assert_forces_balance(scene, ARM_Q, ARM_V, tau=tau) < 1e-12
    assert testing.assert_derivatives(scene, ARM_Q, ARM_V) < 1e-6
    assert testing.assert_contacts_found(scene, ARM_Q) < 1e-12
    free = models.two_free_bodies(LAW, friction)
    assert testing.assert_wrenches_cancel(free, *models.two_free_state()) < 1e-13
    assert testing.assert_derivatives(free, *models.two_free_state()) < 1e-6


def test_a_wrong_wrench_is_told() -> None:
    message = r"forces do not balance: \S+ \(at most 1e-08\), joint"
    with pytest.raises(AssertionError, match=message):
        testing.assert_forces_balance(arm_scene(Weaker), ARM_Q, ARM_V)
    right = models.two_free_bodies(LAW, FRICTION)
    wrong, (pair,) = Weaker(right.model), right.pairs
    where = pair.frame_j, pair.side_j.placement
    wrong.add_contact(pair.side_i.sphere, pair.side_j.shell, *where, LAW, FRICTION, "facets")
    with pytest.raises(AssertionError, match=r"action and reaction differ.*leave a force of \("):
        testing.assert_wrenches_cancel(wrong, *models.two_free_state())


@pytest.mark.parametrize("entry", [0, 1])
def test_a_wrong_derivative_is_told(entry: int) -> None:
    scene = arm_scene(Stiffer)
    scene.entry = entry
    match = f"the contact forces by {'qv'[entry]}: of joint .* by joint"
    with pytest.raises(AssertionError, match=match):
        testing.assert_derivatives(scene, ARM_Q, ARM_V)


def test_a_single_joint_has_matrices_too() -> None:
    scene = on_plate(slider(), LAW)
    q, v = np.array([0.049]), np.array([-0.1])
    assert testing.assert_forces_balance(scene, q, v) < 1e-12
    assert testing.assert_derivatives(scene, q, v) < 1e-6
    # Closed form: F = k d^e - c STEP(d) v, so dF/dv = -c STEP(d).
    step = 0.001 / 2e-2
    by_v = scene.contact_derivatives(q, v)[1]
    assert by_v[0, 0] == pytest.approx(-20.0 * step**2 * (3 - 2 * step), rel=1e-9)


def closed_run(integrator, law=LAW, friction=FRICTION):
    scene = models.two_free_bodies(law, friction)
    return models.run(scene, integrator, *models.two_free_state(), 0.02)


def test_momentum_of_a_closed_system_is_kept() -> None:
    result = closed_run(sp.Adaptive(1e-9))
    assert testing.assert_momentum_kept(result) < 1e-7
    # Of order 4: a coarse step is told, with where and how much.
    with pytest.raises(AssertionError, match=r"momentum is not kept.*at t = .* impulse is"):
        testing.assert_momentum_kept(closed_run(sp.RungeKutta4(5e-3)), tolerance=1e-9)
    # So is what creeps in: of the ball, linear and angular.
    for k, size in ((0, 1e-5), (3, 1e-2)):
        crept = result.v + size * np.outer(np.linspace(0, 1, len(result.t)), np.eye(12)[k])
        with pytest.raises(AssertionError, match="momentum is not kept"):
            testing.assert_momentum_kept(replace(result, v=crept))


def massless():
    model = arm()
    model.inertias[3] = pin.Inertia.Zero()
    return on_plate(model, LAW)


def run_of(scene, *start, **more):
    return sp.Simulation(scene, sp.Adaptive(1e-9), **more).run(*start)


SHORT = free_q([0, 0, 0.049]), None, 1e-3
FAR = *models.two_free_state(-1.0), 1e-3
FIXED = on_plate(ball(gravity=0.0), LAW)
balance, wrenches = testing.assert_forces_balance, testing.assert_wrenches_cancel
momentum, lossless = testing.assert_momentum_kept, testing.assert_lossless_energy_kept


@pytest.mark.parametrize(
    ("said", "call"),
    [
        ("touches the universe", lambda: wrenches(arm_scene(), ARM_Q)),
        ("mass matrix is singular", lambda: balance(massless(), ARM_Q)),
        (r"tau has shape \(2,\)|tau = \(2,\)", lambda: balance(arm_scene(), ARM_Q, tau=[0, 0])),
        ("gravity", lambda: momentum(run_of(arm_scene(), ARM_Q, ARM_V, 1e-3))),
        ("nothing touched", lambda: momentum(run_of(models.two_free_bodies(LAW), *FAR))),
        ("not touch the universe", lambda: momentum(run_of(FIXED, *SHORT))),
        ("must know its scene", lambda: momentum(replace(closed_run(sp.Adaptive()), scene=None))),
        ("without damping, friction", lambda: lossless(run_of(arm_scene(), ARM_Q, ARM_V, 0.01))),
        ("must be 'both'", lambda: testing.assert_no_contact_missed(plate(side="outside"), 0.1)),
    ],
)
def test_what_cannot_be_judged_is_refused(said, call) -> None:
    with pytest.raises(InvalidParameter, match=said):
        call()


def test_energy_is_kept() -> None:
    assert testing.assert_energy_kept(run_of(arm_scene(), ARM_Q, ARM_V, 0.05)) < 1e-6
    pushed = run_of(on_plate(slider(), LAW), [0.06], None, 0.1, lambda *_: np.array([-20.0]))
    assert pushed.energy.control_work[-1] > 0.1
    assert testing.assert_energy_kept(pushed) < 1e-6
    drop = run_of(on_plate(ball(), linear_law(1e4)), free_q([0, 0, 0.06]), None, 0.2)
    assert len(drop.contacts)
    assert testing.assert_lossless_energy_kept(drop) < 1e-7


def test_a_source_that_makes_energy_is_told() -> None:
    """Its depth grows along z while it pushes askew: round a closed path it does work."""
    results = []
    for lean in (0.0, 0.3):
        normal = np.array([[np.sin(lean), 0.0, np.cos(lean)]])

        def find(pose_i, pose_j, normal=normal):
            return pose_i.translation[None], normal, 0.05 - pose_i.translation[2:]

        scene, v = sp.Scene(ball()), [1.0, 0, 0, 0, 0, 0]
        scene.add_contact_source(find, "ball", "universe", linear_law(1e4))
        results.append(run_of(scene, free_q([0, 0, 0.06]), v, 0.3))
        assert len(results[-1].contacts)
    assert testing.assert_energy_kept(results[0]) < 1e-6
    with pytest.raises(AssertionError, match=r"energy does not add up.*J too much.*changed form"):
        testing.assert_energy_kept(results[1])
    with pytest.raises(AssertionError, match="energy does not add up"):
        lossless(results[1])


class Holed:
    """A shell whose search loses the contacts on some elements."""

    def __init__(self, shell: sp.Shell, lost: range) -> None:
        self.shell, self.lost = shell, lost

    def __getattr__(self, name: str):
        return getattr(self.shell, name)

    def keep(self, found):
        return ~np.isin(found.element, list(self.lost))

    def contacts(self, center, radius, method="smooth"):
        found = self.shell.contacts(center, radius, method)
        keep = self.keep(found)
        columns = ("point", "normal", "depth", "element", "patch", "feature", "weight")
        return replace(found, **{name: getattr(found, name)[keep] for name in columns})


class Ghosts(Holed):
    """A shell whose contacts lie a hair beside the surface."""

    def contacts(self, center, radius, method="smooth"):
        found = self.shell.contacts(center, radius, method)
        return replace(found, point=found.point + np.array([0.0, 0.0, 1e-6 * radius]))


class Swallows(Holed):
    """A shell that tells the deepest contact alone."""

    def keep(self, found):
        return np.arange(len(found)) == 0


GROOVE = sp.Shell(*meshes.v_groove(np.radians(80), size=8.0, cells=4))


SHELLS = {"plate": plate(), "groove": GROOVE}
SHELLS |= {"bowl": sp.Shell(*meshes.bowl()), "icosphere": sp.Shell(*meshes.icosphere(2))}


@pytest.mark.parametrize("surface", SHELLS)
@pytest.mark.parametrize("method", ["facets", "elements"])
def test_nothing_is_missed_on_right_shells(surface: str, method: str) -> None:
    assert testing.assert_no_contact_missed(SHELLS[surface], 0.3, method=method) < 1e-12


def test_smooth_shells_need_room_for_their_bulge() -> None:
    shell = shell_of("bowl", 0.6)
    error = testing.assert_no_contact_missed(shell, 0.3, method="smooth", tolerance=0.5)
    assert error > 1e-6
    with pytest.raises(AssertionError):
        testing.assert_no_contact_missed(shell, 0.3, method="smooth", tolerance=0.1 * error)


def test_a_hole_in_the_search_is_told() -> None:
    shell = Holed(plate(count=40), range(0, 40))
    with pytest.raises(AssertionError, match=r"depth .* m is missed at element \d+ \(center \("):
        testing.assert_no_contact_missed(shell, 0.1)


def test_a_second_contact_that_is_swallowed_is_told() -> None:
    """Both flanks of a groove, in one piece, and two sheets one above the other, in two."""
    below, elements = meshes.grid_plate(4, 4)
    both = np.concatenate([below, below + np.array([0.0, 0.0, 0.2])])
    sheets = sp.Shell(both, np.concatenate([elements, elements + len(below)]))
    for shell, place, radius, message in (
        (GROOVE, [0.0, 0.3, 0.75], 0.6, r"deep at its inside, but no contact"),
        (sheets, [0.01, 0.02, 0.09], 0.15, r"deep in a piece of \d+ triangles, but no contact"),
    ):
        assert len(shell.contacts(place, radius, "facets")) == 2
        testing.assert_no_contact_missed(shell, radius, [place])
        with pytest.raises(AssertionError, match=message):
            testing.assert_no_contact_missed(Swallows(shell, range(0)), radius, [place])


def test_a_ghost_is_told() -> None:
    with pytest.raises(AssertionError, match=r"off the surface, its depth .* wrong"):
        testing.assert_no_contact_missed(Ghosts(plate(), range(0)), 0.1)


def test_a_sphere_that_passes_is_told() -> None:
    start = free_q([0, 0, 0.1]), np.array([0, 0, -3.0, 0, 0, 0]), 0.1
    with pytest.warns(WeakLawWarning):
        through = run_of(on_plate(ball(), linear_law(1.0)), *start)
    with pytest.raises(AssertionError, match=r"passed through.*by its event at t = .*element \d+"):
        testing.assert_not_passed_through(through)
    # The run itself need not know: nothing stops a sphere in a scene without contacts.
    scene = on_plate(ball(), linear_law(1e5))
    free = replace(run_of(sp.Scene(ball()), *start), scene=scene)
    with pytest.raises(AssertionError, match=r"passed through.*'ball-plate', element \d+"):
        testing.assert_not_passed_through(free)
    assert testing.assert_not_passed_through(run_of(scene, *start)) == 0.0
