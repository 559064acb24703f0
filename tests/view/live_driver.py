"""A live page without its browsers: frames one by one, and events as if tabs had sent them."""

import asyncio


class StandIn:
    """Stands in for a browser's tab."""

    wake = asyncio.Event()

    def send(self, data):
        pass


TAB, OTHER_TAB, WATCHER = StandIn(), StandIn(), StandIn()


def say(live, kind, client=TAB, **fields):
    live.server.take(client, {"type": kind, **fields})


def frames(live, count, wall=1 / 60):
    for _ in range(count):
        live.frame(wall)
