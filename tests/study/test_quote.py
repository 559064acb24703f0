"""What the README and the documents quote is what was measured."""

from pathlib import Path

import pytest

from sphshell_pin.study.report import making
from sphshell_pin.study.report.contents import Column, Finding, Section, Table
from tests.programs import module_of


@pytest.fixture(scope="module")
def quote():
    return module_of(Path(__file__).parents[2] / "docs" / "site" / "quote.py")


def report(folder, error=None):
    section = Section(
        "queries",
        "Queries",
        findings=[
            Finding("query_coal", "coal / ours", 33.8, "x", 29.9, 35.5, 15.0, ">="),
            Finding("step_touching", "a | b", 1.4, "x", aim=1.2),
        ],
        tables=[Table("times", "", (Column("code", "who"), Column("s", "s")), [("a|b", 43.785)])],
        error=error,
    )
    machine = {"processor": 'a "fast" one', "date": "2026-11-21 20:00", "measured in": "9 s, quick"}
    folder.mkdir()
    text = making.report_json(making.Report([section], machine), [])
    (folder / "report.json").write_text(text, encoding="utf-8")
    return folder


def test_blocks_are_tables_of_markdown(quote, tmp_path):
    blocks = quote.blocks_of(quote.read(report(tmp_path / "report") / "report.json"))
    assert "| who | s |\n| --- | --- |\n| a\\|b | 43.8 |\n" in blocks["times"]
    assert "| coal / ours | 33.8 x | 29.9 to 35.5 | at least 15 x |" in blocks["summary"]
    assert "| a \\| b | 1.4 x |  | at most 1.2 x (this aim is missed) |" in blocks["summary"]
    assert 'a "fast" one, 2026-11-21, with `--quick`' in blocks["summary"]


def test_a_report_that_is_not_whole_is_not_quoted(quote, tmp_path, monkeypatch, capsys):
    folder = report(tmp_path / "report", error="no rtree")
    for one, words in ((folder, "'Queries' was not measured: no rtree"), (tmp_path / "no", "No")):
        monkeypatch.setattr("sys.argv", ["quote", str(one)])
        assert quote.main() == 2
        assert words in capsys.readouterr().err
