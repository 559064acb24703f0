"""The command list: what is shipped."""

import typer

from sphshell_pin.cli.app import command, make_table, plain, say, terminal


@command("list")
def list_(context: typer.Context) -> None:
    """List the shipped scenarios, and the robots that scenarios can name.

    Example: sphshell-pin list
    """
    from sphshell_pin.robots import OWN, names
    from sphshell_pin.scenario import read_scenario, shipped_scenarios

    table = make_table("scenario")
    table.add_column("what it shows")
    for name, path in shipped_scenarios().items():
        table.add_row(name, plain(read_scenario(path).title))
    terminal().print(table)
    say(f": {', '.join(names())}", bold="robots")
    if len(names()) == len(OWN):
        say("More robots: pip install 'sphshell-pin[robots]'")
