"""The server of the live page: a thread with its own loop, which the simulation never waits for."""

from __future__ import annotations

import asyncio
import collections
import errno
import json
import os
import socket
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.errors import InvalidParameter, MissingExtra, SphshellError
from sphshell_pin.view.live.access import Access
from sphshell_pin.view.live.events import LARGEST_MESSAGE, BadMessage, Client, Event, read_event
from sphshell_pin.view.nodes import viewer_script

if TYPE_CHECKING:
    from types import TracebackType

    from tornado.iostream import IOStream

    from sphshell_pin.view.live.panel import Panel
    from sphshell_pin.view.live.window import LiveWindow

PAGE = Path(__file__).with_name("page")
MOST_EVENTS = 2_000  # waiting to be handled; more are refused

MOST_UNSENT = 50  # answers to a browser that does not read; more are dropped

# A stranger may connect, too: not so often, nor for so long, that no file can be opened any more.
MOST_CONNECTIONS = 200
SILENCE = 10.0  # [s] until the next request, or the rest of one

# A browser confirms what it has drawn. This many frames are sent unconfirmed; after the time [s],
# as in a tab that is hidden and draws nothing, the next one is sent all the same.
FRAMES_AHEAD = 2
PATIENCE = 1.0

_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}


class Server:
    """Serves the page and one websocket per browser at `url`, until `stop`.

    What changed it takes from `window` and `panel`, in its thread. Events of all browsers are
    gathered by `events`.

    Raises MissingExtra without meshcat, SphshellError where the port is taken.
    """

    def __init__(self, window: LiveWindow, panel: Panel, host: str, port: int) -> None:
        viewer = viewer_script()
        try:
            import tornado.netutil
        except ImportError as missing:
            raise MissingExtra("tornado", "view", "the live page") from missing
        if isinstance(port, bool) or not isinstance(port, int) or not 0 <= port <= 65535:
            raise InvalidParameter("port", port, "must be a port number from 0 (any free) to 65535")
        self.window, self.panel = window, panel
        self.clients: set[Client] = set()
        self.arrived = threading.Event()
        """Set when there is something for the simulation to do."""
        self._events: collections.deque[tuple[Client, Event]] = collections.deque()
        self._woken = False
        self._stopping = False
        try:
            # One port has to do for all addresses of a name.
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
        self.access = Access(host, address)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(
            target=self._serve, args=(sockets, viewer), daemon=True, name="live-page"
        )
        self._thread.start()

    @property
    def url(self) -> str:
        """The address of the page, which gives access to it."""
        name = "localhost" if self.host in ("", "0.0.0.0", "::") else self.host
        place = f"[{name}]" if ":" in name else name
        return f"http://{place}:{self.port}/?token={self.access.token}"

    @property
    def is_open(self) -> bool:
        """Whether other machines may reach the page."""
        return self.access.is_open

    @property
    def watched(self) -> bool:
        """Whether any browser is connected."""
        return bool(self.clients)

    def events(self) -> list[tuple[Client, Event]]:
        """Return the events since the last call, each with the browser it came from."""
        self.arrived.clear()
        return [self._events.popleft() for _ in range(len(self._events))]

    def wake(self) -> None:
        """Send every browser what is new; returns at once."""
        if self.clients and not self._woken:
            self._woken = True
            self._call(self._wake)

    def report(self, client: Client, text: str) -> None:
        """Send one browser a sentence that it shows."""
        self._call(lambda: client.send({"type": "error", "text": text}))

    def stop(self) -> None:
        """Close the connections and end the thread."""
        if not self._stopping:
            self._stopping = True
            self._call(lambda: self._loop.create_task(self._close()))
            self._thread.join(3.0)

    # What follows runs in the server's thread.

    def take(self, client: Client, event: Event) -> None:
        """Keep an event for the simulation."""
        if len(self._events) >= MOST_EVENTS:
            raise BadMessage("too many messages wait to be handled; this one was dropped")
        self._events.append((client, event))
        self.arrived.set()

    def leave(self, client: Client) -> None:
        """Forget a browser that has gone, and end what it drags."""
        self.clients.discard(client)
        self._events.append((client, {"type": "release"}))
        self.arrived.set()

    def _call(self, routine: Callable[[], object]) -> None:
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
            client.send({"type": "end"})
        await asyncio.sleep(0.01)
        for client in list(self.clients):
            client.close(1001, "the run has ended")
        await asyncio.sleep(0.05)
        await self._http.close_all_connections()
        self._loop.stop()

    def _serve(self, sockets: list[socket.socket], viewer: Path) -> None:
        import tornado.httpserver
        import tornado.web

        class HTTPServer(tornado.httpserver.HTTPServer):
            def handle_stream(self, stream: IOStream, address: tuple[object, ...]) -> None:
                if len(self._connections) >= MOST_CONNECTIONS:
                    stream.close()
                else:
                    super().handle_stream(stream, address)

        asyncio.set_event_loop(self._loop)
        socket_handler, file_handler = _handlers()
        files = {name.name: name for name in PAGE.iterdir() if name.suffix in _TYPES}
        files |= {"": PAGE / "index.html", "viewer.js": viewer}
        shared = {"server": self, "files": files}
        application = tornado.web.Application(
            [(r"/(?:[^/]*/)?socket", socket_handler, shared), (r".*", file_handler, shared)],
            websocket_max_message_size=4 * LARGEST_MESSAGE,
            websocket_ping_interval=15,
            websocket_ping_timeout=15,
            log_function=lambda _: None,
            access=self.access,
        )
        self._http = HTTPServer(
            application,
            max_body_size=LARGEST_MESSAGE,
            max_header_size=LARGEST_MESSAGE,
            idle_connection_timeout=SILENCE,
            body_timeout=SILENCE,
        )
        self._http.add_sockets(sockets)
        try:
            self._loop.run_forever()
            pending = asyncio.all_tasks(self._loop)
            for task in pending:
                task.cancel()
            self._loop.run_until_complete(asyncio.gather(*pending, return_exceptions=True))
        finally:
            self._loop.close()


def _remedy(number: int | None) -> str:
    if number == errno.EADDRNOTAVAIL:
        return "the host must be a name or an address of this machine"
    return "choose another port, or 0 for any that is free"


def _handlers() -> tuple[type, type]:
    """Make the two handlers; tornado is not loaded before the page is asked for."""
    import tornado.iostream
    import tornado.web
    import tornado.websocket

    class Checked(tornado.web.RequestHandler):
        """What both have in common: no access without the token, no frames, no tracebacks."""

        def initialize(self, server: Server, files: dict[str, Path]) -> None:
            self._server, self._files = server, files

        def set_default_headers(self) -> None:
            self._set_headers()

        def _set_headers(self, **checked: str) -> None:
            for name, value in self.application.settings["access"].headers(**checked).items():
                self.set_header(name, value)

        def prepare(self) -> None:
            try:
                self.name = self._server.access.check(self.request)
            except PermissionError as refused:
                self.refused = str(refused)
                raise tornado.web.HTTPError(403) from None

        def write_error(self, status_code: int, **_: object) -> None:
            self.set_header("Content-Type", "text/plain")
            self.finish(f"{status_code}: {getattr(self, 'refused', 'there is nothing here')}\n")

        def log_exception(
            self,
            kind: type[BaseException] | None,
            value: BaseException | None,
            traceback: TracebackType | None,
        ) -> None:
            if not isinstance(value, tornado.web.HTTPError):
                super().log_exception(kind, value, traceback)

        def data_received(self, chunk: bytes) -> None:
            """Take no uploads."""

    class FileHandler(Checked):
        """The files of the page, and nothing else of the disk."""

        def get(self) -> None:
            path = self._files.get(self.name)
            if path is None:
                raise tornado.web.HTTPError(404)
            self._set_headers(host=self.request.host.lower())
            self.set_header("Content-Type", f"{_TYPES[path.suffix]}; charset=utf-8")
            content = read_bytes(path)
            if path.suffix == ".html":
                content = content.replace(b"@@token@@", self._server.access.token.encode())
            self.write(content)

    class SocketHandler(Checked, tornado.websocket.WebSocketHandler):
        """One browser: what was sent to it, and its events."""

        def initialize(self, server: Server, files: dict[str, Path]) -> None:
            super().initialize(server, files)
            self.wake = asyncio.Event()
            self._scene, self._panel = 0, 0
            self._sent, self._seen = 0, 0
            self._last = 0.0
            self._answers: set[asyncio.Future[None]] = set()
            self._pump_task: asyncio.Future[None] | None = None

        def check_origin(self, _origin: str) -> bool:
            return True  # checked in prepare, as versions of tornado differ in when they ask

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
                self.send({"type": "error", "text": str(fault)})

        def on_close(self) -> None:
            if self._pump_task is not None:  # else it went before it was let in
                self._server.leave(self)
                self._pump_task.cancel()

        def send(self, data: Mapping[str, object]) -> None:
            """Send one text, without waiting; a browser that has gone is no error."""
            if len(self._answers) < MOST_UNSENT:
                answer = asyncio.ensure_future(self._send(json.dumps(data)))
                self._answers.add(answer)
                answer.add_done_callback(self._answers.discard)

        async def _send(self, text: str) -> None:
            try:
                await self.write_message(text)
            except (tornado.websocket.WebSocketClosedError, tornado.iostream.StreamClosedError):
                return

        async def _pump(self) -> None:
            """Send the browser what is new, as fast as it draws."""
            try:
                while True:
                    await self._turn()
                    number, texts = self._server.panel.news(self._panel)
                    self._panel = number
                    for text in texts:
                        await self.write_message(text)
                    frame, scene = self._server.window.news(self._scene)
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
