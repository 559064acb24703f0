"""The loop that keeps a scene moving in real time while browsers look at it and play with it."""

from __future__ import annotations

import atexit
import math
import threading
import time
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.errors import NameNotFound, ScenarioError, SphshellError
from sphshell_pin.view.live import panel
from sphshell_pin.view.live.charts import Charts, Point
from sphshell_pin.view.live.events import BadMessage, Client, Event, newest
from sphshell_pin.view.live.interaction import Interaction
from sphshell_pin.view.live.picture import LIVE_PARTS, Picture
from sphshell_pin.view.live.server import Server
from sphshell_pin.view.live.window import LiveWindow
from sphshell_pin.view.nodes import Json, new_visualizer

if TYPE_CHECKING:
    from sphshell_pin.view.live.player import Player

FPS = 60.0
PANEL_PERIOD = 0.05  # [s] between two states of the panel
# Seconds of computing that a frame may take: what leaves 30 frames a second. Slower physics
# lowers the real-time factor instead.
BUDGET = 0.026
STRIP_POINTS = 600
LONGEST_STEP = 10.0  # simulated seconds of a single step
RATE_WINDOW = 1.0  # [s] over which the real-time factor is measured


class Live:
    """A live page of `player`, served at `url` until `stop`.

    `start` plays it in a thread of its own and returns; `run` plays it in the caller's until
    `stop` or Ctrl-C. `speed` is simulated seconds per second, from 0.01 to 10. Not `running`, it
    waits for the button; with `wait`, for the first browser.

    Raises MissingExtra without meshcat, SphshellError where the port is taken, InvalidParameter
    for a `speed` that is none.
    """

    def __init__(
        self,
        player: Player,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        speed: float = 1.0,
        running: bool = True,
        wait: bool = False,
    ) -> None:
        self.player = player
        self.speed = panel.check_speed(speed)
        self.running = running
        self.fault: Exception | None = None
        """What stopped the run, where that was no end of its own."""
        self._waiting = wait
        self._window = LiveWindow()
        self._panel = panel.Panel()
        self._charts = Charts(player)
        self._points: list[Point] = []
        self._clear_points = True
        self._factor = 1.0
        self._pace: deque[tuple[float, float]] = deque()
        self._changed = True
        self._parameter_values = self._read_parameters()
        self._next_panel = 0.0
        self._simulated = 0.0
        # Simulated time gone beyond what was due: a fixed step may be longer than a frame.
        self._ahead = 0.0
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        # First of all the port: a picture takes time.
        self.server = Server(self._window, self._panel, host, port)
        try:
            self.picture = Picture(player, new_visualizer(self._window))
            self._interaction = Interaction(player, self.picture, self._window)
            hello = {"type": "hello", **panel.greeting(player, self._interaction.offer())}
            self._panel.post("hello", hello | {"series": self._charts.descriptions()})
            self.draw()
        except BaseException:
            self.server.stop()
            raise

    @property
    def url(self) -> str:
        """The address of the page; it ends with a token, without which access is refused."""
        return self.server.url

    @property
    def _spacing(self) -> float:
        """Simulated time between two points of the strip [s]."""
        return self.speed * panel.STRIP_SECONDS / STRIP_POINTS

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per second, over the last second; 0 while it stands still."""
        if len(self._pace) < 2:
            return 0.0
        (start, before), (end, now) = self._pace[0], self._pace[-1]
        return (now - before) / (end - start) if end > start else 0.0

    def start(self) -> Live:
        """Play in a thread of its own, and return at once."""
        if self._thread is None:
            # A thread must not be inside the compiled loop when the interpreter goes down.
            atexit.register(self.stop)
            self._thread = threading.Thread(target=self._play, daemon=True, name="live-run")
            self._thread.start()
        return self

    def stop(self) -> None:
        """End the run and its page."""
        atexit.unregister(self.stop)
        self._stop.set()
        self.server.arrived.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(5.0)
        self.server.stop()

    def run(self) -> None:
        """Play here until `stop`, or until Ctrl-C, which ends it cleanly."""
        try:
            self._play()
        except KeyboardInterrupt:
            pass
        finally:
            self.stop()

    def __enter__(self) -> Live:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    # Frames

    def _play(self) -> None:
        due = last = time.perf_counter()
        while not self._stop.is_set():
            now = time.perf_counter()
            self.frame(now - last)
            last = now
            due = max(due + 1.0 / FPS, time.perf_counter() - 1.0 / FPS)
            idle = not self.running or self._waiting
            # Standing still it only wakes for events, or to keep a late browser up to date.
            left = (0.25 if idle and not self._changed else 0.0) + due - time.perf_counter()
            if left > 0.0 and idle:
                self.server.arrived.wait(left)
            elif left > 0.0:
                time.sleep(left)

    def frame(self, wall: float) -> None:
        """Handle the events of browsers, go on by `wall` [s] at the speed chosen, and draw."""
        watched = self.server.watched
        began, told = time.perf_counter(), False
        for client, event in newest(self.server.events()):
            if self._stop.is_set():
                return
            if event["type"] == "step" and time.perf_counter() - began > 20 * BUDGET:
                # Others wait for what a queue of steps takes.
                if not told:
                    self.server.report(client, "steps came faster than they run: some are left out")
                told = True
                continue
            try:
                self._handle(client, event)
            except SphshellError as fault:
                self.server.report(client, str(fault))
            except Exception as fault:
                # No request of a browser ends the run.
                self.server.report(client, f"{type(fault).__name__}: {fault}")
            self._changed = True
            self._parameter_values = self._read_parameters()
        if self._waiting and watched:
            self._waiting = False
            wall = 0.0
        if self.running and not self._waiting:
            self._follow(self.speed * min(wall, 2.0 * BUDGET))
        else:
            self._pace.clear()
        if watched:
            self.draw()

    def draw(self) -> None:
        """Bring the scene up to date for all browsers, and now and then the panel."""
        now = time.perf_counter()
        if self._changed:
            self._changed = False
            try:
                # A diverging run is reported in the panel, not on the terminal.
                with np.errstate(all="ignore"):
                    self.picture.update(self.player, self._interaction.push, self._interaction.drag)
            except Exception as fault:
                # A picture that fails is reported in the panel, which goes on.
                self.fault = fault
                self.running = False
            self._window.commit()
        if now >= self._next_panel:
            self._next_panel = now + PANEL_PERIOD
            self._panel.publish(
                self._state(), self._points, self._charts.keys, clear=self._clear_points
            )
            self._points, self._clear_points = [], False
        self.server.wake()

    def _follow(self, due: float) -> None:
        """Go on by what is `due` [s], less what an earlier frame went too far."""
        wanted = due - self._ahead
        if wanted > 0.0:
            before = self.player.time
            self._advance(wanted, BUDGET)
            self._ahead = max(0.0, self.player.time - before - wanted)
        else:
            self._ahead = -wanted
            self._keep_pace()

    def _advance(self, duration: float, wall: float) -> None:
        player = self.player
        before = player.time
        try:
            rows = player.advance(duration, wall)
        except Exception as fault:
            self.fault = fault
            self.running = False
            self._changed = True
            return
        self._changed = self._changed or duration > 0.0
        if not len(rows.t) and player.time > before:
            # In slow motion a frame is shorter than the time between two recorded rows.
            rows = panel.rows_now(player)
        self._points += self._charts.add(rows, self._spacing)
        self._points = self._points[-2 * STRIP_POINTS :]
        self._simulated += player.time - before
        self._keep_pace()
        if player.ended is not None:
            self.running = False

    def _keep_pace(self) -> None:
        now = time.perf_counter()
        self._pace.append((now, self._simulated))
        while self._pace[0][0] < now - RATE_WINDOW:
            self._pace.popleft()

    # Events

    def _handle(self, client: Client, event: Event) -> None:
        match event["type"]:
            case "run":
                self._run(event["on"])
            case "step":
                self.running = False
                self._waiting = False
                self._check_can_go_on()
                self._advance(min(event["seconds"], LONGEST_STEP), 20 * BUDGET)
            case "reset":
                self.player.reset()
                self._start_anew()
            case "speed":
                self.speed = min(max(event["value"], panel.SLOWEST), panel.FASTEST)
                self._pace.clear()
            case "parameter":
                self._change(event["key"], event["value"])
            case "push" | "drag" | "target":
                self._interaction.do(client, event)
            case "release":
                self._interaction.release(client)
                if client not in self.server.clients and self._charts.forget(client):
                    self._send_curves()
            case "show":
                if event["part"] not in LIVE_PARTS:
                    raise NameNotFound("part", event["part"], "the picture", LIVE_PARTS)
                if event["part"] == "pressure":
                    self._interaction.record_patches(event["on"])
                self.picture.show(event["part"], event["on"])
            case "arrows":
                self.picture.magnify_arrows(min(max(event["value"], 1e-2), 1e2))
            case "charts":
                if self._charts.ask(client, event["keys"]):
                    self._send_curves()

    def _change(self, key: str, value: float | str) -> None:
        labels = {one.key: one.label for one in self.player.parameters}
        if key not in labels:
            raise NameNotFound("parameter", key, "this run", labels)
        before = self.player.time
        try:
            self.player.change(key, value)
        except SphshellError as fault:
            raise BadMessage(f"{_named(labels[key], key)}: {_reason(fault, key)}") from fault
        if self.player.time < before:  # it started again
            self._start_anew()

    def _run(self, on: bool) -> None:
        self._waiting = False
        if on:
            self._check_can_go_on()
        self.running = on

    def _check_can_go_on(self) -> None:
        if self.fault is not None or self.player.ended is not None:
            raise BadMessage(f"{self._why_ended()} Reset to start again.")

    def _why_ended(self) -> str | None:
        if self.fault is None:
            return self.player.ended
        known = isinstance(self.fault, SphshellError)
        return str(self.fault) if known else f"{type(self.fault).__name__}: {self.fault}"

    def _start_anew(self) -> None:
        self.fault = None
        self._interaction.forget()
        self._ahead = 0.0
        self._charts.clear()
        self._points, self._clear_points = [], True
        self._pace.clear()
        self.picture.clear()

    def _send_curves(self) -> None:
        """Send the curves that are shown now, from the rows that are there."""
        ask = getattr(self.player, "ask", None)
        if ask is not None:
            ask(self._charts.sources)
        since = self.player.time - panel.STRIP_SECONDS * self.speed
        self._points, self._clear_points = self._charts.again(since, self._spacing), True

    # The panel

    def _read_parameters(self) -> dict[str, float | str]:
        return {one.key: one.value for one in self.player.parameters}

    def _state(self) -> Json:
        player, contacts = self.player, self.player.contacts
        listed = panel.list_contacts(contacts, player.scene.pairs)
        exchanged = player.exchanged
        residual = player.residual
        return {
            "t": player.time,
            "running": self.running and not self._waiting,
            "speed": self.speed,
            "factor": self.real_time_factor,
            "contacts": listed,
            "more": len(contacts) - len(listed),
            "residual": residual,
            "relative": abs(residual) / exchanged if exchanged > 0.0 else math.nan,
            "exchanged": exchanged,
            "ended": self._why_ended(),
            "parameters": self._parameter_values,
            "show": self.picture.switches(player, self._interaction.can_record_patches),
            "arrows": self.picture.magnification,
            "scale": str(self.picture.arrow_scale),
            "cut": self.picture.cut,
            "pressure": self.picture.pressure,
            "grid": self.picture.display.grid,
            **self._interaction.state(),
        }


def _named(label: str, key: str) -> str:
    """Return the word beside the slider, and the key of the scenario where that is another one."""
    return label if label == key else f"{label} ({key})"


def _reason(fault: SphshellError, key: str) -> str:
    """Return what is wrong with the value at `key`, without the file and the name of the value."""
    text = str(fault)
    if isinstance(fault, ScenarioError):
        text = text.removeprefix(f"{fault.path}: ").removeprefix(f"{fault.key}: ")
    return text.removeprefix(f"{key} = ").removeprefix(f"{key.rpartition('.')[2]} = ")
