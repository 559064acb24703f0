"""The live page's frame rate: python -m benchmarks.preview [--seconds S] [SCENARIO].

Plays a scenario (the Panda's by default) in real time with no browser, with one that answers at
once, and with that one beside a browser that never reads. Prints frames a second, the real-time
factor, and the milliseconds a frame takes in the loop's thread: all of it, and what the page costs
(its share without the physics).
"""

import argparse
import multiprocessing
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.study.report.machine import machine
from sphshell_pin.view.live import Live
from sphshell_pin.view.live.server import Server

Counter = Any  # multiprocessing.Value: a class to typeshed, a function when it runs
GREETING = (
    "GET /socket?token={token} HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\n"
    "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


def fast_browser(port: int, token: str, count: Counter) -> None:
    """Take every frame, and ask for the next at once; in a process of its own."""
    import asyncio
    import json

    from tornado.websocket import websocket_connect

    async def visit() -> None:
        address = f"ws://127.0.0.1:{port}/socket?token={token}"
        page = await websocket_connect(address, max_message_size=2**28)
        while (message := await page.read_message()) is not None:
            if isinstance(message, bytes):
                count.value += 1
                page.write_message(json.dumps({"type": "seen", "frame": count.value}))

    asyncio.run(visit())


@contextmanager
def audience(server: Server, kinds: tuple[str, ...]) -> Iterator[Counter]:
    """Let browsers of these kinds, "fast" and "deaf", look on; yield what the fast one counts."""
    count = multiprocessing.Value("q", 0)
    port, token = server.port, server.access.token
    processes, deaf = [], []
    for kind in kinds:
        if kind == "fast":
            arguments = (port, token, count)
            processes.append(multiprocessing.Process(target=fast_browser, args=arguments))
            processes[-1].daemon = True
            processes[-1].start()
        else:
            deaf.append(socket.create_connection(("127.0.0.1", port)))
            deaf[-1].setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            deaf[-1].sendall(GREETING.format(token=token).encode())
    try:
        yield count
    finally:
        for process in processes:
            process.kill()
        for one in deaf:
            one.close()


class Stopwatch:
    """Notes how long each call of an object's method takes [s]."""

    def __init__(self, owner: object, name: str) -> None:
        self.times: list[float] = []
        routine = getattr(owner, name)

        def timed(*arguments: object) -> object:
            start = time.perf_counter()
            try:
                return routine(*arguments)
            finally:
                self.times.append(time.perf_counter() - start)

        setattr(owner, name, timed)


def measure(scenario: str, kinds: tuple[str, ...], seconds: float) -> str:
    """Return one line of the table."""
    live = Live(LiveRun(build(scenario)))
    frame, advance = Stopwatch(live, "frame"), Stopwatch(live.player, "advance")
    live.start()
    try:
        with audience(live.server, kinds) as count:
            while kinds and (not live.server.watched or ("fast" in kinds and count.value < 30)):
                time.sleep(0.05)
            time.sleep(0.5)
            seen, wall, simulated = count.value, time.perf_counter(), live.player.time
            frames, advances = len(frame.times), len(advance.times)
            time.sleep(seconds)
            elapsed = time.perf_counter() - wall
            factor = (live.player.time - simulated) / elapsed
            taken = 1e3 * np.array(frame.times[frames:])
            physics = 1e3 * np.array(advance.times[advances:])
            seen_rate = (count.value - seen) / elapsed
    finally:
        live.stop()
    page = taken[: len(physics)] - physics[: len(taken)]
    low, middle, high = np.percentile(page, [25, 50, 75])
    name = " + ".join(kinds) or "none"
    return (
        f"{name:14s} {len(taken) / elapsed:8.1f} {seen_rate if 'fast' in kinds else np.nan:10.1f} "
        f"{factor:9.3f} {np.median(taken):8.2f} {np.max(taken):8.1f} "
        f"{middle:8.2f} [{low:.2f}, {high:.2f}]"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.preview", description=__doc__)
    parser.add_argument("scenario", nargs="?", default="fingertip_on_blade")
    parser.add_argument("--seconds", type=float, default=5.0, help="length of each measurement")
    given = parser.parse_args()
    print(machine())
    print(f"{given.scenario}, in real time, {given.seconds:g} s each; frame and page in ms")
    print("browsers       frames/s  seen/s  real-time   frame   longest     page [quartiles]")
    for kinds in ((), ("fast",), ("fast", "deaf")):
        print(measure(given.scenario, kinds, given.seconds), flush=True)


if __name__ == "__main__":
    main()
