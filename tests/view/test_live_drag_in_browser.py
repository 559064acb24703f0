"""The mouse on the live page, in a real browser: bodies are dragged, targets and views switched."""

import time

import numpy as np
import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from tests.models import pose_of
from tests.scenario.arms import write_arm
from tests.scenario.files import DROP, write
from tests.texts import text_of
from tests.view.test_live_in_browser import opened  # noqa: F401  (a fixture)

pytestmark = pytest.mark.browser

ON_SCREEN = text_of("page/on_screen.js")
EYE = "viewer.camera.position.toArray()"
IN_LOWER = np.array([0.0, 0.0, 0.2])  # a point of the arm's second link


@pytest.fixture
def arm(opened, tmp_path):  # noqa: F811
    return opened(LiveRun(build(write_arm(tmp_path))))


def point_of(live):
    """Return where IN_LOWER is [m]."""
    return pose_of(live.player.scene.model, live.player.q, "lower").act(IN_LOWER)


def drag_right(tab, start):
    tab.page.mouse.move(*start)
    tab.page.mouse.down()
    tab.page.mouse.move(start[0] + 96, start[1], steps=8)


def take_hold(live, tab):
    """Press on the link and drag it; return where the camera was.

    On a busy machine the page's picture may be behind: who misses the link presses again.
    """
    deadline = time.monotonic() + 120.0
    while time.monotonic() < deadline:
        start = tab.page.evaluate(ON_SCREEN, point_of(live).tolist())
        eye = tab.page.evaluate(EYE)
        drag_right(tab, start)
        tab.page.wait_for_timeout(500)
        if tab.state("drag"):
            return eye
        tab.page.mouse.up()
    pytest.fail("nothing was taken hold of")


def wait_until_still(live, tab):
    tab.wait("state.t > 0.05")
    deadline = live.player.time + 30.0
    while np.abs(live.player.v).max() > 1e-4 and live.player.time < deadline:
        tab.page.wait_for_timeout(50)


def test_a_link_is_dragged_with_the_mouse_and_comes_back(arm):
    live, tab = arm
    wait_until_still(live, tab)
    before, right = point_of(live), tab.rightwards()
    tab.page.keyboard.down("Control")
    eye = take_hold(live, tab)
    tab.wait("state.drag && state.drag.newtons > 1")
    wait_until_still(live, tab)
    assert (point_of(live) - before) @ right > 0.01
    assert live.player.drag.force_world @ right > 0.0
    assert tab.state("drag.body") == "lower"
    # It is the force at rest: the label and the state are of the same instant or the next one.
    shown, unit = tab.page.locator("#drag-label").inner_text().split()
    assert (float(shown), unit) == (pytest.approx(tab.state("drag.newtons"), rel=0.05), "N")
    assert tab.page.evaluate(EYE) == pytest.approx(eye)  # the camera has stayed
    tab.page.mouse.up()
    tab.page.keyboard.up("Control")
    tab.wait("!state.drag && document.querySelector('#drag-label').hidden")
    tab.page.wait_for_timeout(300)
    wait_until_still(live, tab)
    np.testing.assert_allclose(point_of(live), before, atol=1e-3)


def moves_the_camera(live, tab, start):
    eye = tab.page.evaluate(EYE)
    drag_right(tab, start)
    tab.page.mouse.up()
    tab.page.wait_for_timeout(200)
    assert tab.page.evaluate(EYE) != pytest.approx(eye, rel=1e-3)
    assert live.player.drag is None


def test_without_key_and_button_the_mouse_moves_the_camera(arm):
    live, tab = arm
    wait_until_still(live, tab)
    moves_the_camera(live, tab, tab.page.evaluate(ON_SCREEN, point_of(live).tolist()))
    # With the button, bodies are taken hold of; beside them the camera still moves.
    tab.page.keyboard.press("d")
    assert tab.page.locator("#drag-mode").get_attribute("aria-pressed") == "true"
    eye = take_hold(live, tab)
    tab.page.mouse.up()
    tab.wait("!state.drag")
    assert tab.page.evaluate(EYE) == pytest.approx(eye)
    box = tab.page.locator("#scene").bounding_box()
    moves_the_camera(live, tab, (box["x"] + 30, box["y"] + 0.6 * box["height"]))


def test_sliders_move_the_targets_of_the_joints_in_degrees(arm):
    live, tab = arm
    tab.slide('[data-parameter="target-elbow"]', 0.0)
    tab.wait("state.targets.elbow === -2")
    field = tab.page.locator("#targets-section input[type=text]").first
    field.fill("30")
    field.press("Enter")
    tab.wait("Math.abs(state.targets.shoulder - Math.PI / 6) < 1e-6")
    wait_until_still(live, tab)
    np.testing.assert_allclose(live.player.q, [np.pi / 6, -2.0], atol=2e-3)
    field.fill("300")
    field.press("Enter")
    tab.wait("document.getElementById('toasts').innerText.includes('limits of the joint')")
    tab.wait("document.querySelector('#targets-section input[type=text]').value === '30'")
    tab.click("#targets-section button")
    tab.wait("state.targets.elbow === 0.5 && state.targets.shoulder === 0.4")


def test_a_word_is_a_menu_and_views_have_switches(opened, tmp_path):  # noqa: F811
    text = DROP.replace('shell = "plate"\n', 'shell = "plate"\nmethod = "smooth"\n')
    text += '\n[[knob]]\nkey = "contact.ball-plate.method"\n'
    live, tab = opened(LiveRun(build(write(tmp_path, text))))
    tab.wait("state.t > 1.0 && state.contacts.length")
    # At rest and standing still: this leaves the machine time to draw.
    tab.click("#run")
    tab.wait("!state.running")
    visible = '[data-part="curved"]'
    assert tab.page.locator(visible).is_visible()
    tab.click('[data-part="pressure"]')
    tab.wait("document.getElementById('pressure').innerText.includes('MPa')")
    tab.page.select_option("#parameters select", "facets")
    tab.wait("state.parameters['contact.ball-plate.method'] === 'facets'")
    tab.wait("!('curved' in state.show)")
    assert not tab.page.locator(visible).is_visible()
    assert live.player.scene.pairs[0].side_j.method == "facets"
