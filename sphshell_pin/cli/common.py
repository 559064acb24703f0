"""The application: what every command shares. Heavy imports wait inside the commands.

Options
-------
scenario : Name of a shipped scenario, or path of a .toml file.
run : A finished run: its run.npz or results folder.
set_ KEY=VALUE : Change a value; may be given several times.
dt : Time step [s] in place of run.dt.
duration : Time to simulate [s] in place of run.duration.
compiled : Move the robot by code compiled for it, as robot.compiled = true.
radius LENGTH : Of the sphere: 0.012 [m] or 12mm.
package_dir FOLDER : Folder above the packages of the robot's meshes; may be given several times.
density KG/M^3 : Of links whose mass the URDF does not state: from their meshes; 2700 is aluminium.
no_mimic : Joints that mimic others move freely.
xacro_arg NAME=VALUE : Argument of a xacro file, which is code; may be given several times.
chord_error : Of CAD: largest distance of the elements from the exact surface [m].
body NAME : Of CAD: take this body; may be given several times.
face NAME : Of CAD: take this face, by name or number; may be given several times.
time_limit : Of CAD: end OpenCASCADE after this time [s], 600 unless given.
memory_limit : Of CAD: let OpenCASCADE take so much memory [bytes], 8e9 unless given.
"""

from __future__ import annotations

import contextlib
import contextvars
import functools
import inspect
import itertools
import logging
import os
import re
import sys
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec

import typer

from sphshell_pin import errors
from sphshell_pin._interrupts import interrupts_heard
from sphshell_pin.base.cache import CACHE
from sphshell_pin.base.checks import stated_pairs
from sphshell_pin.base.parameters import described
from sphshell_pin.base.texts import visible
from sphshell_pin.cli.printing import lossy_streams
from sphshell_pin.errors import InvalidParameter, MissingExtra, SphshellError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

P = ParamSpec("P")
_debug = contextvars.ContextVar("debug", default=False)

app = typer.Typer(
    name="sphshell-pin",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def option(help: str, *names: str, **more: Any) -> Any:
    """Return an option with its help; `names` are by default that of the parameter."""
    return typer.Option(*names, help=help, **more)


def argument(help: str, **more: Any) -> Any:
    """Return an argument with its help."""
    return typer.Argument(help=help, **more)


# Exit codes: 1 an expectation was missed, 2 an error, 130 interrupted (as shells have it).
MISSED, ERROR, INTERRUPTED = 1, 2, 130
PERCENT = "{task.percentage:>3.0f} %"  # a column of progress_bar
_SHARED = described(__doc__, "Options")[1]  # descriptions by name, see `command`
_ARGUMENTS = {"scenario", "run"}  # wherever they stand in a signature


def _search_in(folders: list[Path] | None) -> list[Path] | None:
    """Search `folders` for packages before those of ROS_PACKAGE_PATH, in child processes too."""
    for folder in folders or ():
        if not folder.is_dir():
            raise typer.BadParameter(f"there is no folder {folder}")
    known = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    every = [*map(str, map(Path.absolute, folders or ())), *filter(None, known)]
    if folders:
        os.environ["ROS_PACKAGE_PATH"] = os.pathsep.join(every)
    return folders


def _print_version(wanted: bool) -> None:
    if wanted:
        import coal
        import pinocchio

        import sphshell_pin

        versions = f"pinocchio {pinocchio.__version__}, coal {coal.__version__}"
        print(f"sphshell-pin {sphshell_pin.__version__}, with {versions}")
        raise typer.Exit


@app.callback()
def options(
    debug: Annotated[bool, option("Show the traceback of an error.", "--debug")] = False,
    version: Annotated[
        bool,
        option(
            "Print the versions of this package, Pinocchio and Coal.",
            "--version",
            callback=_print_version,
            is_eager=True,
        ),
    ] = False,
    no_cache: Annotated[
        bool, option("Keep nothing of CAD files and robots for later commands.", "--no-cache")
    ] = False,
) -> None:
    """Exact contact of spheres with CAD surfaces, for Pinocchio's robots.

    Example: sphshell-pin run fingertip_on_blade
    """
    _debug.set(debug)
    if no_cache:
        os.environ[CACHE] = ""


def main() -> None:
    """Run the command line."""
    log = logging.getLogger("sphshell_pin")
    log.addHandler(logging.StreamHandler())
    log.setLevel(logging.INFO)
    with lossy_streams():
        app()


def command(name: str | None = None) -> Callable[[Callable[P, None]], Callable[P, None]]:
    """Add a command to the application, with its faults as `_faults` reports them.

    Parameters before `*` are arguments, those behind it options. The section "Options" at the end
    of the docstring describes each that is not annotated with its description: "name : help",
    where the name may be followed by other names of the option ("--all") and by what stands for its
    value in the help ("FILE"). What several commands share is described at the top of this module.
    The rest of the docstring is the help of the command.
    """

    def add(function: Callable[P, None]) -> Callable[P, None]:
        text, own = described(function.__doc__, "Options")
        stated = _SHARED | own
        signature = inspect.signature(function, eval_str=True)
        parameters = [
            _described(one, *stated[one.name]) if one.name in stated else one
            for one in signature.parameters.values()
        ]

        @functools.wraps(function)
        def called(*args: P.args, **options: P.kwargs) -> None:
            with _faults():
                function(*args, **options)

        called.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        called.__annotations__ = {one.name: one.annotation for one in parameters}
        # Typer keeps the line ends of all paragraphs but the first: they break at two widths.
        paragraphs = (" ".join(one.split()) for one in text.split("\n\n"))
        return app.command(name, help="\n\n".join(paragraphs))(called)

    return add


def _described(parameter: inspect.Parameter, words: str, help: str) -> inspect.Parameter:
    """Return a parameter annotated with its description: an argument, or an option."""
    names = [one for one in words.split() if one.startswith("--")]
    metavar = " ".join(one for one in words.split() if one not in names) or None
    help = help.replace("[", "\\[")
    if parameter.kind is not parameter.KEYWORD_ONLY or parameter.name in _ARGUMENTS:
        made = argument(help, metavar=metavar)
    else:
        own = parameter.name.strip("_").replace("_", "-")
        usual = f"--{own}/--no-{own}" if parameter.default is True else f"--{own}"
        callback = _search_in if parameter.name == "package_dir" else None
        made = option(help, *(names or [usual]), metavar=metavar, callback=callback)
    return parameter.replace(annotation=Annotated[parameter.annotation, made])


@contextlib.contextmanager
def _faults() -> Iterator[None]:
    """Turn faults into one sentence on stderr and an exit code, unless --debug asks for more."""
    try:
        with interrupts_heard(), _plain_warnings():
            yield
    except (typer.Exit, typer.Abort):
        raise
    except KeyboardInterrupt as error:
        echo(f"interrupted{f': {error}' if str(error) else ''}", err=True)
        raise typer.Exit(INTERRUPTED) from None
    except Exception as error:
        if _comes_from_ctrl_c(error):
            echo("interrupted", err=True)
            raise typer.Exit(INTERRUPTED) from None
        if _debug.get():
            raise
        known = isinstance(error, SphshellError)
        # Another fault is a defect, or comes from the user's routines: say where to look.
        text = str(error) if known else f"{type(error).__name__}: {error}"
        text = ", ".join([text, *getattr(error, "__notes__", ())])
        echo(f"error: {text}{'' if known else ' (see it with --debug)'}", err=True)
        raise typer.Exit(ERROR) from None


@contextlib.contextmanager
def _plain_warnings() -> Iterator[None]:
    """Print each warning of this package once, as a sentence without its place in the code."""
    shown: set[str] = set()

    def show(message: Warning | str, *place: Any, **more: Any) -> None:
        if getattr(errors, type(message).__name__, None) is not type(message):
            usual(message, *place, **more)
        elif str(message) not in shown:
            shown.add(str(message))
            echo(f"warning: {message}", err=True)

    with warnings.catch_warnings():
        usual = warnings.showwarning
        warnings.showwarning = show
        yield


def _comes_from_ctrl_c(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind `error`: a library interrupted while it loads reports a fault."""
    seen = set[int]()  # chains may be rings: a cause that is raised again
    while error is not None and not isinstance(error, KeyboardInterrupt):
        if id(error) in seen:
            return False
        seen.add(id(error))
        error = error.__cause__ or error.__context__
    return error is not None


def changes_of(
    set_: list[str] | None,
    dt: float | None = None,
    duration: float | None = None,
    compiled: bool = False,
) -> dict[str, str]:
    """Return the values that --set, --dt, --duration and --compiled change, by dotted key."""
    must = "must be KEY=VALUE, for instance run.dt=1e-4"
    changes = dict(stated_pairs("--set", set_ or [], must))
    for key, value in (("run.dt", dt), ("run.duration", duration)):
        changes |= {} if value is None else {key: repr(value)}
    return changes | ({"robot.0.compiled": "true"} if compiled else {})


def xacro_args_of(stated: list[str] | None) -> dict[str, str]:
    """Return the arguments of a xacro file that --xacro-arg states."""
    return dict(stated_pairs("--xacro-arg", stated or [], "must be NAME=VALUE"))


@contextlib.contextmanager
def if_installed() -> Iterator[None]:
    """Run what needs an optional package; where that is missing, say so and go on after it."""
    try:
        yield
    except MissingExtra as missing:
        echo(str(missing), err=True)


def echo(text: object, *, err: bool = False) -> None:
    """Print a line on stdout or stderr, see `visible`."""
    typer.echo(visible(str(text)), err=err)


def say(text: str, *, bold: str = "") -> None:
    """Print a line as it is, after the words `bold`."""
    terminal().print(f"[bold]{plain(bold)}[/bold]{plain(text)}", highlight=False)


def colored(text: str, color: str) -> Text:
    """Return a cell of a table in `color`."""
    from rich.text import Text

    return Text(visible(text), color)


def print_table(columns: Sequence[str], rows: Iterable[Sequence[str | Text]]) -> None:
    """Print the table that `make_table` begins, unless it has no rows."""
    table = make_table(*columns)
    for row in rows:
        table.add_row(*(plain(cell) if isinstance(cell, str) else cell for cell in row))
    if table.row_count:
        terminal().print(table)


def make_table(*columns: str) -> Table:
    """Return an empty table; all columns but the first are numbers."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    for i, column in enumerate(columns):
        # In a narrow terminal, lines are broken between words, those of the first column first.
        table.add_column(
            plain(column),
            overflow="fold",
            justify="left" if i == 0 else "right",
            min_width=max(map(len, column.split()), default=0),
        )
    return table


def terminal(*, err: bool = False) -> Console:
    """Return the console of stdout, or of stderr."""
    from rich.console import Console

    # A pipe has no width of its own: tables would fold at 80 columns.
    stream = sys.stderr if err else sys.stdout
    return Console(stderr=err, soft_wrap=not err, width=None if stream.isatty() else 120)


@contextlib.contextmanager
def progress_bar(
    title: str, *columns: str, line_every: float | None = None, **task: Any
) -> Iterator[Callable[..., None]]:
    """Show a bar on stderr, with `columns`; yield what updates its `task`.

    Columns are texts, as TextColumn has them, or names of other classes of rich.progress. On a pipe
    a line says each `line_every` seconds that work goes on, if that is given.
    """
    from rich import progress

    def say_lines(seconds: float) -> None:
        for k in itertools.count(1):
            if over.wait(seconds):
                return
            echo(f"{title}: {k * seconds:g} s", err=True)

    made = (
        getattr(progress, one)() if one.isidentifier() else progress.TextColumn(one)
        for one in ("{task.description}", "BarColumn", *columns)
    )
    console, silent = terminal(err=True), not sys.stderr.isatty()
    over = threading.Event()
    if silent and line_every:
        threading.Thread(target=say_lines, args=(line_every,), daemon=True).start()
    with progress.Progress(*made, console=console, transient=True, disable=silent) as bar:
        try:
            yield functools.partial(bar.update, bar.add_task(title, **task))
        finally:
            over.set()


def plain(text: str) -> str:
    """Return `text` so that rich prints its brackets as they are, see `visible`."""
    from rich.markup import escape

    return escape(visible(text))


def length_of(option: str, text: str | None) -> float | None:
    """Return a length [m] written as a number, or as a number with its unit."""
    if text is None:
        return None
    from sphshell_pin.units import meters_per_unit

    found = re.fullmatch(r"\s*([0-9.+eE-]*[0-9.])\s*([a-zA-Zµ]*)\s*", text)
    try:
        number = float(found[1] if found else text)
    except ValueError:
        raise InvalidParameter(option, text, "must be a length: 0.012 (meters), 12mm") from None
    return number * (meters_per_unit(found[2]) if found and found[2] else 1.0)
