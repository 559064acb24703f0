"""The documents keep their word: code runs, scenarios are valid, links lead somewhere."""

import importlib
import json
import re
import shlex
import sys
import tomllib
from collections import defaultdict
from decimal import Decimal
from pathlib import Path
from types import ModuleType

import pytest
import typer
from typer.testing import CliRunner

from sphshell_pin.cli import app
from sphshell_pin.errors import MissingExtra
from sphshell_pin.scenario import build, read_scenario
from tests.slow import LIST as SLOW
from tests.studies import mostly_studies

ROOT = Path(__file__).parent.parent
PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "SECURITY.md",
    ROOT / "scenarios" / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INLINE_CODE = re.compile(r"`[^`\n]*`")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
PRINT = re.compile(r"^\s*print\(.*\)  # (.+)$")
PRINTED = re.compile(r"<!-- printed by: (.+) -->\s*```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PRINTING = [page for page in PAGES if PRINTED.search(page.read_text("utf-8"))]
LONG = ("grasping", "export", "sweeps")  # what they show takes long
# A line of a block, or code within a line; what follows may go on behind a backslash.
COMMAND = re.compile(r"(?:^ *(?:\$ )?|`)(sphshell-pin (?:[^`\n\\]|\\\n)*)", re.MULTILINE)


def blocks(page: Path, language: str) -> list[tuple[int, str]]:
    """Return the blocks of one language: the number of lines above each, and its text."""
    text = page.read_text(encoding="utf-8")
    return [
        (text.count("\n", 0, found.start(2)), found[2])
        for found in FENCE.finditer(text)
        if found[1] == language
    ]


def with_blocks(language: str) -> list[Path]:
    return [page for page in PAGES if blocks(page, language)]


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def anchors(page: Path) -> set[str]:
    """Return what GitHub makes of the headings."""
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in HEADING.findall(text))
    return {heading.replace(" ", "-") for heading in plain}


@pytest.mark.parametrize(
    "page", mostly_studies(with_blocks("python"), lambda p: p.stem not in LONG), ids=name_of
)
def test_the_python_of_a_page_runs(page, tmp_path, monkeypatch):
    """It prints what the comments behind its prints say."""
    monkeypatch.chdir(tmp_path)
    printed: dict[int, str] = defaultdict(str)

    def record(*values: object) -> None:
        printed[sys._getframe(1).f_lineno] += " ".join(map(str, values)) + "\n"

    module = ModuleType("page")
    monkeypatch.setitem(sys.modules, "page", module)  # dataclasses look there
    module.print = record
    for above, text in blocks(page, "python"):
        # Blank lines in front: a traceback then names the line of the page.
        code = compile("\n" * above + text, str(page), "exec")
        try:
            exec(code, module.__dict__)
        except MissingExtra as missing:
            pytest.skip(f"{name_of(page)}, line {above + 1}: {missing}")
        for number, line in enumerate(text.splitlines(), above + 1):
            if told := PRINT.search(line):
                assert is_printed(told[1], printed[number]), (number, told[1], printed[number])


def is_printed(told: str, printed: str) -> bool:
    """Compare what a comment says: all its numbers, in order, or else its words.

    A number is right within one unit of its last digit, or 0.2 %; "..." stands for any text.
    """
    if not re.match(r"[-+]?\d", told):
        return bool(re.search(".*".join(map(re.escape, told.split("..."))), printed, re.DOTALL))
    found = iter(NUMBER.findall(printed))
    return all(any(is_near(number, other) for other in found) for number in NUMBER.findall(told))


def is_near(told: str, found: str) -> bool:
    number = Decimal(told)
    unit = Decimal(1).scaleb(number.as_tuple().exponent)
    return abs(number - Decimal(found)) <= max(unit, abs(number) / 500)


@pytest.mark.parametrize(
    "page", mostly_studies(PRINTING, lambda p: p.stem not in LONG), ids=name_of
)
def test_the_commands_of_a_page_print_what_it_shows(page, tmp_path, monkeypatch):
    """`<!-- printed by: COMMAND -->` stands above what the last of its commands prints, in part."""
    monkeypatch.chdir(tmp_path)
    for commands, block in PRINTED.findall(page.read_text(encoding="utf-8")):
        for command in commands.split(" && "):
            done = CliRunner().invoke(app, shlex.split(command)[1:])
            assert done.exit_code == 0, done.output
        printed = {shape(line): NUMBER.findall(line) for line in done.output.splitlines()}
        for line in filter(shape, block.splitlines()):
            assert shape(line) in printed, f"not printed: {line}"
            for told, found in zip(NUMBER.findall(line), printed[shape(line)], strict=True):
                # Residuals are rounding errors, which other processors do not share.
                assert is_near(told, found) or "residual" in line, line


def shape(line: str) -> str:
    """Return the words of a line."""
    return " ".join(re.findall(r"[a-zA-Z][\w-]*", NUMBER.sub("", line)))


@pytest.mark.parametrize("page", with_blocks("toml"), ids=name_of)
def test_the_scenarios_of_a_page_are_valid(page, tmp_path):
    for k, (above, text) in enumerate(blocks(page, "toml")):
        where = f"{name_of(page)}, line {above + 1}"
        whole = "title" in tomllib.loads(text)
        if not whole:
            continue
        file = tmp_path / f"scenario_{k}.toml"
        file.write_text(text, encoding="utf-8")
        read_scenario(file)
        try:
            build(file)
        except MissingExtra as missing:
            pytest.skip(f"{where}: {missing}")


@pytest.mark.parametrize(
    "page", [page for page in PAGES if COMMAND.search(page.read_text("utf-8"))], ids=name_of
)
def test_the_commands_of_a_page_exist_with_their_options(page):
    group = typer.main.get_command(app)
    for written in COMMAND.findall(page.read_text(encoding="utf-8")):
        line = written.replace("\\\n", " ").split(" > ")[0]
        name, *arguments = shlex.split(line, comments=True)[1:]
        if name == "--help":
            continue
        assert name in group.commands, f"{written}: no such command"
        command = group.commands[name]
        parser = command.make_parser(command.context_class(command, info_name=name))
        parser.parse_args(arguments)  # raises for an option that is not there


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_links_of_a_page_lead_somewhere(page):
    text = INLINE_CODE.sub("", FENCE.sub("", page.read_text(encoding="utf-8")))
    for link in LINK.findall(text):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = page if not path else (page.parent / path).resolve()
        assert target.exists(), f"{link}: no such file"
        if anchor:
            assert anchor in anchors(target), f"{link}: no such heading"


def test_tests_that_are_named_exist():
    for page in PAGES:
        for path in re.findall(r"`(tests/[\w/]+\.py)`", page.read_text(encoding="utf-8")):
            assert (ROOT / path).exists(), f"{page.name}: {path}"
    for test in SLOW.read_text("utf-8").split():
        file, _, name = test.partition("::")
        text = (ROOT / file).read_text("utf-8")
        assert re.search(rf"^ *def {name.rpartition('::')[2]}\(", text, re.M), test


def test_no_page_is_an_orphan():
    linked = set()
    for page in PAGES:
        for link in LINK.findall(page.read_text(encoding="utf-8")):
            if not re.match(r"[a-z]+:", link):
                linked.add((page.parent / link.partition("#")[0]).resolve())
    start = ROOT / "docs" / "index.md"  # of the site
    assert {page for page in PAGES if ROOT / "docs" in page.parents} - {start} <= linked
    assert set((ROOT / "docs" / "measured").iterdir()) <= linked
    shown = ROOT / "docs" / "pictures"
    measured = json.loads((ROOT / "docs/measured/validation.json").read_text(encoding="utf-8"))
    for section in measured["sections"]:
        linked |= {shown / file for file, _ in section.get("pictures", ())}
    cards = (ROOT / "docs/measured/gallery.json").read_text(encoding="utf-8")
    linked |= {ROOT / "docs" / link for link in LINK.findall(cards)}
    pictures = {path for path in shown.rglob("*") if path.is_file()}
    assert pictures <= linked
    assert all(picture.stat().st_size < 400_000 for picture in pictures)


def test_the_tables_of_the_pages_are_those_of_today(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "site"))
    tables = importlib.import_module("tables")
    for page in tables.PAGES:
        text = page.read_text(encoding="utf-8")
        assert tables.filled(text) == text, f"{page.name} is stale: python docs/site/tables.py"
        marks = re.findall(rf"^<!-- (?:{'|'.join(tables.SHOWN)}): .*-->$", text, re.M)
        assert len(marks) == len(tables.BLOCK.findall(text)), page.name
