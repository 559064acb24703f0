"""The documents keep their word: code runs, scenarios are valid, links lead somewhere."""

import importlib
import json
import re
import shlex
import sys
import tomllib
from collections import defaultdict
from collections.abc import Iterator
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
PAGES = [ROOT / f"{one}.md" for one in ("README", "CHANGELOG", "CONTRIBUTING", "SECURITY")]
PAGES += [ROOT / "scenarios" / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
TEXTS = {page: page.read_text("utf-8") for page in PAGES}
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INLINE_CODE = re.compile(r"`[^`\n]*`")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
PRINT = re.compile(r"^\s*print\(.*\)  # (.+)$")
PRINTED = re.compile(r"<!-- printed by: (.+) -->\s*```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PRINTING = [page for page in PAGES if PRINTED.search(TEXTS[page])]
LONG = ("grasping", "export", "sweeps")  # what they show takes long
# A line of a block, or code within a line; what follows may go on behind a backslash.
COMMAND = re.compile(r"(?:^ *(?:\$ )?|`)(sphshell-pin (?:[^`\n\\]|\\\n)*)", re.MULTILINE)


def blocks(page: Path, language: str) -> list[tuple[int, str]]:
    """Return the blocks of one language: the number of lines above each, and its text."""
    found = (one for one in FENCE.finditer(TEXTS[page]) if one[1] == language)
    return [(TEXTS[page].count("\n", 0, one.start(2)), one[2]) for one in found]


def links(page: Path) -> Iterator[tuple[str, Path, str]]:
    """Yield the links into the repository: as written, the file, and the anchor in it."""
    for link in LINK.findall(INLINE_CODE.sub("", FENCE.sub("", TEXTS[page]))):
        path, _, anchor = link.partition("#")
        if not re.match(r"[a-z]+:", link):
            yield link, (page.parent / path).resolve() if path else page, anchor


def with_blocks(language: str) -> list[Path]:
    return [page for page in PAGES if blocks(page, language)]


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def anchors(page: Path) -> set[str]:
    """Return what GitHub makes of the headings."""
    headings = HEADING.findall(FENCE.sub("", TEXTS[page]))
    return {re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in headings}


@pytest.mark.parametrize(
    "page", mostly_studies(with_blocks("python"), lambda p: p.stem not in LONG), ids=name_of
)
def test_the_python_of_a_page_runs(page, tmp_path, monkeypatch):
    """It prints what the comments behind its prints say."""
    monkeypatch.chdir(tmp_path)
    printed, module = defaultdict[int, str](str), ModuleType("page")

    def record(*values: object) -> None:
        printed[sys._getframe(1).f_lineno] += " ".join(map(str, values)) + "\n"

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
    for commands, block in PRINTED.findall(TEXTS[page]):
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
    file = tmp_path / "scenario.toml"
    for _, text in blocks(page, "toml"):
        if "title" in tomllib.loads(text):  # whole
            file.write_text(text, encoding="utf-8")
            read_scenario(file)
            try:
                build(file)
            except MissingExtra as missing:
                pytest.skip(f"{name_of(page)}: {missing}")


@pytest.mark.parametrize(
    "page", [page for page in PAGES if COMMAND.search(TEXTS[page])], ids=name_of
)
def test_the_commands_of_a_page_exist_with_their_options(page):
    group = typer.main.get_command(app)
    for written in COMMAND.findall(TEXTS[page]):
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
    for link, target, anchor in links(page):
        assert target.exists(), f"{link}: no such file"
        assert not anchor or anchor in anchors(target), f"{link}: no such heading"


def test_tests_that_are_named_exist():
    named = {one for text in TEXTS.values() for one in re.findall(r"`(tests/[\w/]+\.py)`", text)}
    assert [one for one in named if not (ROOT / one).exists()] == []
    for test in SLOW.read_text("utf-8").split():
        file, _, name = test.partition("::")
        text = (ROOT / file).read_text("utf-8")
        assert re.search(rf"^ *def {name.rpartition('::')[2]}\(", text, re.M), test


def test_no_page_is_an_orphan():
    docs = ROOT / "docs"
    linked = {target for page in PAGES for _, target, _ in links(page)}
    assert {page for page in PAGES if docs in page.parents} - {docs / "index.md"} <= linked
    assert set((docs / "measured").iterdir()) <= linked
    measured = json.loads((docs / "measured/validation.json").read_text(encoding="utf-8"))
    for section in measured["sections"]:
        linked |= {docs / "pictures" / file for file, _ in section.get("pictures", ())}
    cards = (docs / "measured/gallery.json").read_text(encoding="utf-8")
    linked |= {docs / link for link in LINK.findall(cards)}
    pictures = {path for path in (docs / "pictures").rglob("*") if path.is_file()}
    assert pictures <= linked
    assert all(picture.stat().st_size < 400_000 for picture in pictures)


def test_the_tables_of_the_pages_are_those_of_today(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "site"))
    tables = importlib.import_module("tables")
    for page in tables.PAGES:
        text = TEXTS[page]
        assert tables.filled(text) == text, f"{page.name} is stale: python docs/site/tables.py"
        marks = re.findall(rf"^<!-- (?:{'|'.join(tables.SHOWN)}): .*-->$", text, re.M)
        assert len(marks) == len(tables.BLOCK.findall(text)), page.name
