"""The live page against hostile pages in a real browser."""

import pytest

from sphshell_pin.view.live import Live
from tests.programs import serving
from tests.texts import text_of
from tests.view.live_client import inside
from tests.view.live_player import BallPlayer

pytestmark = pytest.mark.browser

ATTACK = text_of("page/attack.js")


@pytest.fixture(scope="module")
def live():
    with Live(BallPlayer(), running=False) as standing:
        yield standing


@pytest.mark.parametrize("name", ["evil.example", "127.0.0.1"])
def test_another_site_can_neither_frame_nor_drive_nor_read_it(live, browser, tmp_path, name):
    """Not even one that knows the address; another port is another site, with the same cookies."""
    (tmp_path / "index.html").write_text(f'<iframe src="{live.url}"></iframe>')
    tab = browser.new_page()
    with serving(tmp_path) as port:
        tab.goto(f"http://{name}:{port}/")
        for _ in range(200):
            if tab.frames[1].url:
                break
            tab.wait_for_timeout(50)
        assert tab.frames[1].url.startswith("chrome-error:")
        address = inside(live.url, "socket")
        seen = tab.evaluate(ATTACK, [address, address.partition("?")[0], live.url])
    assert seen == ["closed", "refused"] * 3
    assert not live.server.watched
    tab.close()
