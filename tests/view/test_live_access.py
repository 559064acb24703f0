"""Who gets at the live page: nobody without the token, no foreign name, site or frame."""

import contextlib
import socket

import pytest
from tornado.httpclient import HTTPClientError

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view.live import Live, access, server
from tests.view.live_client import Client, get, inside, run
from tests.view.live_player import BallPlayer


@pytest.fixture(scope="module")
def live():
    with Live(BallPlayer()) as running:
        yield running


def connects(live, url, **headers):
    """Return the status with which a websocket is answered."""

    async def visit():
        try:
            (await Client(url).open(**headers)).socket.close()
        except HTTPClientError as refused:
            return refused.code
        return 101

    return run(visit())


def test_the_address_ends_with_a_token_that_everything_asks_for(live):
    address, token = live.url.split("?token=")
    assert len(token) >= 32
    wrong = token[:-1] + ("a" if token[-1] != "a" else "b")
    for url in (address, f"{address}?token=", f"{address}?token={wrong}", f"{address}?token=%ff"):
        for name in ("", "page.js", "viewer.js", "no_such_file", f"{wrong}/page.js"):
            status, text, headers = get(inside(url, name))
            assert status == 403
            assert "the whole address that was printed" in text.decode()
            assert text.count(b"\n") == 1
            assert headers["X-Frame-Options"] == "DENY"
        assert connects(live, url) == 403
    # The page's own files are where no other page finds them; no cookie goes to other ports.
    status, page, headers = get(live.url)
    assert status == 200
    assert f'<base href="{token}/">' in page.decode()
    assert "Set-Cookie" not in headers
    assert get(f"{address}{token}/page.js")[0] == 200
    assert connects(live, live.url) == 101  # a program, not a page


def test_no_page_may_frame_it(live):
    for url, status in ((live.url, 200), (inside(live.url, "no_such"), 404)):
        got, _, headers = get(url)
        assert got == status
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
        assert headers["X-Frame-Options"] == "DENY"
        assert headers["Referrer-Policy"] == "no-referrer"


def test_other_sites_are_refused(live, caplog):
    port = live.server.port
    own, rebound = f"127.0.0.1:{port}", f"evil.example:{port}"
    assert connects(live, live.url, Origin=f"http://{own}") == 101
    beside = f"http://127.0.0.1:{port + 1}"
    foreign = ("http://evil.example", "null", "http://[bad", "", f"http://{own}@evil.example")
    for origin in (*foreign, beside):
        assert connects(live, live.url, Origin=origin) == 403
    # A name of the other site's own that was made to lead here.
    assert connects(live, live.url, Origin=f"http://{rebound}", Host=rebound) == 403
    assert not caplog.records


STRANGERS = ("evil.example", "[", "127.0.0.1.evil.example", "localhost@evil", "[::1%25 x]")


def test_only_names_of_this_machine_lead_to_any_of_its_own_addresses():
    with Live(BallPlayer(), host="127.0.0.2") as other:
        assert not other.server.is_open
        for own in ("127.0.0.2", "localhost:1", "[::1]", socket.gethostname()):
            assert get(other.url, Host=own)[0] == 200
        for stranger in (*STRANGERS, "192.0.2.1"):
            assert get(other.url, Host=stranger)[0] in (400, 403)


def test_a_page_for_other_machines_has_no_other_name_either():
    with Live(BallPlayer(), host="0.0.0.0") as opened:
        assert opened.server.is_open
        for own in ("localhost", "192.0.2.1:80", "[2001:db8::1]:80", socket.gethostname()):
            assert get(opened.url, Host=own)[0] == 200
        for stranger in STRANGERS:
            status, text, _ = get(opened.url, Host=stranger)
            assert status in (400, 403)
            assert status == 400 or "the name that host was set to" in text.decode()


def test_a_token_of_ones_own(monkeypatch):
    for value, fits in (("a-token_of_16-or-more", True), ("short", False), ("a/b" * 9, False)):
        monkeypatch.setenv(access.TOKEN_VARIABLE, value)
        access.process_token.cache_clear()
        if fits:
            assert access.process_token() == value
        else:
            with pytest.raises(InvalidParameter, match="16 to 200") as told:
                access.process_token()
            assert value not in str(told.value)
    monkeypatch.undo()
    access.process_token.cache_clear()


TO_HERE = b"Host: 127.0.0.1\r\n"
FRAME = (
    b"GET /TOKEN/socket HTTP/1.1\r\n" + TO_HERE + b"Upgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Extensions: permessage-deflate\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n\xc1\xff\x7f\xff" + 20 * b"\xff"
)
POST = b"POST / HTTP/1.1\r\n" + TO_HERE
HOSTILE = {
    "no HTTP": b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n",
    "no host": b"GET / HTTP/1.1\r\n\r\n",
    "no text": b"GET /\xff\xfe?token=%ff%00 HTTP/1.1\r\n" + TO_HERE + b"\r\n",
    "a bad address": b"GET //[bad/?token=x HTTP/1.1\r\n" + TO_HERE + b"\r\n",
    "a long header": b"GET / HTTP/1.1\r\n" + TO_HERE + b"X: " + 100_000 * b"x",
    "a large body": POST + b"Content-Length: 9999999999\r\n\r\n",
    "a bad body": POST + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n",
    "compressed": POST + b"Content-Encoding: gzip\r\nContent-Length: 3\r\n\r\nabc",
    "a bad frame": FRAME,
}


def test_no_request_leaves_a_complaint(live, caplog):
    for request in HOSTILE.values():
        with socket.create_connection(("127.0.0.1", live.server.port)) as raw:
            raw.sendall(request.replace(b"TOKEN", live.server.access.token.encode()))
            with contextlib.suppress(OSError):  # it may be refused before all is said
                raw.shutdown(socket.SHUT_WR)
                while raw.recv(1 << 16):
                    pass
    assert get(live.url)[0] == 200
    assert not caplog.records


def test_strangers_cannot_take_all_connections(live, monkeypatch):
    monkeypatch.setattr(server, "MOST_CONNECTIONS", 5)
    crowd = [socket.create_connection(("127.0.0.1", live.server.port)) for _ in range(30)]
    crowd[-1].settimeout(20.0)
    assert crowd[-1].recv(1) == b""
    for one in crowd:
        one.close()
    monkeypatch.undo()
    assert get(live.url)[0] == 200
