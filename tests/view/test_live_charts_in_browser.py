"""Charts of the live page in a real browser: what is chosen is drawn, read, and compared."""

import re

import numpy as np
import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.scenario.running.replay import Replay
from sphshell_pin.view.live import Live
from tests.scenario.files import FINGER, write
from tests.view.test_live_in_browser import Tab

pytestmark = pytest.mark.browser

KNOB = (
    '\n[[knob]]\nkey = "controller.kp"\n\n[[knob]]\nkey = "robot.three_link_finger.start.knuckle"\n'
)


class ChartTab(Tab):
    """A page of `live`, which stands still: steps are made by its button."""

    def __init__(self, browser, live):
        super().__init__(browser, live, viewport={"width": 1200, "height": 700})
        self.wait("chart.run.keys.length")
        self.page.evaluate("document.getElementById('step-size').value = '0.1'")

    def choose(self, quantity):
        self.page.select_option("#quantity", quantity)
        self.wait("chart.curves.every((one) => chart.run.keys.includes(one.key))")

    def step(self):
        t = self.page.evaluate("state.t")
        self.click("#step")
        self.wait(f"state.t > {t + 0.05}")

    def reset(self):
        self.click("#reset")
        self.wait("state.t === 0 && chart.ghost")

    def points(self, key, run="run"):
        """Return times and values (n,) of a curve."""
        rows = self.page.evaluate(
            """([key, run]) => {
                const {keys, rows} = chart[run], k = keys.indexOf(key) + 1;
                return rows.map((row) => [row[0], row[k]]);
            }""",
            [key, run],
        )
        return np.array(rows, dtype=float).T


@pytest.fixture(scope="module")
def tab(browser, tmp_path_factory):
    # Its motion as stated is never over: Reset does not become Repeat, which would set it going.
    text = re.sub(r"duration = .*", "duration = 100.0", FINGER) + KNOB
    path = write(tmp_path_factory.mktemp("finger"), text)
    with Live(LiveRun(build(path)), running=False) as live:
        opened = ChartTab(browser, live)
        yield opened
        opened.page.close()
        assert opened.complaints == []


def test_quantities_and_their_curves_can_be_chosen(tab):
    offered = tab.page.locator("#quantity option").all_inner_texts()
    assert offered == [
        "Force [N]",
        "Depth [mm]",
        "Joint position [deg]",
        "Joint velocity [deg/s]",
        "Controller torque [N m]",
        "Sensor wrist [N]",
        "Sensor wrist [N m]",
        "Energy residual [J]",
    ]
    assert tab.page.evaluate("chart.run.keys") == ["normal", "friction"]
    tab.step()
    # Chosen after the step: what was recorded is shown all the same.
    tab.choose("Joint position [deg]")
    joints = ["q.knuckle", "q.middle_joint", "q.distal_joint"]
    assert tab.page.evaluate("chart.run.keys") == joints
    t, angle = tab.points("q.knuckle")
    assert t[0] < 0.02
    assert angle[0] == pytest.approx(np.rad2deg(0.3), abs=1.0)
    tab.page.locator("#curves summary").click()
    boxes = tab.page.locator("#curve-list label")
    assert boxes.all_inner_texts() == ["knuckle", "middle_joint", "distal_joint"]
    boxes.nth(1).click()
    tab.wait("chart.run.keys.length === 2")
    assert tab.page.locator("#curve-legend .key").all_inner_texts() == ["knuckle", "distal_joint"]
    # As many are computed as one of the pages shows.
    assert tab.live._charts.keys == ("q.knuckle", "q.distal_joint")
    tab.page.locator("h1").click()
    assert not tab.page.locator("#curve-list").is_visible()


def test_torques_and_sensors_come_once_they_are_chosen(tab):
    tab.choose("Controller torque [N m]")
    tab.step()
    tab.wait("chart.run.rows.length > 3")
    t, torque = tab.points("torque.knuckle")
    rows = tab.live._charts._history.since(t[-1] - 1e-9)
    assert rows.more["torque"][0, 0] == pytest.approx(torque[-1], rel=1e-6)
    tab.choose("Sensor wrist [N]")
    assert np.isfinite(tab.points("sensor.wrist.force_x")[1][1:]).all()
    tab.choose("Energy residual [J]")
    assert not tab.page.locator("#curves").is_visible()  # there is one curve only
    assert tab.page.evaluate("chart.unit") == "J"


def test_the_mouse_reads_values(tab):
    tab.step()
    tab.choose("Joint position [deg]")
    box = tab.page.locator("#chart").bounding_box()
    tab.page.mouse.move(box["x"] + 60, box["y"] + 50)
    tab.wait("chart.read")
    time, *values = tab.page.evaluate("chart.read")
    shown = float(time.removesuffix(" s"))
    for value, key in zip(values, tab.page.evaluate("chart.run.keys"), strict=True):
        name = key.removeprefix("q.")
        t, angle = tab.points(key)
        number, unit, curve = value.split()
        assert (unit, curve) == ("deg", name)
        assert float(number) == pytest.approx(angle[np.abs(t - shown).argmin()], rel=1e-3)
    tab.page.mouse.move(0, 0)


def test_the_last_run_stays_as_a_ghost_and_a_kept_one_too(tab):
    tab.choose("Joint velocity [deg/s]")
    tab.step()
    t, first = tab.points("v.knuckle")
    tab.reset()
    ghost_t, ghost = tab.points("v.knuckle", "ghost")
    assert set(np.round(t, 6)) <= set(np.round(ghost_t, 6))
    np.testing.assert_allclose(np.interp(t, ghost_t, ghost), first, rtol=1e-6, atol=1e-9)
    assert "last run" in tab.page.locator("#curve-legend").inner_text()
    # Another stiffness: at the same simulated time another curve.
    tab.live.player.change("controller.kp", 0.1)
    tab.step()
    t, second = tab.points("v.knuckle")
    assert np.abs(np.interp(t, ghost_t, ghost) - second).max() > 1.0
    assert tab.page.evaluate("chart.lines(0, 1).filter((one) => one.ghost).length") == 3
    tab.page.evaluate("globalThis.last = chart.ghost")
    tab.page.keyboard.press("k")
    tab.wait("chart.ghost !== last && document.getElementById('compare').value === 'kept'")
    np.testing.assert_allclose(tab.points("v.knuckle", "ghost")[1][: len(second)], second)
    tab.reset()
    tab.reset()
    assert tab.page.evaluate("document.getElementById('compare').value") == "kept"
    assert len(tab.points("v.knuckle", "ghost")[0]) >= len(second)
    tab.page.select_option("#compare", "")
    assert tab.page.evaluate("chart.ghost") is None
    assert "run" not in tab.page.locator("#curve-legend").inner_text()
    # A parameter that restarts is the beginning of another run, too.
    tab.page.select_option("#compare", "last")
    tab.step()
    tab.slide('[data-parameter="robot.three_link_finger.start.knuckle"]', 0.6)
    tab.wait("state.t === 0 && chart.ghost?.rows.length > 3")


def test_a_finished_run_has_its_charts_and_nothing_to_compare_with(browser, tmp_path):
    built = build(write(tmp_path, FINGER))
    result = built.simulation.run(
        built.q0, built.v0, 0.4, built.controller, record_dt=5e-3, record=["torque"]
    )
    result = Replay(type(result)(**vars(result)))
    with Live(result, running=False, speed=1.0) as live:
        tab = ChartTab(browser, live)
        assert not tab.page.locator("#keep").is_visible()
        assert not tab.page.locator("#compare").is_visible()
        tab.slide("#scrubber", 1.0)
        tab.wait("state.t > 0.39")
        tab.choose("Controller torque [N m]")
        tab.wait("chart.run.rows.length > 10")
        t, torque = tab.points("torque.knuckle")
        for end, value in zip(t, torque, strict=True):  # the largest of its hundredth of a second
            piece = np.abs(result.result.t - end) < 0.0101
            recorded = result.result.torque[piece, 0]
            assert np.abs(recorded - value).min() == pytest.approx(0.0, abs=1e-8)
        tab.page.close()
        assert tab.complaints == []
