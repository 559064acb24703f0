"""How the live page looks and reads: sizes, light and dark, contrast, targets, names, keys."""

import re
from pathlib import Path

import numpy as np
import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.view.live import Live
from tests.scenario.files import DROP, write
from tests.texts import text_of
from tests.view.layout import BOXES, overlapping
from tests.view.test_live_in_browser import Tab

pytestmark = pytest.mark.browser

DOCS = Path(__file__).parents[2] / "docs" / "view.md"
NARROW = [(390, 844), (844, 390), (768, 1024), (320, 568)]
WIDE = [(1920, 1080), (1440, 900), (1280, 720), (900, 500)]
FRICTION = 'damping = 20.0 }\nfriction = { type = "coulomb", mu_static = 0.3 }'
KNOB = '\n[[knob]]\nkey = "contact.ball-plate.law.stiffness"\n'
SCENARIO = DROP.replace("damping = 20.0 }", FRICTION) + KNOB

# Everything that one can press or drag, and is seen, with its box in the page.
TARGETS = text_of("page/targets.js").rstrip()

# Of each piece of text that is seen: its color, and the colors behind it from the nearest on.
TEXTS = text_of("page/texts.js").rstrip()

SKY = """["--sky", "--earth"].map((name) =>
    getComputedStyle(document.documentElement).getPropertyValue(name).trim())"""


class Look(Tab):
    """One page for all tests of this file; `show` makes it as if newly opened."""

    def __init__(self, browser, live):
        super().__init__(browser, live, viewport={"width": 1440, "height": 900})
        self.page.evaluate("document.getElementById('step-size').value = '0.1'")
        self.click("#step")
        self.wait("state.contacts.length === 1")

    def show(self, size=(1440, 900), scheme="light"):
        self.page.set_viewport_size({"width": size[0], "height": size[1]})
        self.page.emulate_media(color_scheme=scheme)
        self.page.evaluate("scrollTo(0, 0)")
        self.wait(f"innerWidth === {size[0]} && chart.canvas.clientWidth > 0")


@pytest.fixture(scope="module")
def opened(browser, tmp_path_factory):
    path = write(tmp_path_factory.mktemp("drop"), SCENARIO)
    with Live(LiveRun(build(path)), running=False) as live:
        look = Look(browser, live)
        yield look
        look.page.close()
    assert look.complaints == []


@pytest.fixture
def look(opened):
    opened.show()
    return opened


@pytest.mark.parametrize("size", NARROW + WIDE)
def test_nothing_is_cut_off_and_no_control_lies_over_another(look, size):
    look.show(size)
    assert look.page.evaluate("document.documentElement.scrollWidth") == size[0]
    targets = look.page.evaluate(TARGETS)
    if size in WIDE:  # the panel scrolls by itself there
        assert look.page.evaluate("document.documentElement.scrollHeight") == size[1]
        targets = [one for one in targets if one["bottom"] <= size[1]]
    assert len(targets) > 10
    cut = look.page.evaluate("""() => [...document.querySelectorAll("button, th, td, output")]
        .filter((one) => one.offsetParent && one.scrollWidth > one.clientWidth + 1)
        .map((one) => one.innerText)""")
    assert cut == []
    for one in targets:
        assert -0.5 <= one["left"] <= one["right"] <= size[0] + 0.5, one
    floating = look.page.evaluate(BOXES, "#status, #legend, #stage button")
    assert {"status", "legend", "drag-mode"} <= {one["name"] for one in floating}
    assert overlapping([one for one in targets if not one["floats"]], 0.5) == []
    assert overlapping(floating, 0.5) == []


@pytest.mark.parametrize("size", NARROW)
def test_a_finger_meets_every_control_of_a_narrow_page(look, size):
    look.show(size)
    for one in look.page.evaluate(TARGETS):
        assert one["bottom"] - one["top"] >= 40, one
        assert one["right"] - one["left"] >= 40, one


def luminance(color):
    """Relative luminance, WCAG 2.2."""
    linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    return linear @ [0.2126, 0.7152, 0.0722]


def contrast(a, b):
    light, dark = sorted((luminance(a), luminance(b)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def rgba(text):
    if text.startswith("#"):
        return np.array([int(text[k : k + 2], 16) / 255 for k in (1, 3, 5)]), 1.0
    numbers = [float(one) for one in re.findall(r"[\d.]+", text)]
    return np.array(numbers[:3]) / 255, numbers[3] if len(numbers) > 3 else 1.0


def paint(colors, below):
    """Return what is seen of `colors`, the uppermost first, over `below`."""
    seen = below
    for color, alpha in map(rgba, reversed(colors)):
        seen = alpha * color + (1 - alpha) * seen
    return seen


@pytest.mark.parametrize("size", [(1440, 900), (390, 844)])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_all_text_has_contrast(look, scheme, size):
    look.show(size, scheme)
    look.page.evaluate("document.getElementById('curves').open = true")
    look.click("#help-button")
    texts = look.page.evaluate(TEXTS)
    look.click("#help-close")
    look.page.evaluate("document.getElementById('curves').open = false")
    assert len(texts) > 60
    sky = look.page.evaluate(SKY)
    for text, color, behind in texts:
        for below in sky:  # the scene lies below what is not opaque
            ground = paint(behind, rgba(below)[0])
            assert contrast(paint([color], ground), ground) >= 4.5, (text, color, behind)


@pytest.mark.parametrize("size", NARROW + WIDE)
def test_messages_lie_over_no_line_of_the_legend(look, size):
    look.show(size)
    boxes = look.page.evaluate(text_of("page/messages.js"))
    assert len(boxes) == 5
    assert overlapping(boxes) == []


def test_every_control_has_a_name_and_messages_are_announced(look):
    # A select is named by its label, not by its options; meshcat's own controls are hidden.
    nameless = look.page.evaluate(text_of("page/nameless.js"))
    assert nameless == []
    live = look.page.evaluate("""() => ["notice", "toasts"].map((name) => {
        const one = document.getElementById(name);
        return one.getAttribute("aria-live") || one.getAttribute("role");
    })""")
    assert live == ["status", "polite"]


def test_the_overlay_lists_the_keys_that_the_documentation_has(look):
    look.page.keyboard.press("?")
    look.wait("document.getElementById('help').open")
    assert look.page.get_by_role("dialog", name="Keys").is_visible()
    cells = "(row) => [...row.cells].map((one) => one.innerText)"
    rows = look.page.evaluate(f"[...document.getElementById('keys').rows].map({cells})")
    # Keys do nothing below the overlay.
    t = look.page.evaluate("state.t")
    look.page.keyboard.press("s")
    look.page.wait_for_timeout(150)
    assert look.page.evaluate("state.t") == t
    look.page.keyboard.press("Escape")
    look.wait("!document.getElementById('help').open")
    section = DOCS.read_text("utf-8").partition("\n## Keys\n")[2].partition("\n## ")[0]
    table = re.findall(r"^\| (`.+) \| (.+) \|$", section, re.M)
    assert [[keys.replace("`", ""), says] for keys, says in table] == rows
    assert len(rows) >= 7
