"""The live page against hostile pages in a real browser."""

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from sphshell_pin.view.live import Live
from tests.view.live_client import inside
from tests.view.live_player import BallPlayer

pytestmark = pytest.mark.browser

READY = "globalThis.state && document.body.classList.contains('ready')"


@pytest.fixture(scope="module")
def live():
    with Live(BallPlayer(), running=False) as standing:
        yield standing


@pytest.fixture
def tab(browser):
    context = browser.new_context()
    yield context.new_page()
    context.close()


@pytest.fixture
def other_site():
    """Serves `body` of the handler: the page of somebody else."""

    class Site(BaseHTTPRequestHandler):
        body = ""

        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(self.body.encode())

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Site) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        Site.port = server.server_port
        yield Site
        server.shutdown()


ATTACK = """async (urls) => {
    const socket = (url) => new Promise((done) => {
        const one = new WebSocket(url.replace("http", "ws"));
        one.onopen = () => done("open");
        one.onclose = () => done("closed");
    });
    const read = (url) => fetch(url).then((answer) => answer.text()).catch(() => "refused");
    const seen = [];
    for (const url of urls) seen.push(await socket(url), await read(url));
    return seen;
}"""


# Another port of the same machine is another site, which gets the same cookies.
@pytest.mark.parametrize("name", ["evil.example", "127.0.0.1"])
def test_another_site_can_neither_frame_nor_drive_nor_read_it(live, tab, other_site, name):
    # Even one that knows the address.
    other_site.body = f'<iframe src="{live.url}"></iframe>'
    tab.goto(f"http://{name}:{other_site.port}/")
    for _ in range(200):
        if tab.frames[1].url:
            break
        tab.wait_for_timeout(50)
    assert tab.frames[1].url.startswith("chrome-error:")
    address = inside(live.url, "socket")
    seen = tab.evaluate(ATTACK, [address, address.partition("?")[0], live.url])
    assert seen == ["closed", "refused"] * 3
    assert not live.server.watched
