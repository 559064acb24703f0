"""What becomes of a signal on its way to the controller: filter, sampling, noise, range, delay."""

import csv

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import _core
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.scenario.running.run import write_sensors
from tests import models
from tests.results import assert_same_bits
from tests.texts import text_of

BALL = "ball_joint"


def torque(name="torque", **more):
    """Sensor of the force that drives the slider."""
    return sp.JointTorqueSensor(name=name, joint=BALL, **more)


def slider(integrator, sensors):
    return sp.Simulation(sp.Scene(models.slider(gravity=0.0)), integrator, sensors)


def sine(frequency, amplitude=3.0):
    return lambda t, q, v, contacts: [amplitude * np.sin(2 * np.pi * frequency * t)]


@pytest.mark.parametrize("steps_over_tau", [0.02, 0.1, 0.3, 0.7, 3.0])
@pytest.mark.parametrize("slope", [0.0, 5.0])
def test_the_filter_follows_a_parabola_exactly(steps_over_tau, slope):
    """The torque of a weight on a horizontal slide: b t + c t^2 with gravity's share `slope`."""
    dt = 1e-3
    tau = dt / steps_over_tau
    model = models.empty()
    model.gravity.linear = np.array([slope, 0.0, -9.81])
    models.add_body(model, "weight", pin.JointModelPX(), inertia=pin.Inertia.FromSphere(2.0, 0.05))
    cutoff = 1 / (2 * np.pi * tau)
    sensor = sp.ForceTorqueSensor(name="wrist", frame="universe", rate=1 / dt, cutoff=cutoff)
    # Fixed steps take it for linear between their ends.
    integrator = sp.Adaptive(1e-9) if slope else sp.SemiImplicitEuler(dt)
    result = sp.Simulation(sp.Scene(model), integrator, [sensor]).run([0.1], [1.5], 20 * dt)
    log = result.sensors["wrist"]
    t, gone = log.sampled, -np.expm1(-log.sampled / tau)
    place = 0.1 + 1.5 * (t - tau * gone) + 0.5 * slope * (t**2 - 2 * tau * t + 2 * tau**2 * gone)
    assert len(t) > 15
    assert log.values[:, 4] == pytest.approx(-2.0 * 9.81 * place, abs=1e-11)


def test_the_filter_misses_no_impact():
    """Of a blow between two samples, the filtered signal keeps the impulse.

    A tip of a quarter of the mass, with a sensor between the two.
    """
    model = pin.buildModelFromXML(text_of("robots/hammer.urdf"))
    scene = models.on_plate(model, sp.ImpactLaw(1e9, 1.5))
    sensor = sp.ForceTorqueSensor(name="wrist", frame="mount", rate=1000, cutoff=30)
    duration = 0.12
    result = sp.Simulation(scene, sp.Adaptive(), [sensor]).run([0.0501], [-1.0], duration)
    contact = result.stats.pairs["ball-plate"]
    assert contact.touches == 1
    assert contact.contact_time < 1e-3
    impulse = result.v[-1, 0] + 1.0 + 9.81 * duration
    # Tip: m (a + g) = F + N, body and tip: a + g = N.
    expected = -0.75 * impulse
    assert abs(result.sensors["wrist"].values[:, 2].sum() / 1000 / expected - 1) < 1e-3


@models.every_integrator(1e-4, 1e-6, 1e-5)
def test_sensors_do_not_change_the_motion(integrator):
    friction = sp.BristleFriction(0.5, 0.4, 1e4, 10.0)
    scene = models.on_plate(models.arm(), sp.HuntCrossleyLaw(1e6, 1.5, 0.2), friction)
    path = [(0.3, 0.1, 0.04), (0.35, 0.1, 0.04)]
    controller = sp.CartesianImpedance("ball", path, 900.0, 30.0)
    sensors = [
        sp.ForceTorqueSensor(name="a", frame="two_joint", rate=700, cutoff=100, delay=1e-3),
        sp.ForceTorqueSensor(name="b", frame=BALL, rate=331, force_noise=1.0),
        sp.ContactSwitch(name="c", contact="ball-plate", threshold=0.1),
    ]
    results = []
    for record_dt in (None, 7e-3):
        for some in ([], sensors):
            simulation = sp.Simulation(scene, integrator, some)
            results.append(simulation.run(models.ARM_Q, None, 0.1, controller, record_dt=record_dt))
        plain, measured = results[-2:]
        assert_same_bits(plain, measured)
        assert plain.sensors == {}
    assert results[1].stats.pairs["ball-plate"].touches > 0


def noisy(**more):
    return sp.ForceTorqueSensor(name="wrist", frame=BALL, force_noise=0.5, torque_noise=0.1, **more)


def test_the_same_seed_gives_the_same_bits():
    def values(seed, **more):
        simulation = slider(sp.Adaptive(), [noisy(seed=seed)])
        return simulation.run([0.0], None, 0.5, sine(3.0), **more).sensors["wrist"].values

    first = values(4)
    assert np.array_equal(first, values(4))
    # It is that of the sample, however the rows are recorded.
    assert np.array_equal(first, values(4, record_dt=0.1))
    assert not np.array_equal(first, values(5))
    assert abs(first[:, :2].std() - 0.5) < 0.05
    assert abs(first[:, 3:].std() - 0.1) < 0.01


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_rollouts_have_the_bits_of_runs(threads):
    simulation = slider(sp.SemiImplicitEuler(1e-3), [noisy(cutoff=50, delay=3e-3)])
    starts = [[0.1 * k] for k in range(6)]
    controller = sp.JointPD(kp=50, kd=1, q_ref=[0.0])
    rollout = simulation.rollout(starts, None, 0.3, threads, controller=controller)
    for start, result in zip(starts, rollout, strict=True):
        alone = simulation.run(start, None, 0.3, controller).sensors["wrist"]
        assert np.array_equal(result.sensors["wrist"].values, alone.values)
        assert np.array_equal(result.sensors["wrist"].t, alone.t)
    assert len(alone) == 298


def test_sensors_vary_from_run_to_run():
    simulation = slider(sp.Adaptive(), [noisy(), torque()])
    vary = {"sensors.wrist.seed": range(3), "sensors.torque.delay": np.array([0.0, 0.01, 0.02])}
    rollout = simulation.rollout([0.0], None, 0.05, vary=vary)
    for seed, delay, result in zip(*vary.values(), rollout, strict=True):
        alone = slider(sp.Adaptive(), [noisy(seed=seed), torque(delay=delay)])
        for name, log in alone.run([0.0], None, 0.05).sensors.items():
            assert np.array_equal(log.values, result.sensors[name].values)
            assert np.array_equal(log.t, result.sensors[name].t)
    for key, values in vary.items():
        assert list(rollout.varied[key]) == rollout.to_dataframe()[key].tolist() == list(values)
    for wrong, error, said in (
        ({"frame": ["a"]}, NameNotFound, r"no parameter 'sensors.wrist.frame'"),
        ({"rate": [1, -1]}, InvalidParameter, r"of run 1'?.* = -1 cannot be taken: rate"),
    ):
        with pytest.raises(error, match=said):
            simulation.rollout([0.0], vary={f"sensors.wrist.{k}": one for k, one in wrong.items()})


def test_readings_saturate_at_the_range():
    sensors = [torque("whole"), torque("cut", range=1.5)]
    result = slider(sp.Adaptive(), sensors).run([0.0], None, 0.5, sine(7.0))
    whole, cut = (result.sensors[name].values for name in ("whole", "cut"))
    assert np.abs(whole).max() > 2.9
    assert np.array_equal(cut, np.clip(whole, -1.5, 1.5))


@pytest.mark.parametrize("integrator", [sp.Adaptive(), sp.SemiImplicitEuler(1e-3)])
@pytest.mark.parametrize("delay", [0.0, 2e-3, 4.3e-3, 0.05])
def test_a_reading_arrives_after_its_delay(integrator, delay):
    """The controller knows what was sampled so long ago, and no more."""
    seen = []

    def tau(t, q, v, contacts, sensors):
        seen.append((t, sensors["torque"], sensors["now"]))
        return [1.0 + t]

    sensors = [torque(rate=500, delay=delay), torque("now", rate=500)]
    result = slider(integrator, sensors).run([0.0], None, 0.1, tau, control_dt=1e-3)
    log = result.sensors["torque"]
    assert np.array_equal(log.t, log.sampled + delay)
    assert np.allclose(log.sampled, np.arange(len(log)) / 500, rtol=0, atol=1e-15)
    assert len(log) == int((0.1 - delay + 1e-9) * 500) + 1
    assert len(seen) == 100
    for t, late, now in seen[1:]:
        if t + 1e-12 >= delay:
            assert late == log.at(t + 1e-12)[0]
        assert now == result.sensors["now"].at(t + 1e-12)[0]
    # Held torques change after the samples of the same time are taken.
    held = np.floor(log.sampled * 1000 - 0.5) / 1000
    assert np.allclose(log.values[1:, 0], 1 + held[1:], rtol=0, atol=1e-12)


def test_before_the_first_reading_the_robot_is_held_still():
    """Without acceleration, as brakes hold it: then the weight is all that is read."""
    seen = []

    def tau(t, q, v, contacts, sensors):
        seen.append(sensors["torque"])
        return [0.0]

    scene = sp.Scene(models.slider())
    simulation = sp.Simulation(scene, sp.SemiImplicitEuler(1e-3), [torque(delay=5e-3)])
    result = simulation.run([0.0], None, 0.01, tau)
    assert np.allclose(seen[:5], 9.81)
    assert np.allclose(seen[6:], 0)
    assert np.allclose(result.sensors["torque"].values, 0)


@pytest.mark.parametrize("integrator", [sp.Adaptive(), sp.SemiImplicitEuler(1e-5)])
def test_a_switch_closes_at_its_threshold_and_opens_below_its_release(integrator):
    scene = models.on_plate(models.slider(gravity=0.0), models.linear_law(1e4))
    sensors = [
        sp.ContactSwitch(name="plain", contact="ball-plate", threshold=2.0, rate=1000),
        sp.ContactSwitch(name="hysteresis", frame="ball", threshold=2.0, release=1.0, rate=1000),
    ]
    seen = []

    def tau(t, q, v, contacts, sensors):
        seen.append(sensors["plain"])
        return [0.0]

    # Half a period of a mass on a spring: the force is v sqrt(k m) sin(sqrt(k/m) t).
    simulation = sp.Simulation(scene, integrator, sensors)
    result = simulation.run([0.05], [-0.04], 0.035, tau, control_dt=1e-3)
    t = result.sensors["plain"].t
    force = np.clip(4 * np.sin(100 * t), 0, None)
    assert np.array_equal(result.sensors["plain"].values[:, 0], force > 2)
    held = (force > 2) | ((force >= 1) & (t > 0.01) & (t < np.pi / 100))
    assert np.array_equal(result.sensors["hysteresis"].values[:, 0], held)
    assert 0 < (force > 2).sum() < held.sum()
    assert seen[1:] == [bool(closed) for closed in force[1:-1] > 2]


@pytest.mark.parametrize("integrator", [sp.Adaptive(), sp.RungeKutta4(1e-3)])
def test_samples_between_steps(integrator):
    """A rate that fits no step: values within the error of the interpolation."""
    simulation = slider(integrator, [torque(rate=731.0)])
    controller = sp.JointPD(kp=100, kd=0, q_ref=[0.0], gravity_compensation=False)
    result = simulation.run([0.1], None, 0.5, controller)
    log = result.sensors["torque"]
    assert len(log) == 366
    expected = -10 * np.cos(10 * log.t)
    assert np.abs(log.values[:, 0] - expected).max() < 2e-4


def test_an_open_run_gives_the_readings_of_its_pieces():
    simulation = slider(sp.SemiImplicitEuler(1e-3), [noisy(rate=250, delay=6e-3, cutoff=60)])
    controller = sp.JointPD(kp=100, kd=1, q_ref=[0.0])
    whole = simulation.run([0.1], None, 0.2, controller).sensors["wrist"]
    run = OpenRun(simulation, [0.1], record_dt=1e-3, controller=controller)
    assert len(run.snapshot().sensors["wrist"]) == 0
    parts = [run.advance(0.05).sensors["wrist"] for _ in range(4)]
    assert np.array_equal(np.concatenate([one.values for one in parts]), whole.values)
    assert np.array_equal(np.concatenate([one.t for one in parts]), whole.t)


@pytest.mark.parametrize(
    ("integrator", "sensors", "error", "said"),
    [
        (sp.SemiImplicitEuler(1e-3), [torque()], NameNotFound, r"no sensor 'wrist'.*torque"),
        (sp.SemiImplicitEuler(1e-3), [], NameNotFound, "no sensor 'wrist'"),
        (sp.Adaptive(), [torque()], InvalidParameter, "control_dt = None must be given for a con"),
    ],
)
def test_what_a_controller_cannot_read_is_named(integrator, sensors, error, said):
    wrong = lambda t, q, v, contacts, sensors: sensors["wrist"]  # noqa: E731
    with pytest.raises(error, match=said):
        slider(integrator, sensors).run([0.0], None, 0.01, wrong)


def two_sensors():
    sensors = [noisy(rate=100), torque(rate=150, delay=1e-3)]
    return slider(sp.Adaptive(), sensors).run([0.0], None, 0.1, sine(5.0))


def test_readings_are_columns(tmp_path):
    result = two_sensors()
    columns = result.sensor_columns()
    assert list(columns)[:2] == ["t [s]", "wrist.force_x [N]"]
    assert list(columns)[-1] == "torque.force [N]"
    write_sensors(tmp_path / "sensors.csv", result)
    with open(tmp_path / "sensors.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(result.sensors["wrist"]) + len(result.sensors["torque"])
    for name, column in (("wrist", "force_z [N]"), ("torque", "force [N]")):
        log = result.sensors[name]
        found = [(r["t [s]"], r[f"{name}.{column}"]) for r in rows if r[f"{name}.{column}"]]
        at = log.columns.index(column)
        assert [float(t) for t, _ in found] == log.t.tolist()
        assert [float(x) for _, x in found] == log.values[:, at].tolist()
    frame = result.sensors["torque"].to_dataframe()
    assert list(frame) == ["t [s]", "sampled [s]", "force [N]"]
    assert frame["force [N]"].tolist() == result.sensors["torque"].values[:, 0].tolist()


def test_readings_are_drawn():
    figure = two_sensors().plot("sensors")
    titles = [axis.get_title(loc="left") for axis in figure.axes]
    assert titles == ["wrist", "wrist", "torque"]
    assert [len(axis.lines) for axis in figure.axes] == [3, 3, 1]
    empty = slider(sp.Adaptive(), []).run([0.0], None, 0.1).plot("sensors")
    assert empty.axes[0].texts[0].get_text() == "no sensors"


def splitmix(x):
    mask = (1 << 64) - 1
    x = (x + 0x9E3779B97F4A7C15) & mask
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & mask
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & mask
    return x ^ (x >> 31)


def test_noise_is_the_same_on_every_machine():
    """Integers alone decide, and one division that IEEE 754 rounds."""
    for seed, sample, value in ((0, 0, 0), (1, 2, 3), (2**64 - 1, 10**6, 5)):
        key = splitmix(splitmix(splitmix(seed) ^ sample) ^ value)
        total = sum(bin(splitmix(key ^ splitmix(i))).count("1") for i in range(4)) - 128.0
        rest = splitmix(key ^ splitmix(4))
        total += (rest >> 32) * 2.0**-32 - (rest & 0xFFFFFFFF) * 2.0**-32
        assert _core.normal_noise(seed, sample, value) == total / 8.010409893800427
