"""The server of the live page: a thread with its own loop, which the simulation never waits for."""

from __future__ import annotations

import asyncio
import collections
import errno
import ipaddress
import json
import os
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

from sphshell_pin.errors import InvalidParameter, MissingExtra, SphshellError
from sphshell_pin.view.live.events import LARGEST_MESSAGE, BadMessage, Event, read_event
from sphshell_pin.view.nodes import require_meshcat

PAGE = Path(__file__).with_name("page")
MOST_EVENTS = 2_000  # waiting to be handled; more are refused

MOST_UNSAID = 50  # answers to a browser that does not read; more are dropped

# A browser says what it has drawn. This many frames go out unanswered; after the time [s], as in
# a tab that is hidden and draws nothing, the next one goes out all the same.
FRAMES_AHEAD = 2
PATIENCE = 1.0

_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self' ws: wss: data: blob:; frame-src *"
)


class Source(Protocol):
    """Where the server gets what browsers are told; called in the server's thread."""

    def scene_news(self, since: int) -> tuple[int, bytes | None]:
        """Return the last frame's number, and what changed in the scene after frame `since`."""

    def panel_news(self, since: int) -> tuple[int, list[str]]:
        """Return the last panel's number, and the texts that lead there from panel `since`."""


class Server:
    """Serves the page and one websocket per browser at `url`, until `stop`.

    Events of all browsers are gathered by `events`. Raises MissingExtra without meshcat,
    SphshellError where the port is taken.
    """

    def __init__(self, source: Source, host: str = "127.0.0.1", port: int = 0) -> None:
        viewer = Path(require_meshcat().__file__).parent / "viewer" / "dist" / "main.min.js"
        try:
            import tornado.netutil
        except ImportError as missing:
            raise MissingExtra("tornado", "view", "the live page") from missing
        if isinstance(port, bool) or not isinstance(port, int) or not 0 <= port <= 65535:
            raise InvalidParameter("port", port, "must be a port number from 0 (any free) to 65535")
        self.source = source
        self.clients: set[Any] = set()
        self.arrived = threading.Event()
        """Set when there is something for the simulation to do."""
        self._events: collections.deque[tuple[object, Event]] = collections.deque()
        self._woken = False
        self._stopping = False
        try:
            # Of a name with several addresses, one port has to do for all.
            sockets = tornado.netutil.bind_sockets(port, host, reuse_port=False)[:1]
        except socket.gaierror as fault:
            raise SphshellError(
                f"the live page cannot be served at {host}:{port} ({fault.strerror}): the host "
                "must be a name or an address of this machine"
            ) from fault
        except UnicodeError as fault:
            raise InvalidParameter("host", host, "must be a name or an address") from fault
        except OSError as fault:
            raise SphshellError(
                f"the live page cannot be served at {host}:{port} ({os.strerror(fault.errno or 0)}"
                f"): {_remedy(fault.errno)}"
            ) from fault
        address, self.port = sockets[0].getsockname()[:2]
        self.host = host
        self._local = ipaddress.ip_address(address.partition("%")[0]).is_loopback
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(
            target=self._serve, args=(sockets, viewer), daemon=True, name="live-page"
        )
        self._thread.start()

    @property
    def url(self) -> str:
        """Where the page is."""
        name = "localhost" if self.host in ("", "0.0.0.0", "::") else self.host
        return f"http://{f'[{name}]' if ':' in name else name}:{self.port}/"

    @property
    def is_open(self) -> bool:
        """Whether other machines may reach the page."""
        return not self._local

    @property
    def watched(self) -> bool:
        """Whether any browser is connected."""
        return bool(self.clients)

    def events(self) -> list[tuple[object, Event]]:
        """Return the events since the last call, each with the browser it came from."""
        self.arrived.clear()
        return [self._events.popleft() for _ in range(len(self._events))]

    def wake(self) -> None:
        """Let every browser be told what is new; returns at once."""
        if self.clients and not self._woken:
            self._woken = True
            self._call(self._wake)

    def tell(self, client: Any, text: str) -> None:
        """Send one browser a sentence that it shows."""
        self._call(lambda: client.say({"type": "error", "text": text}))

    def stop(self) -> None:
        """Say goodbye to the browsers and end the thread."""
        if not self._stopping:
            self._stopping = True
            self._call(lambda: self._loop.create_task(self._close()))
            self._thread.join(3.0)

    # What follows runs in the server's thread.

    def take(self, client: object, event: Event) -> None:
        """Keep an event for the simulation."""
        if len(self._events) >= MOST_EVENTS:
            raise BadMessage("too many messages wait to be handled; this one was dropped")
        self._events.append((client, event))
        self.arrived.set()

    def leave(self, client: object) -> None:
        """Forget a browser that has gone; what it held, it lets go."""
        self.clients.discard(client)
        self._events.append((client, {"type": "release"}))
        self.arrived.set()

    def is_own(self, host: str) -> bool:
        """Tell whether `host`, of a request's header, is a name of this server."""
        if self._local:
            # Any other name that leads here was made to, by a page that wants to listen in.
            # The port may differ: a tunnel ends at one of its own.
            from tornado.httputil import split_host_and_port

            name = split_host_and_port(host.lower())[0]
            return name in ("127.0.0.1", "localhost", "[::1]", self.host.lower())
        return True

    def _call(self, routine: Callable[[], Any]) -> None:
        if not self._loop.is_closed():
            try:
                self._loop.call_soon_threadsafe(routine)
            except RuntimeError:  # closed since the question
                return

    def _wake(self) -> None:
        self._woken = False
        for client in self.clients:
            client.wake.set()

    async def _close(self) -> None:
        self._http.stop()
        for client in list(self.clients):
            client.say({"type": "end"})
        await asyncio.sleep(0.01)
        for client in list(self.clients):
            client.close(1001, "the run has ended")
        await asyncio.sleep(0.05)
        await self._http.close_all_connections()
        self._loop.stop()

    def _serve(self, sockets: list[Any], viewer: Path) -> None:
        import tornado.httpserver
        import tornado.web

        asyncio.set_event_loop(self._loop)
        socket_handler, file_handler = _handlers()
        files = {name.name: name for name in PAGE.iterdir() if name.suffix in _TYPES}
        files |= {"": PAGE / "index.html", "viewer.js": viewer}
        application = tornado.web.Application(
            [
                (r"/socket", socket_handler, {"server": self}),
                (r"/(.*)", file_handler, {"server": self, "files": files}),
            ],
            websocket_max_message_size=4 * LARGEST_MESSAGE,
            websocket_ping_interval=15,
            websocket_ping_timeout=15,
            log_function=lambda _: None,
        )
        self._http = tornado.httpserver.HTTPServer(application, max_body_size=LARGEST_MESSAGE)
        self._http.add_sockets(sockets)
        try:
            self._loop.run_forever()
        finally:
            self._loop.close()


def _remedy(number: int | None) -> str:
    if number == errno.EADDRNOTAVAIL:
        return "the host must be a name or an address of this machine"
    return "choose another port, or 0 for any that is free"


def _handlers() -> tuple[type, type]:
    """Make the two handlers; tornado is not loaded before somebody wants the page."""
    import tornado.iostream
    import tornado.web
    import tornado.websocket

    class FileHandler(tornado.web.RequestHandler):
        """The files of the page, and nothing else of the disk."""

        def initialize(self, server: Server, files: dict[str, Path]) -> None:
            self._server, self._files = server, files

        def get(self, name: str) -> None:
            if not self._server.is_own(self.request.host):
                raise tornado.web.HTTPError(403)
            path = self._files.get(name)
            if path is None:
                raise tornado.web.HTTPError(404)
            self.set_header("Content-Type", f"{_TYPES[path.suffix]}; charset=utf-8")
            self.set_header("Content-Security-Policy", _POLICY)
            self.set_header("Cache-Control", "no-cache")
            self.write(path.read_bytes())

        def data_received(self, chunk: bytes) -> None:
            """Take no uploads."""

        def write_error(self, status_code: int, **_: Any) -> None:
            self.set_header("Content-Type", "text/plain")
            self.finish(f"{status_code}: there is nothing here\n")

    class SocketHandler(tornado.websocket.WebSocketHandler):
        """One browser: what it has been told, and what it says."""

        def initialize(self, server: Server) -> None:
            self._server = server
            self.wake = asyncio.Event()
            self._scene, self._panel = 0, 0
            self._sent, self._seen = 0, 0
            self._last = 0.0
            self._answers: set[asyncio.Future[None]] = set()
            self._pump_task: asyncio.Future[None] | None = None

        def prepare(self) -> None:
            # Checked here, as versions of tornado differ in when they ask check_origin.
            host = self.request.headers.get("Host", "")
            origin = self.request.headers.get("Origin")
            same = origin is None or urlsplit(origin).netloc.lower() == host.lower()
            if not (same and self._server.is_own(host)):
                raise tornado.web.HTTPError(403)

        def check_origin(self, _origin: str) -> bool:
            return True

        def open(self, *_: str, **__: str) -> None:
            self.set_nodelay(True)
            self._server.clients.add(self)
            self._server.arrived.set()
            self.wake.set()
            self._pump_task = asyncio.ensure_future(self._pump())

        def on_message(self, message: str | bytes) -> None:
            try:
                event = read_event(message)
                if event["type"] == "seen":
                    self._seen = int(event["frame"])
                    self.wake.set()
                else:
                    self._server.take(self, event)
            except BadMessage as fault:
                self.say({"type": "error", "text": str(fault)})

        def on_close(self) -> None:
            if self._pump_task is not None:  # else it went before it was let in
                self._server.leave(self)
                self._pump_task.cancel()

        def say(self, data: dict[str, Any]) -> None:
            """Send one text, without waiting; nobody minds if the browser has gone."""
            if len(self._answers) < MOST_UNSAID:
                answer = asyncio.ensure_future(self._say(json.dumps(data)))
                self._answers.add(answer)
                answer.add_done_callback(self._answers.discard)

        async def _say(self, text: str) -> None:
            try:
                await self.write_message(text)
            except (tornado.websocket.WebSocketClosedError, tornado.iostream.StreamClosedError):
                return

        async def _pump(self) -> None:
            """Tell the browser what is new, at the pace at which it takes it."""
            try:
                while True:
                    await self._turn()
                    number, texts = self._server.source.panel_news(self._panel)
                    self._panel = number
                    for text in texts:
                        await self.write_message(text)
                    frame, scene = self._server.source.scene_news(self._scene)
                    self._scene = frame
                    if scene is not None:
                        self._sent += 1
                        self._last = time.monotonic()
                        await self.write_message(scene, binary=True)
            except (tornado.websocket.WebSocketClosedError, tornado.iostream.StreamClosedError):
                return

        async def _turn(self) -> None:
            """Wait until there is something new and the browser has drawn what it had."""
            await self.wake.wait()
            self.wake.clear()
            while self._sent - self._seen >= FRAMES_AHEAD:
                left = self._last + PATIENCE - time.monotonic()
                if left <= 0.0:
                    return
                try:
                    await asyncio.wait_for(self.wake.wait(), left)
                except TimeoutError:
                    return
                self.wake.clear()

    return SocketHandler, FileHandler
