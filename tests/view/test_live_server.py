"""The server against browsers of all kinds: several, slow, late, gone, hostile."""

import asyncio
import contextlib
import re
import socket
import threading
import time

import pytest

from sphshell_pin.errors import InvalidParameter, SphshellError
from sphshell_pin.view.live import Live
from tests.view.live_client import Client, get, inside, run
from tests.view.live_player import BallPlayer
from tests.view.test_live_events import BAD


@pytest.fixture
def live():
    with Live(BallPlayer()) as running:
        yield running


def goes_on(live, patience=20.0):
    """Tell whether simulated time passes, on a busy machine some time later."""
    before, deadline = live.player.time, time.monotonic() + patience
    while live.player.time <= before + 0.03 and time.monotonic() < deadline:
        time.sleep(0.05)
    return live.player.time > before + 0.03


def test_the_page_is_served_whole_and_nothing_else(live):
    _, page, headers = get(live.url)
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert not re.search("https?://", page.decode())
    for name in ("style.css", "page.js", "scene.js", "chart.js", "controls.js", "viewer.js"):
        status, body, _ = get(inside(live.url, name))
        assert status == 200
        assert body
    for name in ("server.py", "..%2fserver.py", "%2e%2e/loop.py", "/etc/passwd", "page/index.html"):
        assert get(inside(live.url, name))[0] == 404


def test_several_browsers_follow_each_other(live):
    async def visit():
        async with Client(live.url) as one, Client(live.url) as two:
            await one.until(lambda c: c.state)
            await one.say("parameter", key="stiffness", value=7000.0)
            await one.say("speed", value=0.5)
            await one.say("show", part="trails", on=False)
            await two.until(lambda c: c.state and not c.state["show"]["trails"])  # said last
            assert two.state["parameters"]["stiffness"] == 7000.0
            assert two.state["speed"] == 0.5
            await two.say("run", on=False)
            await one.until(lambda c: not c.state["running"])

    run(visit())
    assert live.player.knob_values["stiffness"] == 7000.0


def test_a_flood_is_answered_and_survived(live):
    async def visit():
        async with Client(live.url) as client:
            await client.until(lambda c: c.state)
            for k in range(6_000):
                client.say("parameter", key="stiffness", value=1000.0 + k)
            await client.say("reset")
            await client.until(lambda c: c.state["parameters"]["stiffness"] == 6999.0 or c.errors)

    run(visit())
    assert goes_on(live)


def test_wrong_values_are_told_to_the_one_who_asked(live):
    async def visit():
        async with Client(live.url) as client, Client(live.url) as other:
            await client.say("parameter", key="stiffness", value=-1.0)
            await client.until(lambda c: c.errors)
            await client.say("show", part="hat", on=True)
            await client.until(lambda c: len(c.errors) == 2)
            await other.until(lambda c: len(c.scenes) > 3)
            return client.errors, other.errors

    (value, part), nothing = run(visit())
    assert "must be positive" in value
    assert "trails" in part
    assert "\n" not in value + part
    assert nothing == []
    assert live.player.knob_values["stiffness"] == 5e3


def raw_socket(live):
    """Connect, and never read."""
    connection = socket.create_connection(("127.0.0.1", live.server.port))
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.sendall(
        f"GET /{live.server.access.token}/socket HTTP/1.1\r\nHost: 127.0.0.1\r\n"
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
    )
    return connection


def test_a_browser_that_never_reads_holds_up_nobody(live):
    deaf = raw_socket(live)

    async def visit():
        async with Client(live.url) as client:
            await client.until(lambda c: len(c.scenes) > 30)

    while not live.server.watched:
        time.sleep(0.01)
    run(visit())
    assert goes_on(live)
    deaf.close()


def test_a_browser_that_answers_late_skips_frames_and_gets_the_newest(live):
    async def visit():
        async with Client(live.url, answers=False) as slow, Client(live.url) as fast:
            await fast.until(lambda c: len(c.scenes) > 40)
            with contextlib.suppress(TimeoutError):
                while True:
                    await asyncio.wait_for(slow.read(), 0.05)
            return slow, fast

    slow, fast = run(visit())
    assert 1 <= len(slow.scenes) < 0.5 * len(fast.scenes)


def test_the_end_is_told():
    async def visit():
        live = Live(BallPlayer()).start()
        async with Client(live.url) as client:
            await client.until(lambda c: c.state)
            ending = threading.Thread(target=live.stop)
            ending.start()
            await client.until(lambda _: False)
            ending.join()
            return client

    client = run(visit())
    assert client.end
    assert client.closed


def test_a_server_that_comes_back_on_its_port_is_another_session():
    first = Live(BallPlayer()).start()
    port = first.server.port

    async def session(url):
        async with Client(url) as client:
            await client.until(lambda c: c.hello)
            return client.hello["session"]

    before = run(session(first.url))
    first.stop()
    with Live(BallPlayer(), port=port) as second:
        assert second.url == first.url
        assert run(session(second.url)) != before


def test_no_message_stops_the_run(live):
    async def visit():
        async with Client(live.url) as client, Client(live.url) as other:
            for message in BAD.values():
                await client.socket.write_message(message, binary=isinstance(message, bytes))
            await client.until(lambda c: len(c.errors) == len(BAD))
            await other.until(lambda c: len(c.scenes) > 3)
            assert other.errors == []

    run(visit())
    assert goes_on(live)


@pytest.mark.parametrize("host", ["no.such.host.invalid", "192.0.2.1", "a..b"])
def test_where_it_cannot_be_served_is_one_sentence(live, host):
    with pytest.raises(SphshellError, match="must be a name or an address") as reported:
        Live(BallPlayer(), host=host)
    assert "Unknown error" not in str(reported.value)
    assert "port" not in str(reported.value)
    with pytest.raises(SphshellError, match=f"{live.server.port}.*another port") as reported:
        Live(BallPlayer(), port=live.server.port)
    assert "\n" not in str(reported.value)
    for port in (-1, 65536, True, "80"):
        with pytest.raises(InvalidParameter, match="port"):
            Live(BallPlayer(), port=port)
