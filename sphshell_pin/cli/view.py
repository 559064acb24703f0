"""The command view: a scenario that runs, or a finished run, in a page to play with."""

from __future__ import annotations

from typing import Annotated

from sphshell_pin.cli.app import (
    OfOption,
    PackageDirOption,
    SetOption,
    argument,
    changes_of,
    command,
    echo,
    option,
)


@command()
def view(
    *,
    scenario: Annotated[
        str,
        argument(
            "Name of a shipped scenario, path of a .toml file, or a finished run: its "
            "run.npz or results folder."
        ),
    ],
    set_: SetOption = None,
    package_dir: PackageDirOption = None,
    speed: Annotated[float, option("Simulated seconds per second.")] = 1.0,
    paused: Annotated[bool, option("Wait for the button Run.", "--paused")] = False,
    host: Annotated[
        str, option("Address to serve the page at; 0.0.0.0 lets other machines in.")
    ] = "127.0.0.1",
    port: Annotated[int, option("Port of the page; 0 takes any that is free.")] = 0,
    open_: Annotated[bool, option("Open the page in the web browser.", "--open/--no-open")] = True,
    color: Annotated[
        str,
        option(
            "Colors of the shells: surface, patches, faces (by kind), or distance (of curved "
            "elements from the flat ones)."
        ),
    ] = "surface",
    of: OfOption = None,
) -> None:
    """Run a scenario in a page: pause, push, change parameters; or play a finished run.

    Example: sphshell-pin view fingertip_on_blade --speed 0.5
    """
    from sphshell_pin.view import preview

    preview(
        scenario,
        changes=changes_of(set_),
        scenario=of,
        speed=speed,
        paused=paused,
        host=host,
        port=port,
        open=open_,
        color=color,  # type: ignore[arg-type]
        told=lambda url: echo(f"{url}  (Ctrl-C ends the run)"),
    )
