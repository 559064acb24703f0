"""The command view: a scenario that runs, or a finished run, in a page to play with."""

from __future__ import annotations

from typing import Annotated

import typer

from sphshell_pin.cli.app import OfOption, PackageDirOption, SetOption, changes_of, command


@command()
def view(
    *,
    scenario: Annotated[
        str,
        typer.Argument(
            help="Name of a shipped scenario, path of a .toml file, or a finished run: its "
            "run.npz or results folder."
        ),
    ],
    set_: SetOption = None,
    package_dir: PackageDirOption = None,
    speed: Annotated[float, typer.Option(help="Simulated seconds per second.")] = 1.0,
    paused: Annotated[bool, typer.Option("--paused", help="Wait for the button Run.")] = False,
    host: Annotated[
        str, typer.Option(help="Address to serve the page at; 0.0.0.0 lets other machines in.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port of the page; 0 takes any that is free.")] = 0,
    open_: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in the web browser.")
    ] = True,
    color: Annotated[
        str,
        typer.Option(
            help="Colors of the shells: surface, patches, faces (by kind), or distance (of curved "
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
        told=lambda url: typer.echo(f"{url}  (Ctrl-C ends the run)"),
    )
