"""Fits: closed forms of values and intervals, coverage, and what the data do not determine."""

import math

import numpy as np
import pytest

pytest.importorskip("scipy")
pytest.importorskip("matplotlib")
from scipy import stats

import sphshell_pin as sp
from sphshell_pin.errors import DataError, InvalidParameter, ScenarioError
from sphshell_pin.scenario import build, read_scenario
from sphshell_pin.scenario.format.reading import find_scenario
from sphshell_pin.study.fit.data import Series
from sphshell_pin.study.fit.report import patterned
from sphshell_pin.study.fit.search import covariance_of
from sphshell_pin.study.quantities import quantities_of, row_step
from tests.study.fitted_sets import SCENARIO, TRUTH, many_sets
from tests.tables import cases_of

STIFFNESS, DISSIPATION, FRICTION = TRUTH
HEIGHT = "q.root_joint.2"
SPEED = "v.root_joint.2"
FORCE = "pairs.tip.normal_force"


def columns_of(path, t, names, changes=None):
    """Run the scenario; return quantities at the times."""
    built = build(path, changes)
    start = built.q0, built.v0, float(t[-1]), built.controller
    result = built.simulation.run(*start, record_dt=row_step(t))
    known = quantities_of(result, built.scene, t, names)
    return {f"{name} [{unit}]": values for name, (unit, values) in known.items()}


def noisy(columns, share, seed=0):
    rng = np.random.default_rng(seed)
    return {
        name: values + share * np.abs(values).max() * rng.normal(size=len(values))
        for name, values in columns.items()
    }


def measured(path, t, names, share=0.02, changes=None):
    """Return noisy data of a run of the scenario."""
    return {"t [s]": t, **noisy(columns_of(path, t, names, changes), share)}


@pytest.mark.parametrize("given", [False, True])
def test_a_straight_line_has_its_closed_form(bounce, given):
    """z = z0 + v0 t - g t^2 / 2 is linear in g: value and interval are those of regression.

    With given deviations, of which half are ten times as small, they are those of weighted
    regression.
    """
    t = np.linspace(0.0, 0.005, 41)
    sigma = np.where(given & (np.arange(41) % 2 == 1), 1e-5, 1e-4)
    z = 0.017 - 0.5 * t - 0.5 * 9.81 * t**2 + sigma * np.random.default_rng(3).normal(size=41)
    data = {"t [s]": t, f"{HEIGHT} [m]": z}
    data |= {f"{HEIGHT}.sigma [mm]": 1e3 * sigma} if given else {}
    found = sp.fit(bounce, data, ["gravity.2"])
    slope, y = 0.5 * t**2 / sigma, (z - 0.017 + 0.5 * t) / sigma
    value = slope @ y / (slope @ slope)
    spread = 1.0 if given else math.sqrt(np.sum((y - value * slope) ** 2) / 40)
    half = stats.t.ppf(0.975, 40) * spread / math.sqrt(slope @ slope)
    one = found["gravity.2"]
    assert found.dof == 40
    assert one.value == pytest.approx(value, rel=1e-6)
    assert (one.low, one.high) == pytest.approx((value - half, value + half), rel=1e-5)
    if not given:
        rms = spread * sigma[0] * math.sqrt(40 / 41)
        assert found.series[0].rms == pytest.approx(rms, rel=1e-6)


def test_the_noise_of_each_column_is_its_own(bounce):
    """Height to 1e-4 m, speed to 1e-2 m/s: the interval is that of regression weighted by both."""
    t, rng = np.linspace(0.0, 0.005, 41), np.random.default_rng(5)
    slopes = {HEIGHT: -0.5 * t**2, SPEED: -t}
    noise = {HEIGHT: 1e-4, SPEED: 1e-2}
    rests = {HEIGHT: 0.017 - 0.5 * t, SPEED: np.full(41, -0.5)}
    data = {"t [s]": t} | {
        f"{name} [{unit}]": rests[name] + 9.81 * slopes[name] + noise[name] * rng.normal(size=41)
        for name, unit in ((HEIGHT, "m"), (SPEED, "m/s"))
    }
    one = sp.fit(bounce, data, ["gravity.2"])["gravity.2"]
    information = sum(np.sum((slopes[name] / noise[name]) ** 2) for name in slopes)
    half = stats.t.ppf(0.975, 81) / math.sqrt(information)
    assert one.high - one.value == pytest.approx(half, rel=0.25)


def test_exact_data_give_back_the_values(bounce):
    t = np.linspace(0.0, 0.12, 301)
    data = {"t [s]": t, **columns_of(bounce, t, [FORCE, "pairs.tip.force_x"])}
    start = {STIFFNESS: 7e4, DISSIPATION: 0.4, FRICTION: 0.15}
    more, counts = {"changes": start, "progress": lambda runs, _: counts.append(runs)}, []
    found = sp.fit(bounce, data, list(TRUTH), **more)
    assert found.converged
    assert list(found.values.values()) == pytest.approx(list(TRUTH.values()), rel=1e-4)
    assert counts == list(range(1, found.runs + 1))
    assert not found.remarks


@pytest.mark.study
@pytest.mark.parametrize("sets", [16, 40])
def test_intervals_hold_the_truth_as_often_as_they_say(sets):
    """The study of docs/fitting.md with few sets: bounds of the binomial at 1 in 1000."""
    values, low, high, _ = zip(*many_sets(sets, first=5000), strict=True)
    truth = np.array(list(TRUTH.values()))
    assert np.abs(np.array(values) / truth - 1.0).mean(axis=0).max() < 0.01
    inside = ((np.array(low) <= truth) & (truth <= np.array(high))).sum(axis=0)
    least = stats.binom.ppf(0.001, sets, 0.95)
    assert (inside >= least).all(), inside


def test_pulses_are_not_laid_on_others():
    """The nearest minimum of this set is off by a half: a bounce lies on another of the data."""
    ((values, *_),) = many_sets(1, first=5, workers=1)
    np.testing.assert_allclose(values, list(TRUTH.values()), rtol=0.01)


def test_noise_has_a_pattern_in_one_of_a_hundred_fits():
    """Whatever its size in time, and in several columns."""
    rng, t = np.random.default_rng(0), np.linspace(0.0, 1.0, 200)
    sizes = 0.1 + np.exp(-((t - 0.5) ** 2) / 0.01)

    def column(memory):
        noise = sizes * rng.normal(size=200)
        noise[1:] += memory * noise[:-1]
        return Series("", "", "N", t, noise, np.zeros(200), np.ones(200), given=False)

    found = sum(bool(patterned([column(0.0), column(0.0)])) for _ in range(1000))
    assert found <= stats.binom.ppf(0.999, 1000, 0.01)
    assert len(patterned([column(0.0), column(0.7)])) == 1


def test_what_a_fit_does_not_explain_is_said(bounce):
    """A linear spring in place of Hertz's: pulses of another shape."""
    data = measured(bounce, np.linspace(0.0, 0.2, 401), [FORCE])
    linear = {"contact.tip.law.exponent": 1.0, STIFFNESS: 1e4}
    found = sp.fit(bounce, data, [STIFFNESS, DISSIPATION], changes=linear)
    assert any(one.startswith(f"the fit does not explain {FORCE} of") for one in found.remarks)


REST = {
    "robot.ball.speed.root_joint": "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]",
    # Where the weight presses it to.
    "robot.ball.start.root_joint.2": repr(0.012 - (0.056458 * 9.81 / 1e5) ** (2 / 3)),
}


@pytest.mark.parametrize("name", [FORCE, "pairs.tip.depth"])
def test_damping_cannot_be_seen_at_rest(bounce, name):
    data = measured(bounce, np.linspace(0.01, 0.2, 191), [name], changes=REST)
    found = sp.fit(bounce, data, [STIFFNESS, DISSIPATION], changes=REST)
    assert not found[DISSIPATION].determined
    begin = f"the data do not determine {DISSIPATION}: "
    assert any(one.startswith(begin) for one in found.remarks)
    assert found[STIFFNESS].determined


def test_what_no_column_feels_is_said(bounce):
    data = measured(bounce, np.linspace(0.0, 0.2, 101), [FORCE])
    found = sp.fit(bounce, data, [STIFFNESS, FRICTION])
    assert found[STIFFNESS].determined
    assert not found[FRICTION].determined
    (remark,) = found.remarks
    assert remark.startswith(f"the data do not determine {FRICTION}: what was measured feels it")
    assert found[FRICTION].value == found[FRICTION].start
    assert np.isnan(found.correlation[0, 1])


def test_two_that_act_as_one_are_named_together(bounce, tmp_path):
    """Hertz's law has both moduli in 1/E* = (1 - nu^2) (1 / E1 + 1 / E2) alone."""
    stated = '{ type = "hunt-crossley", stiffness = 1e5, dissipation = 0.3 }'
    law = '{ type = "hertz", young = 1e6, poisson = 0.4, young_2 = 2e6, poisson_2 = 0.4 }'
    path = tmp_path / "two.toml"
    path.write_text(SCENARIO.replace(stated, law))
    data = measured(path, np.linspace(0.0, 0.1, 101), [FORCE], 0.01)
    keys = ["contact.tip.law.young", "contact.tip.law.young_2"]
    found = sp.fit(path, data, keys)
    assert not found.determined
    assert found.remarks[0].startswith(f"the data do not determine {keys[0]} and {keys[1]} sep")
    one, two = found.values.values()
    assert 1 / one + 1 / two == pytest.approx(1.5e-6, rel=0.02)
    assert sp.fit(path, data, keys[:1]).determined


def test_a_value_at_its_bound_is_said(bounce):
    data = measured(bounce, np.linspace(0.0, 0.2, 401), [FORCE])
    wanted = {STIFFNESS: None, DISSIPATION: (0.35, 0.6)}
    found = sp.fit(bounce, data, wanted, changes={DISSIPATION: 0.4})
    assert found[DISSIPATION].at_bound
    assert found[DISSIPATION].value == 0.35
    assert any("stands at its bound, 0.35 s/m" in one for one in found.remarks)


def test_wrong_deviations_are_said(bounce):
    data = measured(bounce, np.linspace(0.0, 0.1, 201), [FORCE])

    def remarks(share):
        sigma = {f"{FORCE}.sigma [N]": np.full(201, share * data[f"{FORCE} [N]"].max())}
        return sp.fit(bounce, data | sigma, [STIFFNESS]).remarks

    assert not remarks(0.02)
    (remark,) = remarks(0.01)
    assert "times the standard deviations that were given" in remark


def test_experiments_of_their_own_settings_are_fitted_together(bounce):
    """A slow and a fast impact: together they tell the exponent from the stiffness."""
    exponent, speed = "contact.tip.law.exponent", "robot.ball.speed.root_joint"
    t = np.linspace(0.0, 0.05, 101)
    experiments = []
    for k, down in enumerate((0.4, 1.0)):
        changes = {speed: f"[0.0, 0.0, {-down}, 0.0, 0.0, 0.0]"}
        data = noisy(columns_of(bounce, t, [FORCE], changes), 0.01, k)
        experiments.append(sp.Experiment({"t [s]": t, **data}, changes, f"{down} m/s"))
    start = {exponent: 1.3, STIFFNESS: 5e4}
    found = sp.fit(bounce, experiments, [STIFFNESS, exponent], changes=start)
    assert found[exponent].value == pytest.approx(1.5, abs=0.02)
    unit = found[STIFFNESS].unit.removeprefix("N/m^")
    assert float(unit) == pytest.approx(found[exponent].value, abs=1e-3)  # not the start's
    assert {one.experiment for one in found.series} == {"0.4 m/s", "1.0 m/s"}
    assert any("are correlated" in one for one in found.remarks)


def test_keys_with_one_value(bounce):
    both = "contact.tip.friction.mu_static+contact.tip.friction.mu_dynamic"
    same = {"contact.tip.friction.mu_static": "0.2"}
    data = measured(bounce, np.linspace(0.0, 0.1, 201), ["pairs.tip.force_x"], changes=same)
    changes = dict.fromkeys(both.split("+"), 0.1)
    found = sp.fit(bounce, data, [both], changes=changes)
    assert found[both].value == pytest.approx(0.2, rel=0.02)
    path = found.write_scenario(bounce.with_name("fitted.toml"))
    friction = read_scenario(path).contact[0].friction
    assert friction.mu_static == friction.mu_dynamic == pytest.approx(found[both].value)


def test_a_sensor_is_read_as_it_logs(bounce, tmp_path):
    """Its readings are those of the file sensors.csv; its noise is that of the data alone."""
    sensor = '[[sensor]]\ntype = "force-torque"\nname = "wrist"\nframe = "ball"\nrate = 2000.0\n'
    path = tmp_path / "sensed.toml"
    path.write_text(f"{SCENARIO}\n{sensor}delay = 0.001\nforce_noise = 0.3\n")
    built = build(path)
    result = built.simulation.run(built.q0, built.v0, 0.1, record_dt=1e-3)
    data = result.sensor_columns()
    found = sp.fit(path, data, [STIFFNESS], columns=["wrist.force_z"], changes={STIFFNESS: 8e4})
    assert found[STIFFNESS].low < 1e5 < found[STIFFNESS].high
    assert found.series[0].rms == pytest.approx(0.3, rel=0.2)
    late = {"t [s]": [0.0, 0.01, 0.02], "wrist.force_z [N]": [0.0, 0.0, 0.0]}
    with pytest.raises(DataError, match=r"no reading of 'wrist\.force_z' has arrived at 0 s"):
        sp.fit(path, late, [STIFFNESS])


def test_the_run_at_the_start_must_succeed(bounce, monkeypatch):
    deep = {"robot.ball.start.root_joint.2": "0.001"}
    data = {"t [s]": [0.0, 0.1], f"{HEIGHT} [m]": [0.0, 0.1]}
    with pytest.raises(sp.SphshellError, match="starts at depth"):
        sp.fit(bounce, data, [STIFFNESS], changes=deep)

    def fail(*_):
        raise sp.SphshellError("ends early")

    monkeypatch.setattr("sphshell_pin.study.fit.search.Trial.predict", fail)
    with pytest.raises(sp.SphshellError, match="ends early") as caught:
        sp.fit(bounce, data, [STIFFNESS])
    assert caught.value.__notes__ == ["this is the run at the start values"]


def test_what_is_seen_stands_out_from_the_error_of_derivatives():
    """Whatever the units; columns that are parallel but for less than the error are one."""
    rng = np.random.default_rng(0)
    jacobian = rng.normal(size=(50, 3)) * [1.0, 1e6, 1e-6]
    error = 1e-4 * jacobian * rng.normal(size=(50, 3))
    covariance, blind = covariance_of(jacobian, error)
    assert not blind
    np.testing.assert_allclose(covariance, np.linalg.inv(jacobian.T @ jacobian), rtol=1e-6)
    jacobian[:, 2] = 1e-9 * jacobian[:, 1] * (1 + 1e-6 * rng.normal(size=50))
    covariance, blind = covariance_of(jacobian, error)
    assert np.isfinite(np.diag(covariance)).tolist() == [True, False, False]
    assert blind == [[1, 2]]
    # The first is determined whatever the other two do.
    others = jacobian[:, 1:2]
    residual = jacobian[:, 0] - others @ np.linalg.lstsq(others, jacobian[:, 0], rcond=None)[0]
    assert covariance[0, 0] == pytest.approx(1 / (residual @ residual), rel=1e-6)
    # A column of nothing but error takes nothing from the others.
    jacobian[:, 1:] = 1e-3 * rng.normal(size=(50, 2))
    error[:, 1:] = 2e-3 * rng.normal(size=(50, 2))
    covariance, _ = covariance_of(jacobian, error)
    assert np.isfinite(np.diag(covariance)).tolist() == [True, False, False]


# Of a ball in a bowl: pulses of its force are so short that derivatives by its height fail.
IN_BOWL = "pairs.ball-bowl.normal_force"
START = "robot.ball.start.root_joint.2"
SOFT = {"contact.law.k": "2e3", "contact.law.c": "0.2"}


def test_inexact_slopes_keep_the_value_and_are_said():
    """The force alone feels the height, by derivatives that are as long as their error."""
    t = np.linspace(0.0, 0.12, 601)
    exact = columns_of(find_scenario("sphere_on_shell"), t, [IN_BOWL], SOFT)
    start = {"contact.law.k": 3e3, "contact.law.c": 0.3, START: 0.0732}
    data = {"t [s]": t, **noisy(exact, 0.01, 1)}
    found = sp.fit("sphere_on_shell", data, [START], changes=start)
    one, remarks = found[START], " ".join(found.remarks)
    assert not one.determined
    assert one.value != one.start
    assert f"the data do not determine {START}: what was measured feels it no more" in remarks


@pytest.mark.parametrize(
    ("t", "step"),
    [
        ([0.0, 0.1, 0.2], 0.1),
        ([0.1, 0.3, 0.4], 0.1),
        ([0.1, 0.25, 0.3], 0.05),
        ([3e-5], 3e-5),
        ([0.0], 0.0),
        ([0.0, 0.1, 0.1 + 1e-9 * math.pi, 0.3], 0.1 / 8),
    ],
)
def test_rows_lie_at_the_times_of_the_data(t, step):
    assert row_step(np.array(t)) == pytest.approx(step, rel=1e-6)


@pytest.mark.parametrize(("wanted", "said"), cases_of("wrong_fits")["parameters"])
def test_a_wrong_parameter_gets_a_sentence(bounce, wanted, said):
    data = {"t [s]": [0.0, 0.1], f"{HEIGHT} [m]": [0.0, 0.1]}
    with pytest.raises((ScenarioError, InvalidParameter), match=said):
        sp.fit(bounce, data, wanted)
