"""What the README and the documents quote is what was measured."""

from __future__ import annotations

import json

import pytest

from sphshell_pin.benchmarks import quote


@pytest.mark.parametrize("name", quote.PAGES)
def test_the_pages_agree_with_the_measured_data(name):
    page = (quote.ROOT / name).read_text(encoding="utf-8")
    assert quote.BLOCK.search(page), "no block to fill"
    assert quote.quoted(page, quote.ROOT / quote.FOLDER) == page
    assert page.count("<!-- measured:") == len(quote.BLOCK.findall(page))


def report(folder, error=None):
    folder.mkdir()
    section = {"title": "Queries", "error": error}
    machine = {"processor": 'a "fast" one', "date": "2026-11-21 20:00", "measured in": "9 s, quick"}
    (folder / "report.json").write_text(json.dumps({"machine": machine, "sections": [section]}))
    (folder / "findings.csv").write_text(
        "section,key,what,value,unit,low,high,sense,aim,met,text\n"
        "queries,query_coal,coal / ours,33.8,x,29.9,35.5,>=,15.0,True,33.8 x\n"
        "queries,import,a | b,1.4,x,,,<=,1.2,False,1.4 x\n"
    )
    (folder / "queries_peers.csv").write_text(
        "code,median_s,over_ours\nthis,1.604e-06,1.0\ncoal,7.0233e-05,43.785\n"
    )
    return folder


def test_blocks_are_replaced_and_nothing_else(tmp_path):
    data = tmp_path / "measured"
    quote.copy_data(report(tmp_path / "report"), data)
    page = (
        "a\n<!-- measured: queries_peers -->\nold\n<!-- end measured -->\nb\n"
        "<!-- measured: summary -->\n<!-- end measured -->\nc\n"
    )
    new = quote.quoted(page, data)
    assert "| code | median [us] | over ours |" in new
    assert "| coal | 70.2 | 43.8 |" in new
    assert "| coal / ours | 33.8 x | 29.9 to 35.5 | at least 15 |" in new
    assert "| a \\| b | 1.4 x |  | at most 1.2 (missed) |" in new
    assert 'a "fast" one, 2026-11-21, with `--quick`' in new
    assert "old" not in new
    assert new.startswith("a\n<!--")
    assert new.endswith("-->\nc\n")
    assert quote.quoted(new, data) == new


def test_a_report_that_is_not_whole_is_not_quoted(tmp_path, monkeypatch, capsys):
    folder = report(tmp_path / "report", error="no rtree")
    monkeypatch.setattr("sys.argv", ["quote", str(folder)])
    assert quote.main() == 2
    assert "'Queries' was not measured: no rtree" in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", ["quote", str(tmp_path / "absent")])
    assert quote.main() == 2


def test_an_unknown_block_is_told(tmp_path):
    with pytest.raises(ValueError, match="no block is called 'weather'"):
        quote.quoted("<!-- measured: weather -->\n<!-- end measured -->", tmp_path)
