"""A law of one's own does what the law does whose formula it states."""

import copy
import ctypes
import gc
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
from tests.scenario.files import DROP, write

FORCE = ctypes.CFUNCTYPE(
    ctypes.c_double, ctypes.c_double, ctypes.c_double, ctypes.POINTER(ctypes.c_double)
)
ENERGY = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double, ctypes.POINTER(ctypes.c_double))
NUMBERS = {"k": 1e6, "b": 0.5}
TWIN = sp.HuntCrossleyLaw(1e6, 1.5, 0.5)
LAW_LINE = next(line for line in DROP.splitlines() if line.startswith("law"))
STATED = 'law = { type = "function", function = "own.py:force", parameters = { k = 1e6, b = 0.5 } }'


def force(depth, gap_rate, parameters):
    return parameters[0] * depth * math.sqrt(depth) * (1 - parameters[1] * gap_rate)


def energy(depth, parameters):
    return 0.4 * parameters[0] * depth**2.5


C_LAW = sp.FunctionLaw(FORCE(force), ENERGY(energy), NUMBERS)


def python_law(function=force, numbers=NUMBERS):
    with pytest.warns(errors.SlowLawWarning, match=r"numba\.cfunc"):
        return sp.FunctionLaw(function, parameters=numbers)


def numba_law():
    numba = pytest.importorskip("numba")
    compiled = numba.cfunc("float64(float64, float64, CPointer(float64))")(force)
    return sp.FunctionLaw(compiled, parameters=NUMBERS)


KINDS = {
    "ctypes": lambda: C_LAW,
    "python": python_law,
    "numba": numba_law,
}


@pytest.mark.parametrize("kind", KINDS)
def test_it_answers_as_its_twin(kind) -> None:
    law = KINDS[kind]()
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


BALL = np.array([0.01, 0.02, 0.0492, 0, 0, 0, 1.0])
MOVES = np.array([0.1, 0.0, -0.05, 1.0, 2.0, 0.0])


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


@pytest.mark.parametrize("friction", [models.FRICTION, sp.BristleFriction(0.5, 0.4, 1e4, 10.0)])
def test_derivatives_are_those_of_the_twin(friction) -> None:
    own, twin = (models.on_plate(models.ball(), law, friction) for law in (C_LAW, TWIN))
    assert_derivatives(own, BALL, MOVES)
    numbers = (
        ["ball-plate.law.k", "ball-plate.law.b"],
        ["ball-plate.law.stiffness", "ball-plate.law.dissipation"],
    )
    found, exact = (
        scene.dynamics_derivatives(BALL, MOVES, np.zeros(6), parameters=names)
        for scene, names in zip((own, twin), numbers, strict=True)
    )
    for name in ("by_q", "by_v", "by_parameters"):
        ours, theirs = getattr(found, name), getattr(exact, name)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-8 * np.abs(theirs).max())


def test_a_run_is_that_of_the_twin_and_keeps_its_energy() -> None:
    own, twin = (
        sp.Simulation(models.on_plate(models.slider(), law), sp.Adaptive(1e-10)).run(
            [0.051], [-0.1], 0.2, record_dt=1e-3
        )
        for law in (C_LAW, TWIN)
    )
    np.testing.assert_allclose(own.q, twin.q, rtol=0, atol=1e-9)
    assert np.abs(own.energy.residual).max() < 1e-8


@pytest.mark.parametrize("make", [lambda: C_LAW, python_law], ids=["C", "python"])
def test_rollouts_vary_its_numbers_over_threads(make) -> None:
    stiff = [5e5, 1e6, 2e6, 4e6]
    own, twin = models.on_plate(models.slider(), make()), models.on_plate(models.slider(), TWIN)
    runs = sp.Simulation(own).rollout(
        [[0.0505]] * 4, None, 0.05, vary={"ball-plate.law.k": stiff}, threads=2
    )
    exact = sp.Simulation(twin).rollout(
        [[0.0505]] * 4, None, 0.05, vary={"ball-plate.law.stiffness": stiff}
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
    laws = [
        sp.FunctionLaw(FORCE(lambda depth, rate, p: wrong)),
        python_law(lambda depth, rate, p: wrong, {}),
        sp.FunctionLaw(FORCE(force), ENERGY(lambda depth, p: wrong), NUMBERS),
    ]
    for law, what in zip(laws, ("force", "force", "energy"), strict=True):
        simulation = sp.Simulation(models.on_plate(models.slider(), law))
        with pytest.raises(
            errors.SphshellError, match=rf"the {what} of a FunctionLaw is {wrong} at dep"
        ):
            simulation.run([0.0499], None, 0.01)
    with pytest.raises(errors.InvalidParameter, match="function returns 'a', must return a number"):
        python_law(lambda depth, rate, p: "a", {}).normal_force(1.0)
    with pytest.raises(errors.InvalidParameter, match="returns a larger one, must return a number"):
        python_law(lambda depth, rate, p: 10**5000, {}).normal_force(1.0)


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

    def noise(depth, rate, p):
        calls.append(depth)
        return rng.random()

    assert python_law(noise, {}).energy(1e-3) == pytest.approx(0.5e-3, rel=0.2)
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


def test_a_scenario_names_a_function_which_looking_does_not_execute(tmp_path) -> None:
    code = "import math\nopen('ran', 'a').close()\ndef force(d, r, p):\n"
    code += "    return p[0] * d * math.sqrt(d) * (1 - p[1] * r)\n"
    (tmp_path / "own.py").write_text(code.replace("'ran'", repr(str(tmp_path / "ran"))))
    path = write(tmp_path, DROP.replace(LAW_LINE, STATED))
    with pytest.warns(errors.SlowLawWarning):
        built = build(path, {"run.duration": "0.01"})
    law = built.scene.pairs[0].law
    assert isinstance(law, sp.FunctionLaw)
    assert law.parameters == NUMBERS
    run_built(built, tmp_path / "out", recording=False, figures=False)
    (tmp_path / "ran").unlink()
    replay = Replay(tmp_path / "out" / "run.npz")
    assert not (tmp_path / "ran").exists()
    with pytest.raises(errors.SphshellError, match=r"law\.function: 'own.py:force' was not loaded"):
        replay.scene.pairs[0].law.normal_force(1e-3)
    with pytest.raises(errors.ScenarioError, match="no such file") as caught:
        build(write(tmp_path, DROP.replace(LAW_LINE, STATED.replace("own", "other"))))
    assert caught.value.key == "contact.ball-plate.law.function"


@pytest.mark.parametrize("rate", [0.0, 1e-9, -1e-5])
def test_slopes_near_rest_are_not_those_of_rounding(rate) -> None:
    """A law that is known to a micronewton has its damping at rest, too."""
    law = python_law(lambda depth, speed, _: round(1e4 * depth - 500.0 * speed, 6), {})
    scene = models.on_plate(models.slider(), law)
    by_depth, by_rate = scene.contact_derivatives([0.049], [rate])
    assert by_depth[0, 0] == pytest.approx(-1e4, rel=1e-2)
    assert by_rate[0, 0] == pytest.approx(-500.0, rel=1e-2)
