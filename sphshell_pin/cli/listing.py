"""The command list: what is shipped."""

from __future__ import annotations

import typer

from sphshell_pin.cli.app import app, faults, make_table, plain, terminal


@app.command("list")
def list_(context: typer.Context) -> None:
    """List the shipped scenarios, and the robots that scenarios can name.

    Example: sphshell-pin list
    """
    with faults(context):
        from sphshell_pin.robots import OWN, names
        from sphshell_pin.scenario import read_scenario, shipped_scenarios

        console = terminal()
        table = make_table("scenario")
        table.add_column("what it shows")
        for name, path in shipped_scenarios().items():
            table.add_row(name, plain(read_scenario(path).title))
        console.print(table)
        console.print(f"[bold]robots[/bold]: {', '.join(names())}", highlight=False)
        if len(names()) == len(OWN):
            console.print("More robots: pip install 'sphshell-pin\\[robots]'", highlight=False)
