"""Many runs over threads: against the same runs one by one, and against closed forms."""

import copy
import os
import pickle
import re
import signal
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import errors
from tests import meshes, models
from tests.results import assert_same_bits

G = 9.81
R = 0.05
BRISTLES = sp.BristleFriction(0.6, 0.5, 1e5, 100.0)
every = models.every_integrator(1e-4, 1e-8, 1e-7)
PAIR = "tip"


def ball_on_plate(friction=models.FRICTION, law=models.LAW) -> sp.Scene:
    return models.on_shell(models.ball(), models.plate(), law, friction, name=PAIR)


def starts(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    q = [models.free_q([x, y, R + 1e-3]) for x, y in rng.uniform(-0.2, 0.2, (count, 2))]
    return np.reshape(q, (count, 7)), rng.uniform(-0.5, 0.5, (count, 6))


def sliding(integrator=None) -> sp.Simulation:
    """A mass that slides up and down over a plate."""
    scene = models.on_shell(models.slider(), models.plate(), models.LAW, name=PAIR)
    return sp.Simulation(scene, integrator or sp.SemiImplicitEuler(1e-3))


@every
@pytest.mark.parametrize("friction", [models.FRICTION, BRISTLES], ids=["coulomb", "bristle"])
def test_each_run_is_the_run_alone(integrator, friction) -> None:
    q0s, v0s = starts(10)
    simulation = sp.Simulation(ball_on_plate(friction), integrator)
    rollout = simulation.rollout(q0s, v0s, 0.05, threads=7, record_dt=1e-2)
    assert (len(rollout), rollout.threads) == (10, 7)
    assert rollout.failures == {}
    for run, (q0, v0) in enumerate(zip(q0s, v0s, strict=True)):
        alone = simulation.run(q0, v0, 0.05, record_dt=1e-2)
        assert_same_bits(rollout[run], alone)
        np.testing.assert_array_equal(rollout.q[run], alone.q[-1])
        np.testing.assert_array_equal(rollout.v[run], alone.v[-1])
        assert rollout.figures[f"{PAIR}.peak_force"][run] == alone.stats.pairs[PAIR].peak_force
        assert rollout.residual[run] == pytest.approx(alone.energy.residual[-1], abs=1e-14)


def test_a_varied_run_is_that_of_the_scene_built_so() -> None:
    rng, count, integrator = np.random.default_rng(1), 4, sp.Adaptive(1e-8)
    turns = [pin.utils.rpyToMatrix(*one) for one in rng.uniform(-0.1, 0.1, (count, 3))]
    poses = [pin.SE3(one, 1e-3 * rng.normal(size=3)) for one in turns]
    values = {
        "law.stiffness": rng.uniform(1e5, 1e6, count),
        "friction.mu_static": rng.uniform(0.3, 0.9, count),
        "friction": [sp.CoulombFriction(1.0, 0.2, 1e-3, 1e-2)] * count,
        "sphere.radius": rng.uniform(0.04, 0.049, count),
        "sphere.offset": 1e-3 * rng.normal(size=(count, 3)),
        "placement": poses,
    }
    q0s, v0s = starts(count)
    vary, record = {f"{PAIR}.{key}": one for key, one in values.items()}, {"record_dt": 5e-3}
    simulation = sp.Simulation(ball_on_plate(), integrator)
    rollout = simulation.rollout(q0s, v0s, 0.05, vary=vary, **record)
    for run in range(count):
        stiffness, mu, _, radius, offset, pose = (one[run] for one in values.values())
        law = replace(models.LAW, stiffness=stiffness)
        friction = sp.CoulombFriction(mu, 0.2, 1e-3, 1e-2)
        more = {"radius": radius, "offset": offset, "placement": pose, "name": PAIR}
        scene = models.on_shell(models.ball(), models.plate(), law, friction, **more)
        alone = models.run(scene, integrator, q0s[run], v0s[run], 0.05, **record)
        assert_same_bits(rollout[run], alone)
        assert rollout[run].scene.pairs[0].law == law


def test_controllers_of_ones_own_and_of_the_package() -> None:
    """A force that holds the weight, one short of it by a tenth, a PD controller, and none."""
    simulation = sliding()
    pd = sp.JointPD(100.0, 20.0, q_ref=np.array([1.1]))
    given = [lambda *_: np.array([G]), lambda *_: np.array([0.9 * G]), None, pd]
    held = simulation.rollout([[1.0]] * 4, None, 0.2, controller=given)
    np.testing.assert_allclose(held.v[:3, 0], [0.0, -0.1 * G * 0.2, -G * 0.2], atol=1e-12)
    np.testing.assert_array_equal(held.q[3], simulation.run([1.0], None, 0.2, pd).q[-1])


def test_a_failed_run_is_noted_and_the_rest_kept() -> None:
    def touchy(t, q, v, contacts):  # type: ignore[no-untyped-def]
        if q[0] > 2:
            raise ValueError("too high for me")
        return np.array([1e25 if q[0] > 1 else 0.0])

    starts = [[0.5], [1.5], [2.5], [0.01], [0.6]]
    rollout = sliding().rollout(starts, None, 0.1, controller=touchy)
    assert list(rollout.failures) == [1, 2, 3]
    assert isinstance(rollout.failures[1], errors.SimulationDiverged)
    assert rollout.failures[1].t == rollout.t[1] < 0.1
    assert isinstance(rollout.failures[2], errors.RunFailed)
    assert "ValueError: too high for me" in str(rollout.failures[2])
    assert isinstance(rollout.failures[3], errors.DeepStart)
    with pytest.raises(errors.DeepStart):
        rollout[3]
    for run, height in ((0, 0.5), (4, 0.6)):
        assert rollout.q[run, 0] == pytest.approx(height - 0.5 * G * 0.1 * (0.1 + 1e-3))
    assert np.isnan(rollout.figures[f"{PAIR}.peak_force"][3])


def test_controllers_are_checked_before_anything_runs() -> None:
    asked: list[float] = []
    controllers = [lambda t, q, v, contacts: asked.append(t)] * 199 + [sp.JointPD(-1.0, 1.0)]
    with pytest.raises(errors.InvalidParameter, match="controller of run 199"):
        sliding().rollout(np.full((200, 1), 0.1), None, 0.01, threads=1, controller=controllers)
    assert not asked


def test_what_a_routine_raised_is_told_whole() -> None:
    class Silent(Exception):
        pass

    faults = [ValueError("one,\n  File two,\nthree"), Silent(), KeyboardInterrupt()]

    def controller(t, q, v, contacts):  # type: ignore[no-untyped-def]
        raise faults[int(q[0])]

    rollout = sliding().rollout([[0.5], [1.5], [2.5]], None, 0.01, controller=controller)
    told = [str(why).partition("its routine raised ")[2] for why in rollout.failures.values()]
    assert told == ["ValueError: one, File two, three", "Silent", "KeyboardInterrupt"]


def plate_by_hand(pose_i, pose_j):  # type: ignore[no-untyped-def]
    """Contact of a ball with the plane z = 0, which refuses to look beyond x = 1."""
    x, y, z = pose_i.translation
    if x > 1:
        raise ValueError("too far for me")
    return [[x, y, 0.0]], [[0.0, 0.0, 1.0]], [R - z]


@pytest.mark.parametrize("friction", [models.FRICTION, BRISTLES], ids=["coulomb", "bristle"])
def test_contact_sources_over_threads(friction) -> None:
    scene = sp.Scene(models.ball())
    scene.add_contact_source(plate_by_hand, "ball", "universe", law=models.LAW, friction=friction)
    simulation = sp.Simulation(scene, sp.Adaptive())
    q0s, v0s = starts(6)
    q0s[[1, 4], 0] = 2.0
    rollout = simulation.rollout(q0s, v0s, 0.02, threads=4, record_dt=5e-3)
    assert list(rollout.failures) == [1, 4]
    for run in (0, 2, 3, 5):
        assert_same_bits(rollout[run], simulation.run(q0s[run], v0s[run], 0.02, record_dt=5e-3))


def test_deep_starts_in_a_solid_are_seen_as_run_sees_them() -> None:
    shell = sp.Shell(*meshes.cube(0.4), side="outside")
    scene = models.on_shell(models.ball(), shell, models.LAW)
    q0s = [models.free_q([0, 0, z]) for z in (0.30, 0.24, 0.21, 0.0)]
    simulation = sp.Simulation(scene, sp.Adaptive())
    rollout = simulation.rollout(q0s, None, 1e-3)
    assert list(rollout.failures) == [2, 3]
    for run, failure in rollout.failures.items():
        with pytest.raises(errors.DeepStart, match=re.escape(str(failure))):
            simulation.run(q0s[run], None, 1e-3)


def test_a_law_too_weak_is_told_once() -> None:
    laws = [sp.ImpactLaw(k, 1.0) for k in (1e6, 1e2, 1e2)]
    with pytest.warns(errors.WeakLawWarning, match="in 2 of 3 runs, the first of them run 1"):
        sliding(sp.Adaptive()).rollout([R + 0.01], [-5.0], 0.05, vary={f"{PAIR}.law": laws})


HIGH = [models.free_q([0, 0, 1])] * 3


def law_of(values: object) -> dict[str, object]:
    return {"vary": {f"{PAIR}.law": values}}


def stiffness_of(values: object) -> dict[str, object]:
    return {"vary": {f"{PAIR}.law.stiffness": values}}


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"vary": {"tip.law.stifness": [1.0] * 3}}, "tip.law.stiffness"),
        ({"vary": {"top.law": [None] * 3}}, "tip.law"),
        (stiffness_of([1e5, -1.0, 1e5]), "of run 1"),
        (stiffness_of([1e5, 1e6]), "(3,)"),
        (stiffness_of([10**400] * 3), "3 numbers"),
        ({"vary": {"tip.sphere.offset": [0.0, 0.0, 0.0]}}, "(3, 3)"),
        ({"vary": {"tip.placement": [np.eye(4)] * 3}}, "pinocchio.SE3"),
        (law_of(3), "list of 3 values"),
        (law_of([3, 3, 3]), "is FunctionLaw(function)"),
        ({"vary": {3: [1.0] * 3}}, "map names to n values"),
        ({"q0s": np.zeros((3, 6))}, "(n, 7)"),
        ({"q0s": np.zeros((3, 7))}, "run 0"),
        ({"q0s": [[10**400] * 7]}, "q0s"),
        ({"v0s": np.zeros((2, 6))}, "rows"),
        ({"controller": [None] * 2}, "3, one a run"),
        ({"controller": [None, None, 3]}, "of run 2"),
        ({"threads": 0}, "threads"),
        ({"threads": 100_000}, "1024 at most"),
        ({"q0s": np.empty((0, 7)), "record_dt": -1.0}, "record_dt"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(given, sentence) -> None:
    arguments = {"q0s": HIGH, "duration": 0.1, **given}
    with pytest.raises((errors.InvalidParameter, errors.NameNotFound)) as caught:
        sp.Simulation(ball_on_plate(), sp.Adaptive()).rollout(**arguments)
    assert sentence in str(caught.value)


@pytest.mark.parametrize("count", [0, 30])
def test_progress_grows_to_one(count: int) -> None:
    shares: list[float] = []
    simulation = sp.Simulation(ball_on_plate(), sp.Adaptive())
    rollout = simulation.rollout(*starts(count), 0.2, progress=shares.append)
    assert len(rollout) == count
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


@pytest.mark.usefixtures("keyboard")
def test_ctrl_c_keeps_what_is_done() -> None:
    q0s, v0s = starts(400)
    simulation = sp.Simulation(ball_on_plate(), sp.SemiImplicitEuler(1e-5))

    def interrupt(share: float) -> None:
        if 0 < share < 1 and not pressed:
            pressed.append(share)
            os.kill(os.getpid(), signal.SIGINT)

    pressed: list[float] = []
    with pytest.raises(errors.RolloutInterrupted) as caught:
        simulation.rollout(q0s, v0s, 0.2, threads=2, progress=interrupt)
    rollout = caught.value.rollout
    done = [run for run in range(400) if run not in rollout.failures]
    assert pressed
    assert 0 < len(done) < 400
    first = done[0]
    assert_same_bits(rollout[first], simulation.run(q0s[first], v0s[first], 0.2, record_dt=0.2))


def test_python_goes_on_meanwhile() -> None:
    """Another Python thread counts while the compiled runs hold no interpreter lock."""
    ticks: list[int] = []
    over = threading.Event()

    def count() -> None:
        while not over.is_set():
            ticks.append(len(ticks))
            time.sleep(1e-3)

    thread = threading.Thread(target=count)
    thread.start()
    simulation = sp.Simulation(ball_on_plate(), sp.SemiImplicitEuler(2e-6))
    rollout = simulation.rollout(*starts(8), 0.2, threads=1)
    over.set()
    thread.join()
    # With the lock held it would tick once before each run and once after.
    assert len(ticks) > 2 * len(rollout) + 2


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads Linux's memory figures")
def test_memory_is_that_of_what_is_kept() -> None:
    def resident() -> float:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    simulation = sliding()
    simulation.rollout(np.full((500, 1), 0.1), None, 0.02, threads=2)
    before = resident()
    rollout = simulation.rollout(np.full((5000, 1), 0.1), None, 0.02, threads=2)
    assert len(rollout) == 5000
    assert resident() - before < 5000 * 4096


def test_a_table_of_the_runs() -> None:
    pandas = pytest.importorskip("pandas")
    vary = {
        f"{PAIR}.law.stiffness": [1e5, 2e5, 3e5],
        f"{PAIR}.sphere.offset": np.zeros((3, 3)),
        f"{PAIR}.placement": [pin.SE3.Identity()] * 3,
    }
    rollout = sp.Simulation(ball_on_plate()).rollout(*starts(3), 0.05, vary=vary)
    table = rollout.to_dataframe()
    assert isinstance(table, pandas.DataFrame)
    assert table[f"{PAIR}.law.stiffness"].tolist() == [1e5, 2e5, 3e5]
    assert table[f"{PAIR}.sphere.offset.2"].tolist() == [0.0] * 3
    assert table[f"{PAIR}.max_depth"].tolist() == rollout.figures[f"{PAIR}.max_depth"].tolist()
    assert table["failure"].tolist() == [""] * 3


def test_slices_but_no_copies() -> None:
    rollout = sp.Simulation(ball_on_plate(), sp.Adaptive()).rollout(*starts(3), 0.01)
    assert [one.q[-1].tolist() for one in rollout[1:]] == rollout.q[1:].tolist()
    assert rollout[-1].t.tolist() == [0.0, 0.01]
    with pytest.raises(IndexError):
        rollout[3]
    for attempt in (pickle.dumps, copy.copy, copy.deepcopy):
        with pytest.raises(TypeError, match="to_dataframe"):
            attempt(rollout)
