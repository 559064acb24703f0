"""A browser without a picture, for tests of the server: real HTTP, a real websocket."""

import asyncio
import contextlib
import json
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

import umsgpack
from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

PATIENCE = 60.0


def run(visit):
    """Return what a coroutine returns; in a thread, as a browser of playwright has a loop here."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, visit).result()


def inside(url, name, scheme="http"):
    """Return the address of a file of the page at `url`."""
    return urlsplit(url)._replace(scheme=scheme, path=f"/{name}").geturl()


def get(url, **headers):
    """Return status, body and headers of a page."""
    try:
        answer = urllib.request.urlopen(urllib.request.Request(url, headers=headers))
    except urllib.error.HTTPError as refused:
        answer = refused
    with answer:
        return answer.status, answer.read(), dict(answer.headers)


class Client:
    """One websocket; keeps what it was told."""

    def __init__(self, url, answers=True):
        self.address = inside(url, "socket", "ws")
        self.answers = answers
        self.hello, self.state, self.end, self.closed = None, None, None, False
        self.errors, self.scenes = [], []

    async def open(self, **headers):
        request = HTTPRequest(self.address, headers=headers)
        self.socket = await websocket_connect(request, max_message_size=2**28)
        return self

    async def __aenter__(self):
        return await self.open()

    async def __aexit__(self, *_):
        self.socket.close()

    def say(self, kind, **fields):
        return self.socket.write_message(json.dumps({"type": kind, **fields}))

    async def read(self):
        """Take one message."""
        message = await asyncio.wait_for(self.socket.read_message(), PATIENCE)
        if message is None:
            self.closed = True
        elif isinstance(message, bytes):
            self.scenes.append(umsgpack.unpackb(message))
            if self.answers:
                with contextlib.suppress(WebSocketClosedError):
                    await self.say("seen", frame=len(self.scenes))
        else:
            data = json.loads(message)
            if data["type"] == "error":
                self.errors.append(data["text"])
            else:
                setattr(self, data["type"], data)

    async def until(self, condition):
        """Read until condition(self) holds, or the connection is closed."""
        deadline = asyncio.get_running_loop().time() + PATIENCE
        while not condition(self) and not self.closed:
            assert asyncio.get_running_loop().time() < deadline, "it never came"
            await self.read()
        return self
