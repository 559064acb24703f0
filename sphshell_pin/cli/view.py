"""The command view: a scenario that runs, or a finished run, in a page to play with."""

from sphshell_pin.cli.app import (
    OfOption,
    PackageDirOption,
    SetOption,
    changes_of,
    command,
    echo,
)


@command()
def view(
    scenario: str,
    *,
    set_: SetOption = None,
    package_dir: PackageDirOption = None,
    speed: float = 1.0,
    paused: bool = False,
    host: str = "127.0.0.1",
    port: int = 0,
    open_: bool = True,
    color: str = "surface",
    of: OfOption = None,
) -> None:
    """Run a scenario in a page: pause, push, change parameters; or play a finished run.

    Example: sphshell-pin view fingertip_on_blade --speed 0.5

    Options
    -------
    scenario : Name of a shipped scenario, path of a .toml file, or a finished run: its run.npz or
        results folder.
    speed : Simulated seconds per second.
    paused : Wait for the button Run.
    host : Address to serve the page at; 0.0.0.0 lets other machines in.
    port : Port of the page; 0 takes any that is free.
    open_ : Open the page in the web browser.
    color : Colors of the shells: surface, patches, faces (by kind), or distance (of curved elements
        from the flat ones).
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
