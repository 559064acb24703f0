"""The command view: a scenario that runs, or a finished run, in a page to play with."""

import re
from pathlib import Path

from sphshell_pin.cli import common
from sphshell_pin.errors import InvalidParameter, SphshellError


@common.command()
def view(
    scenario: str,
    *,
    set_: list[str] | None = None,
    package_dir: list[Path] | None = None,
    speed: float | None = None,
    paused: bool = False,
    host: str = "127.0.0.1",
    port: int = 0,
    open_: bool = True,
    faces: bool = False,
) -> None:
    """Run a scenario in a page: pause, push, change parameters; or play a finished run.

    Of a finished run, run.html is written beside run.npz and opened.

    Example: sphshell-pin view fingertip_on_blade --speed 0.5

    Options
    -------
    scenario : Name of a shipped scenario, path of a .toml file, or a finished run: its run.npz or
        results folder.
    speed : Simulated seconds per second; by default 1, of a finished run as its scenario has it.
    paused : Wait for the button Run.
    host : Address to serve the page at; 0.0.0.0 lets other machines in.
    port : Port of the page; 0 takes any that is free.
    open_ : Open the page in the web browser.
    faces : Color the shells by the kinds of their faces.
    """
    from sphshell_pin.view import preview
    from sphshell_pin.view.live.opening import result_file

    changes = common.changes_of(set_)
    finished = result_file(scenario)
    if finished is not None:
        if changes:
            key = next(iter(changes))
            raise InvalidParameter(key, changes[key], "cannot be changed: this is a finished run")
        _play(finished, speed, faces=faces, open_=open_)
        return
    preview(
        scenario,
        changes=changes,
        speed=1.0 if speed is None else speed,
        paused=paused,
        host=host,
        port=port,
        open=open_,
        faces=faces,
        told=lambda url: common.echo(f"{url}  (Ctrl-C ends the run)"),
    )


def _play(file: Path, speed: float | None, *, faces: bool, open_: bool) -> None:
    """Write the recording of a finished run beside it, and open it."""
    from sphshell_pin.scenario.running.replay import Replay
    from sphshell_pin.view.live.opening import open_file
    from sphshell_pin.view.recording import write_recording

    replay = Replay(file)
    path = write_recording(
        file.with_suffix(".html"),
        replay.result,
        replay.scene,
        replay.visual_model,
        title=replay.title,
        speed=replay.speed if speed is None else speed,
        faces=faces,
    )
    common.echo(path)
    if open_:
        open_file(path)


@common.command()
def render(
    run: Path,
    *,
    out: Path,
    time: float | None = None,
    from_: float | None = None,
    to: float | None = None,
    size: str = "1280x720",
    fps: float = 30.0,
    speed: float | None = None,
    camera: str = "fit",
    chart: bool = True,
    dark: bool = False,
) -> None:
    """Draw a finished run: one picture or a film.

    It needs the extra video, and Chromium.

    Example: sphshell-pin render results/fingertip_on_blade --out blade.mp4 --camera follow

    Options
    -------
    out : A .png (one picture) or .mp4 (a film).
    time : Of a picture: time of the run [s]; by default its end.
    from_ : Of a film: time at which it begins [s].
    to : Of a film: time at which it ends [s].
    size : Width and height in pixels.
    fps : Pictures per second of a film.
    speed : Simulated seconds per second; by default as the scenario has it.
    camera : From where: fit, front, side, top, follow, contact.
    chart : Forces and depth under the scene.
    dark : Dark background.
    """
    from sphshell_pin.scenario.running.replay import Replay
    from sphshell_pin.view.film import render_film
    from sphshell_pin.view.live.opening import result_file

    pixels = re.fullmatch(r"(\d{1,5})x(\d{1,5})", size)
    if pixels is None:
        raise InvalidParameter("--size", size, "must be WIDTHxHEIGHT, for instance 1280x720")
    file = result_file(run)
    if file is None:
        raise SphshellError(
            f"{run} is no finished run: give its results folder or run.npz, which "
            "sphshell-pin run writes"
        )
    replay = Replay(file)
    with common.progress_bar(str(out), total=None) as update:
        drawn = render_film(
            out,
            replay.result,
            replay.scene,
            replay.visual_model,
            time=time,
            span=(from_, to),
            size=(int(pixels[1]), int(pixels[2])),
            fps=fps,
            speed=speed if speed is not None or out.suffix == ".png" else replay.speed,
            camera=camera,  # type: ignore[arg-type]
            chart=chart,
            dark=dark,
            title=replay.title,
            told=lambda done, count: update(completed=done, total=count),
        )
    common.echo(drawn)
