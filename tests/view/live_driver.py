"""A live page without its browsers: frames one by one, and events as if tabs had sent them."""

import asyncio


class StandIn:
    """Stands in for a browser's tab."""

    wake = asyncio.Event()

    def send(self, data):
        pass


TAB, OTHER_TAB, WATCHER = StandIn(), StandIn(), StandIn()


class ForeignWindow:
    """Stands in for the window of somebody's meshcat server."""

    web_url = "http://127.0.0.1:7000/static/"

    def __init__(self):
        self.commands = []

    def send(self, command):
        self.commands.append(command.lower())


def say(live, kind, client=TAB, **fields):
    live.server.take(client, {"type": kind, **fields})


def frames(live, count, wall=1 / 60):
    for _ in range(count):
        live.frame(wall)
