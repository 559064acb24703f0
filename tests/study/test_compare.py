"""Runs over each other: differences against closed forms, names matched, times interpolated."""

from dataclasses import replace

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.result.result_parts import Origin
from sphshell_pin.errors import InvalidParameter, ResultError
from sphshell_pin.plot.compare import plot_compare
from sphshell_pin.study.compare import Curve, Measured, compare, measured
from tests.command import refused, succeed
from tests.scenario.files import write

pytestmark = pytest.mark.usefixtures("no_pictures")


def run(label, t, values, figures=None, curves=("force",)):
    curve = Curve(np.asarray(t, dtype=float), np.asarray(values, dtype=float), "N")
    figures = {name: (value, "N") for name, value in (figures or {}).items()}
    return Measured(label, figures, dict.fromkeys(curves, curve), {})


def test_curves_on_different_times_are_compared_as_lines():
    """Between rows |10 t| and a constant differ linearly: extremes and mean square are exact."""
    first = run("first", [-0.1, 0, 0.2], [1, 0, 2])
    other = run("other", [-0.05, 0.07, 0.3], [0.25, 0.25, 0.25])
    (curve,) = compare([first, other])[0].curves
    np.testing.assert_array_equal(curve.difference.t, [-0.05, 0, 0.07, 0.2])
    np.testing.assert_allclose(curve.difference.values, [-0.25, 0.25, -0.45, -1.75], atol=1e-15)
    assert (curve.largest, curve.at) == (1.75, 0.2)
    # The integral of (0.25 - |s|)^2 from s = 10 t = -0.5 to 2, over its length.
    square = (0.25**3 + 0.25**3) / 3 + (0.25**3 + 1.75**3) / 3
    assert curve.rms == pytest.approx(np.sqrt(square / 2.5), rel=1e-14)
    assert curve.of_range == pytest.approx(1.75 / 2)


def test_figures_have_absolute_and_relative_differences():
    first = run("first", [0, 1], [0, 0], {"peak": -2.0, "zero": 0.0, "nan": np.nan})
    other = run("other", [0, 1], [0, 0], {"peak": -1.5, "zero": 1.0, "nan": np.nan})
    peak, zero, unknown = compare([first, other])[0].figures
    assert (peak.absolute, peak.relative, peak.same) == (0.5, 0.25, False)
    assert zero.absolute == 1.0
    assert np.isnan(zero.relative)
    assert unknown.same


def test_runs_without_common_time_have_no_curves():
    early, late = run("early", [0, 1], [0, 1]), run("late", [2, 3], [0, 1])
    assert compare([early, late])[0].curves == ()
    instant = compare([early, run("late", [1, 2], [3, 4])])[0]
    assert (instant.curves[0].largest, instant.curves[0].rms) == (2, 2)


def test_what_one_run_alone_has_is_left_out():
    first = run("first", [0, 1], [0, 1], {"x": 1.0}, ("a", "b"))
    other = run("other", [0, 1], [0, 1], {"y": 1.0}, ("c", "a"))
    (found,) = compare([first, other])
    assert [one.name for one in found.curves] == ["a"]
    assert found.figures == ()
    with pytest.raises(ResultError, match=r"alien.* in common with first"):
        compare([first, run("alien", [0, 1], [0, 1], curves=("z",))])
    with pytest.raises(InvalidParameter, match="two at least"):
        compare([first])


def test_a_run_equals_itself_and_others_are_beside_the_first(finger):
    one = measured("one", finger, finger.scene)
    slower = replace(finger, t=2 * finger.t, q=finger.q)
    other = measured("slower", slower, finger.scene)
    same, late = compare([one, one, other])
    assert all(figure.same for figure in same.figures)
    assert not any(curve.largest for curve in same.curves)
    some = {"q.knuckle", "v.knuckle", "pairs.tip-wall.depth"}
    assert {curve.name for curve in same.curves} >= some
    knuckle = next(curve for curve in late.curves if curve.name == "q.knuckle")
    k = list(finger.scene.model.names).index("knuckle") - 1
    first, second = (np.interp(knuckle.difference.t, n * finger.t, finger.q[:, k]) for n in (1, 2))
    np.testing.assert_allclose(knuckle.difference.values, second - first, atol=1e-15)


def test_joints_without_a_scene_have_numbers(table):
    assert measured("x", replace(table, scene=None), None).curves["q.8"].values[0] == 1.0


def test_settings_that_differ_are_listed_by_their_keys(finger):
    contact = {"name": "tip", "law": {"stiffness": 1e6, "exponent": 1.5}}
    settings = {"run": {"dt": 1e-4}, "contact": [contact], "gravity": [0, 0, -9.81]}
    other = {**settings, "contact": [{**contact, "law": {"stiffness": 2e6, "exponent": 1.5}}]}
    settings["description"] = "what a run is called is not what it is"
    runs = [
        measured(label, replace(finger, origin=Origin("x", stated)), finger.scene)
        for label, stated in (("a", settings), ("b", other))
    ]
    assert compare(runs)[0].settings == (("contact.tip.law.stiffness", 1e6, 2e6),)


def test_a_diverged_run_is_compared_up_to_there(finger):
    q = finger.q.copy()
    q[10:] = np.inf
    part = measured("part", replace(finger, q=q), finger.scene)
    assert part.curves["q.knuckle"].t[-1] == finger.t[9]
    with pytest.raises(ResultError, match="no row of finite numbers"):
        measured("none", replace(finger, q=np.full_like(q, np.nan)), finger.scene)


def test_the_picture_has_every_run_and_its_difference(finger):
    one = measured("one", finger, finger.scene)
    runs = [one, measured("two", finger, finger.scene)]
    figure = plot_compare(runs, compare(runs))
    titles = [axis.get_title(loc="left") for axis in figure.axes]
    name = "pairs.tip-wall.normal_force"
    assert titles[:2] == [name, f"{name}, less that of one"]
    assert [line.get_label() for line in figure.axes[0].lines] == ["one", "two"]
    assert [line.get_label() for line in figure.axes[1].lines] == ["two"]
    assert figure.get_suptitle() == "two beside one"
    assert "[N]" in figure.axes[0].get_ylabel()
    still = [run("still", [0, 1], [0, 0]), run("late", [2, 3], [0, 0])]
    plot_compare(still, compare(still))


def drop(folder, name, **changes):
    out = folder / name
    set_ = [f"--set={key.replace('__', '.')}={value}" for key, value in changes.items()]
    succeed("run", write(folder), "--out", out, "--no-recording", *set_)
    return out


def test_the_command_prints_differences_and_writes_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    soft = drop(tmp_path, "soft")
    stiff = drop(tmp_path, "stiff", run__dt="5e-5", run__duration="0.04")
    printed = succeed("compare", soft, stiff / "run.npz", "--out", tmp_path / "both")
    for words in ("stiff beside soft", "run.duration", "pairs.ball-plate.peak_force [N]"):
        assert words in printed.output
    names = ["compare.png", "curves.csv", "figures.csv"]
    assert sorted(one.name for one in (tmp_path / "both").iterdir()) == names
    assert (tmp_path / "both" / "curves.csv").read_text().splitlines()[1].startswith("stiff,")
    head, *lines = (tmp_path / "both" / "figures.csv").read_text().splitlines()
    assert head == "run,figure,unit,first,other,difference,relative"
    stats = [sp.Result.load(one / "run.npz").stats for one in (soft, stiff)]
    peaks = [one.pairs["ball-plate"].peak_force for one in stats]
    (line,) = (one for one in lines if one.startswith("stiff,pairs.ball-plate.peak_force,"))
    assert [float(one) for one in line.split(",")[3:5]] == peaks
    printed = succeed("compare", soft, soft, "--out", tmp_path / "same", "--no-picture")
    assert "equal to the last bit" in printed.output
    assert "figure" not in printed.output.partition("equal to")[0]


def test_faults_of_compare(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    soft = drop(tmp_path, "soft")
    assert "two at least" in refused("compare", soft)
    assert "none" in refused("compare", soft, tmp_path / "none")
    (tmp_path / "bad.npz").write_bytes((soft / "run.npz").read_bytes()[:2000])
    told = refused("compare", soft, tmp_path / "bad.npz")
    assert "bad.npz: is not a file that Result.save wrote" in told
