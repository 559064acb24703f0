"""Charts of the live page in a real browser: what is chosen is drawn, read, and compared."""

import re

import numpy as np
import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.view.live import Live
from tests.scenario.files import FINGER, write
from tests.view.test_live_in_browser import Tab

pytestmark = pytest.mark.browser


@pytest.fixture
def tab(browser, tmp_path):
    # Its motion as stated is never over: Reset does not become Repeat, which would set it going.
    path = write(tmp_path, re.sub(r"duration = .*", "duration = 100.0", FINGER))
    with Live(LiveRun(build(path)), running=False) as live:
        opened = Tab(browser, live, viewport={"width": 1200, "height": 700})
        opened.wait("chart.run.keys.length")
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
    tab.page.evaluate("document.getElementById('step-size').value = '0.1'")
    tab.click("#step")
    tab.wait("state.t > 0.05")
    # Chosen after the step: what was recorded is shown all the same.
    tab.page.select_option("#quantity", "Joint position [deg]")
    tab.wait("chart.curves.every((one) => chart.run.keys.includes(one.key))")
    joints = ["q.knuckle", "q.middle_joint", "q.distal_joint"]
    assert tab.page.evaluate("chart.run.keys") == joints
    t, angle = tab.page.evaluate("chart.run.rows[0].slice(0, 2)")
    assert t < 0.02
    assert angle == pytest.approx(np.rad2deg(0.3), abs=1.0)
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
    # Both runs are compared at the same simulated time.
    before = tab.points("q.knuckle")
    tab.reset()
    np.testing.assert_array_equal(tab.points("q.knuckle", "ghost"), before)
