"""From whatever there is to run to a live page: scenarios, built ones, players."""

from __future__ import annotations

import atexit
import contextlib
import html
import os
import sys
import tempfile
import webbrowser
from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.errors import InvalidParameter, ResultError
from sphshell_pin.view.live.loop import Live
from sphshell_pin.view.live.panel import check_speed

if TYPE_CHECKING:
    from sphshell_pin.view.live.player import Player

RESULT = "run.npz"


def preview(
    what: object,
    *,
    changes: Mapping[str, str] | None = None,
    speed: float = 1.0,
    paused: bool = False,
    host: str = "127.0.0.1",
    port: int = 0,
    open: bool = True,
    faces: bool = False,
    told: Callable[[str], object] = print,
) -> None:
    """Show `what` in a live page until Ctrl-C.

    Parameters
    ----------
    what
        A scenario (name, path, or built), or any Player.
    changes
        Values of a scenario by dotted key.
    speed
        Simulated seconds per second, 0.01 to 10.
    paused
        Wait for the button; else the run starts when the first browser is there.
    host, port
        Where the page is served; port 0 takes any that is free.
    open
        Open the page in the web browser, where there is a screen.
    faces
        Color the shells by the kinds of their faces. The page can change it.
    told
        Called with the page's address, which ends with a token and gives access.

    Raises
    ------
    SphshellError
        `what` cannot be built or read, or the port is taken.
    """
    check_speed(speed)  # before anything is built
    player = player_of(what, changes=changes)
    _warn(player)
    live = Live(player, host=host, port=port, speed=speed, running=not paused, wait=True)
    if faces:
        live.picture.show("faces", True)
    try:
        told(live.url)
        if live.server.is_open:
            port = live.server.port
            print(
                f"everybody who has this address and reaches port {port} has access",
                file=sys.stderr,
            )
        if open:
            open_browser(live.url)
        live.run()
    except KeyboardInterrupt:
        pass
    finally:
        live.stop()


def _warn(player: Player) -> None:
    """Print what `explain` warns of, where a scenario is to run."""
    from sphshell_pin.scenario import explain_built
    from sphshell_pin.scenario.live.live_run import LiveRun

    if isinstance(player, LiveRun):
        for warning in explain_built(player.built).warnings:
            print(f"warning: {warning}", file=sys.stderr)


def player_of(what: object, *, changes: Mapping[str, str] | None = None) -> Player:
    """Return the player of `what`; see `preview`."""
    from sphshell_pin.scenario import Built, build
    from sphshell_pin.scenario.live.live_run import LiveRun

    if isinstance(what, str | PathLike):
        return LiveRun(build(what, changes))
    if isinstance(what, Built):
        return LiveRun(what)
    if callable(getattr(what, "advance", None)):
        return what  # type: ignore[return-value]
    raise InvalidParameter(
        "what", type(what).__name__, "must be a scenario or a player (a Result has .view())"
    )


def result_file(what: StrPath) -> Path | None:
    """Return the file of the finished run that `what` names; None if it names a scenario.

    Raises ResultError for a folder without one.
    """
    from sphshell_pin.scenario.format.reading import shipped_scenarios

    path = Path(what)
    if path.suffix == ".npz":
        return path
    if os.path.isfile(path / RESULT):
        return path / RESULT
    if os.path.isdir(path) and str(what) not in shipped_scenarios():
        raise ResultError(path, f"has no {RESULT}: the folder of a finished run would")
    return None


def open_browser(url: str) -> None:
    """Open `url` in the web browser, unless there is no screen to show it on.

    Other users see the arguments of the browser, but not the file that sends it to `url`.
    """
    if not _on_a_screen():
        return
    # At home, as a browser in a sandbox of its own (snap, flatpak) has another /tmp.
    home = Path.home()
    folder = home if os.access(home, os.W_OK) else None
    number, name = tempfile.mkstemp(".html", "sphshell-pin-view-", folder)  # for this user alone
    atexit.register(Path(name).unlink, missing_ok=True)
    with os.fdopen(number, "w", encoding="utf-8") as file:
        file.write(f'<meta http-equiv="refresh" content="0; url={html.escape(url)}">\n')
    open_file(Path(name))


def open_file(path: Path) -> None:
    """Open a page in the web browser, unless there is no screen to show it on."""
    if _on_a_screen():
        with contextlib.suppress(webbrowser.Error):
            webbrowser.open(path.absolute().as_uri())


def _on_a_screen() -> bool:
    return sys.platform == "darwin" or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
