"""The panel of a recording in a real browser: time, chart, cameras, keys, narrow and dark."""

import numpy as np
import pytest

from sphshell_pin.view import write_recording
from sphshell_pin.view.curves import BINS, run_curves
from tests.view.layout import BOXES, overlapping
from tests.view.stand_ins import a_result, ball_on_plate
from tests.view.test_recording_in_browser import watch

SIZES = {"wide": (1100, 640), "narrow": (390, 844)}
STEP = 1.0 / 30.0


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """The result of a ball on a plate, and the file of its recording."""
    scene, result = ball_on_plate()
    result.pairs = ["ball </script><script>window.hacked = 1</script>"]
    title = "</script><script>window.hacked = 1</script>"
    file = tmp_path_factory.mktemp("page") / "ball.html"
    return result, write_recording(file, result, scene, title=title)


@pytest.fixture(scope="module")
def opened(browser, ball):
    """Opens the recording in a window; complaints and requests of it end the tests."""
    contexts, complaints = {}, []

    def page_of(size="wide", scheme="light"):
        key = size, scheme
        if key not in contexts:
            viewport = dict(zip(("width", "height"), SIZES[size], strict=True))
            more = {"color_scheme": scheme, "reduced_motion": "reduce", "offline": True}
            page = contexts[key] = browser.new_context(viewport=viewport, **more).new_page()
            complaints.append(watch(page, "file:"))
            page.goto(ball[1].resolve().as_uri())
            page.wait_for_function("window.recording", timeout=60_000)
        return contexts[key]

    yield page_of
    for page in contexts.values():
        page.context.close()
    assert not any(complaints)


@pytest.fixture
def page(opened):
    page = opened()
    page.evaluate("recording.pause(); recording.seek(0); recording.cameras.look('fit')")
    return page


def ball_place(page):
    """Where the scene has the ball [m]."""
    ball = "viewer.scene_tree.find(['meshcat', 'spheres', '0_ball']).object"
    return np.array(page.evaluate(f"{ball}.position.toArray()"))


def time_of(page):
    return page.evaluate("recording.time")


def check_agreement(page, result):
    """Compare scene, clock, scrub bar, and the readings of the chart, with the result."""
    t = time_of(page)
    expected = [np.interp(t, result.t, result.q[:, k]) for k in range(3)]
    # Keys of the page's frames, between which it interpolates a motion with kinks.
    np.testing.assert_allclose(ball_place(page), expected, atol=0.01)
    assert float(page.locator("#clock").inner_text().split()[0]) == pytest.approx(t, abs=0.0051)
    assert float(page.locator("#scrub").input_value()) == pytest.approx(t, abs=1e-6)
    row = int(np.argmin(np.abs(result.t - t)))
    force = result.contacts.normal_force[result.contacts.row == row].sum()
    reading = page.locator("#normal").inner_text()
    assert float(reading.split()[0]) == pytest.approx(force, abs=1e-3)


@pytest.mark.browser
def test_chart_scrub_bar_and_scene_show_the_same_time(page, ball):
    result, _ = ball
    check_agreement(page, result)
    box = page.locator("#chart").bounding_box()
    begin, end = page.evaluate("[recording.chart.x(0), recording.chart.x(recording.clock.end)]")
    for share in (0.4, 0.62):
        at = begin + share * (end - begin)
        page.mouse.click(box["x"] + at, box["y"] + 30)
        assert time_of(page) == pytest.approx(share * result.t[-1], abs=0.01)
        check_agreement(page, result)
        pen = "chart.getContext('2d').getImageData(Math.round(at) - 2, 0, 5, chart.height)"
        ink = page.evaluate(f"at => [...{pen}.data]", at)
        darkest = np.reshape(ink, (-1, 5, 4))[:, :, :3].sum(axis=2).min(axis=1)
        assert np.median(darkest) < 3 * 70  # the line of the cursor, from top to bottom
    page.locator("#scrub").fill("1.25")
    assert time_of(page) == 1.25
    check_agreement(page, result)
    # A drag takes the cursor along.
    page.mouse.move(box["x"] + 200, box["y"] + 40)
    page.mouse.down()
    page.mouse.move(box["x"] + begin + 0.25 * (end - begin), box["y"] + 40)
    page.mouse.up()
    assert time_of(page) == pytest.approx(0.25 * result.t[-1], abs=0.01)


@pytest.mark.browser
def test_keys(page, ball):
    end = float(ball[0].t[-1])
    for key, time in (
        ("End", end),
        ("ArrowLeft", end - STEP),
        ("Shift+ArrowLeft", end - 11 * STEP),
        ("ArrowRight", end - 10 * STEP),
        ("Home", 0.0),
    ):
        page.keyboard.press(key)
        assert time_of(page) == pytest.approx(time)
    page.evaluate("recording.rate = 0.01")  # not at its end before the next key
    page.get_by_role("button", name="Play", exact=True).click()
    assert page.evaluate("recording.playing")
    page.wait_for_function("recording.time > 0")
    page.keyboard.press("Space")
    page.evaluate("recording.rate = 1.0")
    shown = "document.getElementById('{}').checkVisibility()"
    for key, what, value in (
        ("ArrowDown", "recording.rate", 0.5),
        ("ArrowUp", "recording.rate", 1.0),
        ("4", "recording.cameras.name", "top"),
        ("c", shown.format("chart"), False),
        ("c", shown.format("chart"), True),
        ("?", shown.format("help"), True),
        ("Escape", shown.format("help"), False),
    ):
        assert not page.evaluate("recording.playing")
        page.keyboard.press(key)
        assert page.evaluate(what) == value, key


@pytest.mark.browser
def test_cameras(page):
    eyes = {}
    for name in page.evaluate("recording.cameras.names"):
        page.locator(f"#views [data-view={name}]").click()
        eyes[name] = np.array(page.evaluate("viewer.camera.position.toArray()"))
        target = np.array(page.evaluate("viewer.controls.target.toArray()"))
        toward = (eyes[name] - target) / np.linalg.norm(eyes[name] - target)
        # The page's camera has y up: front is +x, side -y, top +z of the world.
        axis = {"front": [1, 0, 0], "side": [0, 0, 1], "top": [0, 1, 0]}.get(name)
        assert axis is None or toward @ axis > 0.999
    assert list(eyes) == ["fit", "front", "side", "top", "follow", "contact"]
    # The camera goes with the ball, of which the scene has y up too.
    offsets = []
    for time in (0.0, 2.0):
        page.evaluate("time => recording.draw(time)", time)
        eye = np.array(page.evaluate("viewer.camera.position.toArray()"))
        x, y, z = ball_place(page)
        offsets.append(eye - [x, z, -y])
    np.testing.assert_allclose(offsets[0], offsets[1], atol=2e-3)
    assert np.linalg.norm(offsets[0]) < np.linalg.norm(eyes["fit"]) * 0.9
    page.mouse.move(500, 250)
    page.mouse.down()
    page.mouse.move(560, 250, steps=3)
    page.mouse.up()
    assert page.evaluate("recording.cameras.name") is None


@pytest.mark.browser
def test_text_of_a_run_is_no_code(page, ball):
    assert page.evaluate("window.hacked") is None
    assert page.locator("h1").inner_text() == "</script><script>window.hacked = 1</script>"
    assert page.evaluate("recording.chart.curve.name") == ball[0].pairs[0]
    assert not page.evaluate("viewer.gui.domElement.checkVisibility()")
    figures = page.locator("#figures").inner_text()
    peak = ball[0].contacts.normal_force.max()
    assert f"{peak:.3g} N" in figures
    assert "3 s" in figures


@pytest.mark.browser
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_is_cut_off_or_overlaps(opened, size, scheme):
    page = opened(size, scheme)
    width, height = SIZES[size]
    parts = page.evaluate(BOXES, "h1, button, select, #scrub, #clock, .reading, summary")
    assert len(parts) > 15
    for one in parts:
        assert 0 <= one["left"] < one["right"] <= width, one
        assert 0 <= one["top"] < one["bottom"] <= height, one
    assert overlapping(parts) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    dock = "getComputedStyle(document.getElementById('dock')).backgroundColor"
    sky = "viewer.scene_tree.find(['Background']).object.top_color"
    for color in page.evaluate(f"[{dock}.match(/\\d+/g).map(Number), {sky}]"):
        assert (np.mean(color) < 80) == (scheme == "dark")


def test_curves_keep_every_peak_of_a_long_run():
    t = np.linspace(0.0, 5.0, 50_001)
    rows = [{"row": row, "normal_force": 1.0} for row in range(0, len(t), 7)]
    rows += [{"row": 12_345, "normal_force": 50.0}]
    (curve,) = run_curves(a_result(t, np.zeros((len(t), 8)), rows), len(t))
    assert len(curve.t) <= 4 * BINS + 2
    assert curve.normal.max() == curve.figures["peak"] == 50.0
    assert curve.t[np.argmax(curve.normal)] == t[12_345]
    assert curve.normal.min() == 0.0


def test_curves_of_several_pairs_begin_with_their_sum():
    rows = [
        {"row": 1, "pair": 0, "normal_force": 1.0, "friction_force_world": [3.0, 4.0, 0.0]},
        {"row": 1, "pair": 2, "normal_force": 2.0},
    ]
    curves = run_curves(a_result([0.0, 1.0, 2.0], np.zeros((3, 8)), rows, ("a", "b", "c")), 3)
    assert [one.name for one in curves] == ["all pairs, summed", "c", "a"]
    assert curves[0].normal.tolist() == [0.0, 3.0, 0.0]
    assert curves[0].friction.tolist() == [0.0, 5.0, 0.0]
    # The trapezoids of a touch at one row of three.
    assert (curves[0].figures["contact_time"], curves[0].figures["mean"]) == (1.0, 3.0)
