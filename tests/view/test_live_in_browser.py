"""The live page in a real browser: pixels, clicks, keys, sliders, several tabs, no network."""

import re
from urllib.parse import urljoin

import numpy as np
import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.view.arrows import NORMAL_COLOR
from sphshell_pin.view.live import Live
from tests.scenario.files import FINGER, write
from tests.view.live_player import BallPlayer
from tests.view.test_recording_in_browser import count, is_blue, is_greenish, pixels_of, watch

pytestmark = pytest.mark.browser

LONG = 150_000  # [ms] on machines that draw without a graphics card


class Tab:
    """A browser's tab with the page of `live`."""

    def __init__(self, context, live, **options):
        self.live = live
        self.page = context.new_page(**options)
        self.page.set_default_timeout(LONG)
        self.complaints = watch(self.page, urljoin(live.url, "/"))
        self.page.goto(live.url)
        self.wait("globalThis.state && document.body.classList.contains('ready')")

    def wait(self, expression):
        # Not once per picture, as a tab behind another draws none.
        self.page.wait_for_function(expression, timeout=LONG, polling=50)

    def click(self, selector):
        """Click at once; the mouse would wait for pictures."""
        self.page.evaluate("selector => document.querySelector(selector).click()", selector)

    def state(self, name):
        return self.page.evaluate(f"state.{name}")

    def slide(self, selector, share):
        moved = """([selector, share]) => {
            const slider = document.querySelector(selector);
            slider.value = Math.round(slider.max * share);
            slider.dispatchEvent(new Event("input", {bubbles: true}));
        }"""
        self.page.evaluate(moved, [selector, share])

    def rightwards(self):
        """Return the direction in the world that is rightwards on the screen."""
        right = "it => it.Picture.prototype.direction.call({viewer}, 'right')"
        return np.array(self.page.evaluate(f"import('./scene.js').then({right})"))

    def scene(self):
        """Return the picture (h, w, 3) without the panels that lie over it."""
        # Standing still, it leaves the machine time for the screenshot.
        if self.state("running"):
            self.click("#run")
            self.wait("!state.running")
        hidden = "#status, #legend, #toasts, #notice { visibility: hidden !important; }"
        self.page.add_style_tag(content=hidden)
        return pixels_of(self.page.locator("#stage").screenshot(timeout=LONG))


@pytest.fixture
def opened(browser):
    lives, tabs = [], []
    context = browser.new_context(viewport={"width": 900, "height": 500})

    def open_live(player, **options):
        lives.append(Live(player, **options).start())
        tabs.append(Tab(context, lives[-1]))
        return lives[-1], tabs[-1]

    yield open_live
    context.close()
    for live in lives:
        live.stop()
    for tab in tabs:
        assert tab.complaints == []


def test_ball_shell_and_arrow_are_seen_and_parts_can_be_hidden(opened):
    _, tab = opened(BallPlayer(), running=False)
    tab.page.select_option("#step-size", "0.1")
    tab.click("#step")
    tab.wait("state.t > 0.09 && state.contacts.length")
    seen = tab.scene()
    assert np.count_nonzero(is_blue(seen)) > 100
    assert np.mean(is_greenish(seen)) > 0.03
    assert count(seen, NORMAL_COLOR) > 30
    tab.click("[data-part=arrows]")
    tab.wait("!state.show.arrows")
    assert count(tab.scene(), NORMAL_COLOR) == 0


def test_the_button_and_the_keys(opened):
    live, tab = opened(BallPlayer())
    tab.wait("state.t > 0.1")
    tab.page.locator("#run").click()
    tab.wait("!state.running")
    stopped = live.player.time
    tab.page.wait_for_timeout(300)
    assert live.player.time == stopped
    tab.page.keyboard.press("s")
    tab.wait(f"state.t > {stopped + 5e-4}")  # the page has rounded times
    assert live.player.time == pytest.approx(stopped + 1e-3)
    for key, condition in (
        ("ArrowRight", f"state.t > {stopped + 1.5e-3}"),
        (" ", "state.running"),
        (" ", "!state.running"),
        ("r", "state.t === 0"),
    ):
        tab.page.keyboard.press(key)
        tab.wait(condition)


def test_a_slider_changes_what_the_simulation_uses(opened):
    live, tab = opened(LiveRun(build("sphere_on_shell")))
    law = live.player.scene.pairs[0].law
    stiffness = next(k for k in live.player.parameters if k.label == "stiffness")
    tab.slide(f'[data-parameter="{stiffness.key}"]', 1.0)
    tab.wait(f"state.parameters['{stiffness.key}'] > {2 * stiffness.value}")
    changed = live.player.scene.pairs[0].law.stiffness / law.stiffness
    assert changed == pytest.approx(stiffness.high / stiffness.value, rel=0.01)
    field = tab.page.get_by_label(stiffness.label, exact=True).first
    field.fill("2e5")
    field.press("Enter")
    tab.wait(f"state.parameters['{stiffness.key}'] === 2e5")
    # Keys typed into a field are no commands.
    assert tab.state("running")


def test_a_push_moves_the_ball_and_holding_pushes_on(opened):
    live, tab = opened(BallPlayer())
    tab.page.select_option("#direction", "+y")
    tab.click("#push")
    tab.wait("state.t > 0")
    deadline = live.player.time + 60.0
    while live.player.v[1] <= 0.0 and live.player.time < deadline:
        tab.page.wait_for_timeout(20)
    tab.page.wait_for_timeout(300)
    assert live.player.v[1] == pytest.approx(5.0 * 0.1, rel=0.02)  # 5 N for 0.1 s on 1 kg
    # The camera looks along -x more or less: its right hand is a direction of the world.
    right = tab.rightwards()[:2]
    tab.page.select_option("#direction", "right")
    live.player.v[:] = 0.0
    tab.page.locator("#hold").hover()
    tab.page.mouse.down()
    tab.page.wait_for_timeout(500)
    tab.page.mouse.up()
    tab.page.wait_for_timeout(300)
    velocity = live.player.v[:2].copy()
    tab.page.wait_for_timeout(200)
    np.testing.assert_allclose(live.player.v[:2], velocity, atol=1e-12)
    assert velocity @ right > max(0.5, 0.999 * np.linalg.norm(velocity)) * np.linalg.norm(right)


def test_contacts_of_a_hand_have_names_that_differ(opened):
    _, tab = opened(BallPlayer(), running=False)
    links, rest = ["link_3.0_tip", "link_7.0_tip"], ["thumb", "left/pad", "right/pad", "pad"]
    names = [f"fingers/hand/{one}" for one in links] + rest
    shorten = (
        "names => import('./contacts.js').then(it => names.map(one => it.shorten(one, names)))"
    )
    assert tab.page.evaluate(shorten, names) == links + rest


def test_quantities_and_their_curves_can_be_chosen(opened, tmp_path):
    # Its motion as stated is never over: Reset does not become Repeat, which would set it going.
    path = write(tmp_path, re.sub(r"duration = .*", "duration = 100.0", FINGER))
    live, tab = opened(LiveRun(build(path)), running=False)
    tab.wait("chart.run.keys.length")
    offered = ["Force [N]", "Depth [mm]", "Joint position [deg]", "Joint velocity [deg/s]"]
    offered += ["Controller torque [N m]", "Sensor wrist [N]", "Sensor wrist [N m]"]
    offered += ["Energy residual [J]"]
    assert tab.page.locator("#quantity option").all_inner_texts() == offered
    assert tab.page.evaluate("chart.run.keys") == ["normal", "friction"]
    tab.page.evaluate("document.getElementById('step-size').value = '0.1'")
    tab.click("#step")
    tab.wait("state.t > 0.05")
    # Chosen after the step: what was recorded is shown all the same.
    tab.page.select_option("#quantity", "Joint position [deg]")
    tab.wait("chart.curves.every((one) => chart.run.keys.includes(one.key))")
    assert tab.page.evaluate("chart.run.keys") == ["q.knuckle", "q.middle_joint", "q.distal_joint"]
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
    assert live._charts.keys == ("q.knuckle", "q.distal_joint")
    tab.page.locator("h1").click()
    assert not tab.page.locator("#curve-list").is_visible()
    # Both runs are compared at the same simulated time.
    rows = "run => chart[run].rows.map((row) => row.slice(0, 2))"
    before = tab.page.evaluate(rows, "run")
    tab.click("#reset")
    tab.wait("state.t === 0 && chart.ghost")
    assert tab.page.evaluate(rows, "ghost") == before
