"""The recording in a real browser: pixels, clicks, no network."""

import io

import numpy as np
import pytest

from sphshell_pin.view import write_recording
from sphshell_pin.view.arrows import NORMAL_COLOR
from tests.view.stand_ins import ball_on_plate

pytestmark = pytest.mark.browser

SIZE = {"width": 800, "height": 500}


def watch(page, address):
    """Return a list that fills with the complaints of a page: faults, requests beyond `address`."""
    complaints, own = [], (address, "data:", "blob:")
    page.on("pageerror", lambda fault: complaints.append(str(fault)))
    page.on("request", lambda one: one.url.startswith(own) or complaints.append(one.url))
    return complaints


def pixels_of(shot):
    """Return the pixels (h, w, 3) of a screenshot."""
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


@pytest.fixture
def opened(browser):
    """Opens a file in a page without network; complaints of the page end the test."""
    context = browser.new_context(viewport=SIZE, offline=True)
    page = context.new_page()
    complaints = watch(page, "file:")

    def open_file(path):
        page.goto(path.resolve().as_uri())
        page.wait_for_function("window.recording", timeout=60_000)
        return page

    yield open_file
    context.close()
    assert complaints == []


def at_time(page, time):
    """Pause, scrub to `time` [s] and return the picture (h, w, 3)."""
    page.evaluate("time => { recording.film('fit', false); recording.draw(time); }", time)
    # The captions may lie over what is looked for.
    page.add_style_tag(content="#head, #key, #views { visibility: hidden !important; }")
    return pixels_of(page.screenshot())


def count(pixels, color, tolerance=25):
    wanted = np.array([color >> 16, color >> 8 & 255, color & 255])
    return np.count_nonzero(np.abs(pixels - wanted).max(axis=2) <= tolerance)


def is_blue(pixels):
    return pixels[..., 2] - pixels[..., 0] > 60


def is_greenish(pixels):
    """As the shell is, unlike the grey and blue background."""
    return (pixels[..., 1] - pixels[..., 0] > 15) & (pixels[..., 1] >= pixels[..., 2])


@pytest.fixture(scope="module")
def ball_page(tmp_path_factory):
    scene, result = ball_on_plate()
    return write_recording(tmp_path_factory.mktemp("page") / "ball.html", result, scene)


def test_the_ball_its_shell_and_its_arrow_are_seen(ball_page, opened):
    page = opened(ball_page)
    before, during = at_time(page, 0.0), at_time(page, 1.5)
    for pixels in (before, during):
        assert np.count_nonzero(is_blue(pixels)) > 100  # the ball
        assert np.mean(is_greenish(pixels)) > 0.05  # the shell
    assert count(before, NORMAL_COLOR) == 0
    assert count(during, NORMAL_COLOR) > 60
    # Over the run the ball goes from one side to the other.
    start, end = (np.nonzero(is_blue(at_time(page, time)))[1].mean() for time in (0.0, 3.0))
    assert abs(end - start) > 0.15 * SIZE["width"]


def test_the_trail_grows_with_time(ball_page, opened):
    page = opened(ball_page)
    visible = """() => {
        let shown = 0;
        viewer.scene.traverse(node => { if (node.name === "trail")
            shown += node.children.filter(piece => piece.visible).length; });
        return shown;
    }"""
    counts = []
    for time in (0.0, 1.2, 1.8, 3.0):
        at_time(page, time)
        counts.append(page.evaluate(visible))
    assert counts[0] == 0
    assert counts == sorted(set(counts))


def test_a_damaged_page_says_so(ball_page, tmp_path, browser):
    damaged = tmp_path / "damaged.html"
    damaged.write_text(ball_page.read_text().replace('id="scene">H4sI', 'id="scene">AAAA'))
    page = browser.new_page()
    page.goto(damaged.as_uri())
    page.wait_for_function("document.getElementById('fault').textContent", timeout=20_000)
    assert "cannot be shown" in page.locator("#fault").inner_text()
    page.close()
