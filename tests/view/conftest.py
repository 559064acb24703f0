import pytest

from sphshell_pin.view.live import Live
from tests.view.live_driver import WATCHER
from tests.view.live_player import BallPlayer


@pytest.fixture
def make():
    """Makes live pages, by default of a ball; `told` lists the answers to browsers."""
    made = []

    def make_live(player=None, *, watched=False, **options):
        live = Live(BallPlayer() if player is None else player, **options)
        live.told = []
        live.server.report = lambda client, text: live.told.append((client, text))
        if watched:
            live.server.clients.add(WATCHER)
        made.append(live)
        return live

    yield make_live
    for live in made:
        live.server.clients.clear()
        live.stop()
