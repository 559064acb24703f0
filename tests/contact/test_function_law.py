"""Laws and friction of one's own do what those do whose formulas they state."""

import copy
import ctypes
import gc
import inspect
import math
import pickle
import random
import weakref

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin import errors
from sphshell_pin.scenario import build, run_built
from sphshell_pin.scenario.running.replay import Replay
from sphshell_pin.testing import assert_derivatives
from tests import models
from tests.contact.test_table_law import LAW_LINE, SPRING, TABLE
from tests.scenario.files import DROP, write

NUMBER, LIST = ctypes.c_double, ctypes.POINTER(ctypes.c_double)
FORCE = ctypes.CFUNCTYPE(NUMBER, NUMBER, NUMBER, LIST)
ENERGY = ctypes.CFUNCTYPE(NUMBER, NUMBER, LIST)
NUMBERS, SLIP = {"k": 1e6, "b": 0.5}, {"mu": 0.3, "v": 0.1}
TWIN = sp.HuntCrossleyLaw(1e6, 1.5, 0.5)
SMOOTH = sp.CoulombFriction(0.3, 0.3, 0.1, 0.2)  # a cubic up to 0.1 m/s
LAW = 'law = { type = "function", function = "own.py:force", parameters = { k = 1e6, b = 0.5 } }'
FRICTION = LAW.replace("law", "friction", 1).replace("force", "size").replace("k = 1e6", "mu = 0.3")
FRICTION = FRICTION.replace("b = 0.5", "v = 0.1")
BALL = np.array([0.01, 0.02, 0.0492, 0, 0, 0, 1.0])
MOVES = np.array([0.1, 0.0, -0.05, 1.0, 2.0, 0.0])
SLOW = np.array([0.03, 0.02, -0.05, 0.4, 0.3, 0.2])  # 0.03 m/s of slip and some spin


def force(depth, gap_rate, parameters):
    return parameters[0] * depth * math.sqrt(depth) * (1 - parameters[1] * gap_rate)


def energy(depth, parameters):
    return 0.4 * parameters[0] * depth**2.5


def size(slip, normal, parameters):
    x = min(slip / parameters[1], 1.0)
    return parameters[0] * normal * x * (3 - x * x) / 2


C_LAW = sp.FunctionLaw(FORCE(force), ENERGY(energy), NUMBERS)
OWN = sp.FunctionFriction(FORCE(size), SLIP)


def python_law(function=force, numbers=NUMBERS):
    with pytest.warns(errors.SlowLawWarning, match=r"numba\.cfunc"):
        return sp.FunctionLaw(function, parameters=numbers)


def python_friction():
    with pytest.warns(errors.SlowLawWarning, match="a FunctionFriction of a Python function"):
        return sp.FunctionFriction(size, SLIP)


def numba_law():
    numba = pytest.importorskip("numba")
    compiled = numba.cfunc("float64(float64, float64, CPointer(float64))")(force)
    return sp.FunctionLaw(compiled, parameters=NUMBERS)


@pytest.mark.parametrize("make", [lambda: C_LAW, python_law, numba_law])
def test_a_law_answers_as_its_twin(make) -> None:
    law = make()
    for depth in (1e-6, 1e-4, 3e-3):
        for rate in (0.0, -0.2, 0.4, 5.0):
            assert law.normal_force(depth, rate) == pytest.approx(TWIN.normal_force(depth, rate))
        assert law.normal_stiffness(depth) == pytest.approx(TWIN.normal_stiffness(depth), rel=1e-10)
        assert law.energy(depth) == pytest.approx(TWIN.energy(depth), rel=1e-12)
        assert law.decay_time(2.0, depth) == pytest.approx(TWIN.decay_time(2.0, depth), rel=1e-6)
    assert law.normal_force(-1e-3) == 0.0
    assert law.depth_at(20.0) == pytest.approx(TWIN.depth_at(20.0))
    assert law.contact_time(1e-3, 0.3) == pytest.approx(TWIN.contact_time(1e-3, 0.3), rel=1e-5)
    assert (law.k, law.b) == (1e6, 0.5)


@pytest.mark.parametrize("make", [lambda: OWN, python_friction], ids=["C", "python"])
def test_friction_answers_as_its_twin(make) -> None:
    own = make()
    for speed in (0.0, 1e-6, 0.02, 0.1, 3.0):
        assert own.coefficient(speed, 5.0) == pytest.approx(SMOOTH.coefficient(speed), abs=1e-12)
    assert own.slip_time(2.0, 7.0, 0.0) == pytest.approx(SMOOTH.slip_time(2.0, 7.0, 0.0), rel=1e-9)
    assert own.largest_coefficient == pytest.approx(0.3, rel=0.01)
    assert own.sticking_speed == pytest.approx(0.1, rel=0.15)
    assert (own.mu, own.v, own.has_state) == (0.3, 0.1, False)
    scenes = [models.on_plate(models.ball(), TWIN, one) for one in (own, SMOOTH)]
    for moves in (SLOW, MOVES, 0 * MOVES):
        ours, theirs = (one.external_forces(BALL, moves)[1].vector for one in scenes)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())
    (made,) = scenes[0].constraints(BALL).models
    np.testing.assert_allclose(made.getFriction(), own.largest_coefficient)


DEPTHS = [1e-13, 3e-7, 0.99e-4, 1.01e-4, 4e-4, 2e-3]
KINKED = {
    "stiffens": (lambda d, r, p: 1e4 * d + max(0.0, d - 1e-4) * 4e5, lambda d: 5e3 * d * d
                 + 2e5 * max(0.0, d - 1e-4) ** 2),
    "yields": (lambda d, r, p: min(1e5 * d, 10.0), lambda d: 5e4 * d * d if d < 1e-4
               else 5e-4 + 10 * (d - 1e-4)),
    "exponential": (lambda d, r, p: 2 * math.expm1(d / 5e-4), lambda d: 2 * (5e-4
                    * math.expm1(d / 5e-4) - d)),
}  # fmt: skip


@pytest.mark.parametrize("name", KINKED)
def test_the_energy_is_the_integral_over_kinks(name) -> None:
    function, expected = KINKED[name]
    # In any order: what is found once is extended.
    for depths in (DEPTHS, DEPTHS[::-1]):
        law = sp.FunctionLaw(FORCE(function))
        for depth in depths:
            assert np.isclose(law.energy(depth), expected(depth), rtol=1e-9, atol=1e-20)


BRISTLES = sp.BristleFriction(0.5, 0.4, 1e4, 10.0)
TWINS = [
    *(((C_LAW, slip), (TWIN, slip), MOVES) for slip in (models.FRICTION, BRISTLES)),
    *(((C_LAW, OWN), (TWIN, SMOOTH), moves) for moves in (SLOW, MOVES, 0 * MOVES)),
]


@pytest.mark.parametrize(("own", "twin", "moves"), TWINS)
def test_derivatives_are_those_of_the_twin(own, twin, moves) -> None:
    scenes = [models.on_plate(models.ball(), *one) for one in (own, twin)]
    if moves.any():
        assert_derivatives(scenes[0], BALL, moves)
    found, exact = (
        scene.dynamics_derivatives(
            BALL, moves, np.zeros(6), parameters=[f"ball-plate.law.{name}" for name in names]
        )
        for scene, names in zip(scenes, (["k", "b"], ["stiffness", "dissipation"]), strict=True)
    )
    for name in ("by_q", "by_v", "by_parameters"):
        a, b = getattr(found, name), getattr(exact, name)
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-7 * np.abs(b).max())


@pytest.mark.parametrize(
    ("own", "twin", "error"),
    [
        ((C_LAW, None), (TWIN, None), 1e-9),
        ((TABLE, None), (SPRING, None), 1e-6),
        ((TWIN, OWN), (TWIN, SMOOTH), 1e-8),
    ],
)
def test_a_run_is_that_of_the_twin_and_keeps_its_energy(own, twin, error) -> None:
    scenes = (models.on_plate(models.ball(), *one) for one in (own, twin))
    given = sp.Adaptive(1e-10), BALL, MOVES, 0.2
    ours, theirs = (models.run(scene, *given, record_dt=1e-3) for scene in scenes)
    np.testing.assert_allclose(ours.q, theirs.q, rtol=0, atol=error)
    assert np.abs(ours.energy.residual).max() < 1e-8
    assert (ours.energy.friction_loss[-1] > 1e-4) == (own[1] is not None)


@pytest.mark.parametrize("make", [lambda: C_LAW, python_law], ids=["C", "python"])
def test_rollouts_vary_its_numbers_over_threads(make) -> None:
    stiff = [5e5, 1e6, 2e6, 4e6]
    runs, exact = (
        sp.Simulation(models.on_plate(models.slider(), law)).rollout(
            [[0.0505]] * 4, None, 0.05, vary={f"ball-plate.law.{name}": stiff}, threads=2
        )
        for law, name in ((make(), "k"), (TWIN, "stiffness"))
    )
    assert not runs.failures
    np.testing.assert_allclose(runs.q, exact.q, rtol=0, atol=1e-12)


def test_exceptions_of_a_python_function_pass() -> None:
    def fails(depth, gap_rate, parameters):
        raise KeyError("own fault")

    scene = models.on_plate(models.slider(), python_law(fails, {}))
    with pytest.raises(KeyError, match="own fault"):
        scene.external_forces([0.049], [0.0])
    runs = sp.Simulation(scene).rollout([[0.049]] * 3, None, 0.01, threads=2)
    assert len(runs.failures) == 3
    assert "own fault" in str(runs.failures[0])


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_no_number_is_refused(wrong) -> None:
    for law, what in (
        (sp.FunctionLaw(FORCE(lambda depth, rate, p: wrong)), "force"),
        (python_law(lambda depth, rate, p: wrong, {}), "force"),
        (sp.FunctionLaw(FORCE(force), ENERGY(lambda depth, p: wrong), NUMBERS), "energy"),
    ):
        simulation = sp.Simulation(models.on_plate(models.slider(), law))
        said = rf"the {what} of a FunctionLaw is {wrong} at dep"
        with pytest.raises(errors.SphshellError, match=said):
            simulation.run([0.0499], None, 0.01)
    friction = sp.FunctionFriction(FORCE(lambda slip, normal, p: wrong))
    scene = models.on_plate(models.ball(), TWIN, friction)
    with pytest.raises(errors.SphshellError, match=f"FunctionFriction is {wrong} at slip speed"):
        scene.external_forces(BALL, MOVES)
    for answer, said in (("a", "returns 'a'"), (10**5000, "returns a larger one")):
        with pytest.raises(errors.InvalidParameter, match=f"{said}, must return a number"):
            python_law(lambda depth, rate, p, answer=answer: answer, {}).normal_force(1.0)


def test_friction_that_follows_from_the_load_by_no_coefficient() -> None:
    """Adhesion: a part of the force that is there whatever the load."""
    size = FORCE(lambda slip, normal, p: (p[0] + 0.2 * normal) * min(slip / 0.01, 1.0))
    own = sp.FunctionFriction(size, {"adhesion": 3.0})
    scene = models.on_plate(models.ball(), TWIN, own)
    contacts = scene.contacts(BALL, MOVES)
    (normal,), (friction,) = contacts.normal_force, contacts.friction_force_world
    assert np.linalg.norm(friction) == pytest.approx(3.0 + 0.2 * normal, rel=1e-12)
    assert own.coefficient(1.0, 10.0) == pytest.approx(0.5)
    names = ["ball-plate.friction.adhesion"]
    slopes = scene.dynamics_derivatives(BALL, MOVES, np.zeros(6), parameters=names)
    # Of 1 N more of it.
    pushed = scene.model.inertias[1].mass * slopes.by_parameters[:3, 0]
    np.testing.assert_allclose(pushed, friction / np.linalg.norm(friction), rtol=0, atol=1e-6)


def test_friction_that_drives_is_none_and_one_at_rest_is_warned_of() -> None:
    scene = models.on_plate(models.ball(), TWIN, sp.FunctionFriction(FORCE(lambda s, n, p: -n)))
    assert not scene.contacts(BALL, MOVES).friction_force_world.any()
    constant = sp.FunctionFriction(FORCE(lambda s, n, p: 0.3 * n))
    with pytest.warns(errors.SetupWarning, match="does not vanish at rest"):
        models.on_plate(models.ball(), TWIN, constant)


def test_a_law_that_cannot_carry_the_load_is_refused_at_once() -> None:
    calls = []
    law = python_law(lambda depth, rate, p: calls.append(depth) or 0.0, {})
    with pytest.raises(errors.SphshellError, match="force of a law stays below 1 at any depth"):
        law.depth_at(1.0)
    with pytest.raises(errors.SphshellError, match="energy of a law stays below 2 at any depth"):
        law.depth_of(2.0)
    assert len(calls) < 3000


def test_the_energy_of_noise_takes_no_longer_than_that_of_jumps() -> None:
    rng, calls = random.Random(1), []
    law = python_law(lambda depth, rate, p: calls.append(depth) or rng.random(), {})
    assert law.energy(1e-3) == pytest.approx(0.5e-3, rel=0.2)
    assert len(calls) < 100_000


def test_a_scene_that_is_changed_during_its_run_has_no_result() -> None:
    def controller(t, q, v, contacts):
        if t > 0.005 and len(scene.pairs) == 1:
            pair = scene.pairs[0]
            scene.add_contact(pair.side_i.sphere, pair.side_j.shell, law=TWIN, name="later")
        return [0.0]

    scene = models.on_plate(models.slider(), TWIN)
    with pytest.raises(errors.SphshellError, match="contacts were changed during the run"):
        sp.Simulation(scene).run([0.0499], None, 0.02, controller=controller)


def test_copies_and_pickles() -> None:
    assert copy.deepcopy(C_LAW) == copy.copy(C_LAW) == C_LAW
    assert hash(copy.copy(C_LAW)) == hash(C_LAW)
    law = C_LAW.changed(k=2e6)
    assert (law.k, C_LAW.k) == (2e6, 1e6)
    assert "k 2e+06" in law.text
    with pytest.raises(errors.NotPicklable, match="C function"):
        pickle.dumps(models.on_plate(models.ball(), C_LAW))
    again = pickle.loads(pickle.dumps(python_law()))
    assert again == python_law()
    assert again.normal_force(1e-3) == pytest.approx(TWIN.normal_force(1e-3))


def cycle() -> weakref.ref[object]:
    """Return what tells whether a function lives whose law's scene it knows."""

    def knows_its_scene(depth, gap_rate, parameters):
        return 1e5 * depth * len(held)

    held = [models.on_plate(models.slider(), python_law(knows_its_scene, {}))]
    held[0].external_forces([0.049], [0.0])
    return weakref.ref(knows_its_scene)


def test_functions_live_as_long_as_the_core_and_cycles_are_collected() -> None:
    core = python_law()._binding
    alive = cycle()
    gc.collect()
    assert alive() is None
    assert core.force(1e-3, 0.0) == pytest.approx(TWIN.normal_force(1e-3))


def test_a_scenario_names_functions_which_looking_does_not_execute(tmp_path) -> None:
    code = f"import math\nopen({str(tmp_path / 'ran')!r}, 'a').close()\n"
    (tmp_path / "own.py").write_text(code + inspect.getsource(force) + inspect.getsource(size))
    text = DROP.replace(LAW_LINE, f"{LAW}\n{FRICTION}")
    path = write(tmp_path, text)
    with pytest.warns(errors.SlowLawWarning):
        built = build(path, {"run.duration": "0.01"})
    (pair,) = built.scene.pairs
    assert isinstance(pair.law, sp.FunctionLaw)
    assert isinstance(pair.friction, sp.FunctionFriction)
    assert (pair.law.parameters, pair.friction.parameters) == (NUMBERS, SLIP)
    run_built(built, tmp_path / "out", recording=False, figures=False)
    starts, speeds = [built.q0] * 2, [[0.1, 0.0, -0.2, 0.0, 0.0, 0.0]] * 2
    mu = {"ball-plate.friction.mu": [0.1, 0.5]}
    runs = built.simulation.rollout(starts, speeds, 0.02, vary=mu)
    assert runs[0].v[-1][0] > runs[1].v[-1][0]
    (tmp_path / "ran").unlink()
    replay = Replay(tmp_path / "out" / "run.npz")
    assert not (tmp_path / "ran").exists()
    with pytest.raises(errors.SphshellError, match=r"law\.function: 'own.py:force' was not loaded"):
        replay.scene.pairs[0].law.normal_force(1e-3)
    with pytest.raises(errors.ScenarioError, match="no such file") as caught:
        build(write(tmp_path, text.replace("own", "other")))
    assert caught.value.key == "contact.ball-plate.law.function"


@pytest.mark.parametrize("rate", [0.0, 1e-9, -1e-5])
def test_slopes_near_rest_are_not_those_of_rounding(rate) -> None:
    """A law that is known to a micronewton has its damping at rest, too."""
    law = python_law(lambda depth, speed, _: round(1e4 * depth - 500.0 * speed, 6), {})
    scene = models.on_plate(models.slider(), law)
    by_depth, by_rate = scene.contact_derivatives([0.049], [rate])
    assert by_depth[0, 0] == pytest.approx(-1e4, rel=1e-2)
    assert by_rate[0, 0] == pytest.approx(-500.0, rel=1e-2)
