"""The loop, frame by frame: what time does, what events do, what is not done."""

import time
import warnings
from unittest.mock import Mock

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter, NameNotFound, SimulationDiverged
from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.view import live as live_module
from sphshell_pin.view.live import Live, loop, preview
from sphshell_pin.view.live.loop import BUDGET, FPS
from sphshell_pin.view.live.opening import player_of
from tests.scenario.files import DROP, write
from tests.view.live_driver import TAB, frames, say
from tests.view.live_player import BallPlayer

PUSH = {"body": "ball", "direction": [1.0, 0.0, 0.0]}


@pytest.fixture
def drop(make, tmp_path):
    """Makes the live page of a drop with other text in its file."""

    def drop(old="", new="", knob="", **options):
        end = f'\n[[knob]]\nkey = "{knob}"\n' if knob else ""
        return make(LiveRun(build(write(tmp_path, DROP.replace(old, new) + end))), **options)

    return drop


def test_time_runs_as_fast_as_asked(make):
    live = make(speed=0.5)
    frames(live, 60)
    assert live.player.time == pytest.approx(0.5, rel=1e-6)
    say(live, "speed", value=2.0)
    frames(live, 60)
    assert live.player.time == pytest.approx(2.5, rel=1e-6)


def test_pause_step_run_reset(make):
    live = make()
    say(live, "run", on=False)
    frames(live, 10)
    assert live.player.time == 0.0
    for _ in range(3):  # a key held down, which acts no longer than until it is let go
        say(live, "step", seconds=0.002)
    frames(live, 2)
    assert live.player.time == pytest.approx(0.006)
    assert len(live.player.calls) == 1
    assert not live.running
    say(live, "run", on=True)
    frames(live, 6)
    assert live.player.time == pytest.approx(0.106)
    say(live, "reset")
    live.frame(0.0)
    assert live.player.time == 0.0
    assert live.running


def test_physics_too_slow_lowers_the_factor_and_not_the_frames(make):
    # Ten seconds of computing a second: no frame may ask for more than its share.
    live = make(BallPlayer(wall_per_second=10.0))
    frames(live, 30)
    assert all(wall == BUDGET for _, wall in live.player.calls)
    assert live.player.time == pytest.approx(30 * min(1 / 60, BUDGET / 10.0))
    # A frame that came late does not make the next one longer and longer.
    live.player.calls.clear()
    live.frame(5.0)
    assert live.player.calls[0][0] <= 2.0 * BUDGET


def test_it_waits_for_the_first_browser_if_asked_to(make):
    live = make(wait=True)
    frames(live, 10)
    assert live.player.time == 0.0
    live.server.clients.add(TAB)
    frames(live, 10)
    assert live.player.time > 0.1


def test_a_slider_that_is_dragged_is_one_change(make):
    live = make()
    changes = []
    change = live.player.change
    live.player.change = lambda key, value: (changes.append(value), change(key, value))
    for value in np.linspace(1e3, 2e3, 500):
        say(live, "parameter", key="stiffness", value=value)
        say(live, "parameter", key="radius", value=value / 4e4)
    live.frame(0.0)
    assert changes == [2e3, 0.05]


def test_a_push_has_its_direction_force_and_time(make):
    live = make()
    say(live, "push", body="ball", direction=[0.0, 0.6, 0.8], newtons=10.0, seconds=0.25)
    live.frame(0.0)
    np.testing.assert_allclose(live.player.force, [0.0, 6.0, 8.0])
    assert live.player.push_end == 0.25
    frames(live, 60)
    # Impulse and momentum: F t = m v along y, which nothing else acts on.
    assert live.player.v[1] == pytest.approx(6.0 * 0.25, rel=0.01)


@pytest.mark.parametrize("what", ["player.advance", "picture.update"])
@pytest.mark.parametrize(
    "fault", [SimulationDiverged(0.5, "it blew up", None), ZeroDivisionError("no direction")]
)
def test_what_fails_stops_the_run_says_why_and_can_start_again(make, monkeypatch, what, fault):
    live = make(watched=True)
    owner, name = what.split(".")
    with monkeypatch.context() as broken:
        broken.setattr(getattr(live, owner), name, Mock(side_effect=fault))
        frames(live, 3)
        assert not live.running
        assert str(fault) in live._state()["ended"]
        say(live, "run", on=True)
        frames(live, 1)
        assert "Reset" in live.told[-1][1]
    say(live, "reset")
    say(live, "run", on=True)
    frames(live, 10)
    assert live.player.time > 0.1
    assert live._state()["ended"] is None


class Clock:
    """Stands in for the module `time`: only sleeping takes time; at 7 s it calls `then`."""

    def __init__(self, then):
        self.now, self.then = 5.0, then

    def perf_counter(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds
        if self.now > 7.0:
            self.then()


def test_it_keeps_real_time(make, monkeypatch):
    live = make(speed=0.5)
    clock = Clock(live.stop)
    monkeypatch.setattr(loop, "time", clock)
    live.run()
    assert live.player.time == pytest.approx(0.5 * (clock.now - 5.0), abs=1.0 / FPS)


def test_what_can_be_previewed():
    player = BallPlayer()
    assert player_of(player) is player
    with pytest.raises(InvalidParameter, match="must be a scenario"):
        player_of(7)
    with pytest.raises(NameNotFound, match="fingertip_on_blade"):
        player_of("no_such_scenario")
    for speed in (0.0, -1.0, 100.0, np.nan, np.inf):
        with pytest.raises(InvalidParameter, match="speed"):
            preview(player, speed=speed)


def test_preview_tells_the_address_and_ends(monkeypatch):
    opened, told = [], []
    monkeypatch.setattr(live_module.opening, "open_browser", opened.append)
    monkeypatch.setattr(Live, "run", lambda live: live.stop())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        preview(BallPlayer(), told=told.append)
    assert told == opened
    assert told[0].startswith("http://127.0.0.1:")
    preview(BallPlayer(), told=told.append, open=False)
    assert len(opened) == 1


def test_fixed_steps_longer_than_a_frame_keep_the_speed(drop):
    """A step of 1 ms, a frame of 0.17 ms: one step in six frames."""
    live = drop("dt = 1e-4", "dt = 1e-3", speed=0.01)
    frames(live, 600)
    assert live.player.time == pytest.approx(0.1, abs=1.1e-3)


def test_the_arrow_of_a_push_ends_where_a_knob_starts_the_run_anew(drop):
    height = "robot.ball.start.root_joint.2"
    live = drop(knob=height)
    say(live, "push", **PUSH, newtons=0.1, seconds=5.0)
    frames(live, 7)
    assert live._interaction.push is not None
    say(live, "parameter", key=height, value=0.05)
    frames(live, 1)
    assert live._interaction.push is None


def test_the_legend_says_where_arrows_are_cut(make):
    live = make(watched=True)
    frames(live, 60)
    assert live._state()["cut"] is False
    say(live, "push", **PUSH, newtons=1e6, seconds=1.0)
    live.running = False
    frames(live, 1)
    assert live._state()["cut"] is True


def test_a_queue_of_steps_gives_way_to_others(make, monkeypatch):
    live, taken = make(), []
    monkeypatch.setattr(loop, "BUDGET", 1e-3)
    advance = live.player.advance
    live.player.advance = lambda *a: (time.sleep(0.005), taken.append(1), advance(*a))[2]
    for _ in range(100):
        say(live, "step", seconds=1e-3)
        say(live, "look")  # between steps of one tab, which count once
    say(live, "speed", value=0.25)
    live.frame(0.0)
    assert 0 < len(taken) < 50
    assert live.speed == 0.25
    assert [text for _, text in live.told] == ["steps came faster than they run: some are left out"]


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("law.stiffness", -5.0, "stiffness ({key}): should be greater than 0 (given: -5.0)"),
        ("law.stiffness", "abc", "stiffness ({key}): 'abc' must be a number"),
        ("friction.mu_static", 0.0, "static friction ({key}): mu_dynamic = 0.2 must not exceed"),
    ],
)
def test_a_value_that_cannot_be_is_answered_in_the_words_of_its_slider(
    drop, tmp_path, key, value, told
):
    friction = 'friction = { type = "coulomb", mu_static = 0.3, mu_dynamic = 0.2 }\n[run]'
    key = f"contact.ball-plate.{key}"
    live = drop("[run]", friction, key)
    say(live, "parameter", key=key, value=value)
    frames(live, 1)
    ((client, answer),) = live.told
    assert client is TAB
    assert answer.startswith(told.format(key=key))
    assert str(tmp_path) not in answer


def test_nothing_is_drawn_for_nobody(make):
    live = make()
    drawn = live._window.frame
    state = live._panel.news(0)[0]
    frames(live, 20)
    assert live.player.time > 0.3
    assert (live._window.frame, live._panel.news(0)[0]) == (drawn, state)
