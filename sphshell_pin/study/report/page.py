"""The page: one HTML file that makes no external requests, in light and dark, and for paper."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from pathlib import Path

from sphshell_pin.study.report.contents import Column, Finding, Picture, Section, Table

STYLE = Path(__file__).parent / "page.css"
MAIN_TITLE = "sphshell_pin: speed against error"


def render(sections: list[Section], machine: dict[str, str]) -> str:
    """Return the page."""
    parts = [
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{escape(MAIN_TITLE)}</title>\n<style>\n{STYLE.read_text(encoding='utf-8')}"
        "</style>\n</head>\n<body>\n<main>\n",
        _head(sections, machine),
        *(_section(k, section) for k, section in enumerate(sections, 1)),
        "</main>\n</body>\n</html>\n",
    ]
    return "\n".join(parts)


def _head(sections: list[Section], machine: dict[str, str]) -> str:
    headlines = [f for section in sections for f in section.findings if f.headline]
    rows = "".join(
        f"<div><dt>{escape(name)}</dt><dd>{_machine_value(name, text)}</dd></div>"
        for name, text in machine.items()
    )
    links = "".join(
        f'<li><a href="#{section.key}">{escape(section.title)}</a>'
        f"{'<span class=missed> not measured</span>' if section.error else ''}</li>"
        for section in sections
    )
    return (
        f"<header><h1>{escape(MAIN_TITLE)}</h1>\n"
        "<p class=lead>Exact contact of spheres with CAD surfaces, measured on this machine in one "
        "run. Figures are medians; ratios are taken round by round, of contestants that take turns "
        "on one core, and stand with their quartiles. Aims are those of the design.</p>\n"
        f"<ul class=cards>{''.join(_card(f) for f in headlines)}</ul>\n"
        f"{_tally(sections)}\n<nav><ol>{links}</ol></nav>\n"
        f"<details class=machine open><summary>Machine and run</summary><dl>{rows}</dl></details>"
        "</header>\n"
    )


def _machine_value(name: str, text: str) -> str:
    return f"<code>{escape(text)}</code>" if name == "command" else escape(text)


def _tally(sections: list[Section]) -> str:
    judged = [f.met for section in sections for f in section.findings if f.met is not None]
    failed = sum(section.error is not None for section in sections)
    sentence = f"{sum(judged)} of {len(judged)} aims are met."
    if failed:
        sentence += f" {failed} section{'s' * (failed > 1)} could not be measured."
    return f"<p class=tally>{sentence}</p>"


def _card(finding: Finding) -> str:
    kind = {True: "met", False: "missed", None: "plain"}[finding.met]
    return (
        f'<li class="{kind}"><b>{escape(finding.text)}</b><span>{escape(finding.what)}</span>'
        f"<small>{_verdict(finding)}</small></li>"
    )


def _verdict(finding: Finding) -> str:
    if finding.met is None:
        return ""
    mark = "\u2713 aim" if finding.met else "\u2717 aim missed:"
    return f"{mark} {escape(finding.aim_text)}"


def _section(number: int, section: Section) -> str:
    parts = [f'<section id="{section.key}">\n<h2><i>{number}</i> {escape(section.title)}</h2>\n']
    if section.text:
        parts.append(f"<p>{escape(section.text)}</p>\n")
    if section.error is not None:
        parts.append(
            f"<p class=error>This section could not be measured: {escape(section.error)}</p>"
        )
    if section.findings:
        parts.append(_findings(section.findings))
    parts += [f"<p class=note>{escape(note)}</p>\n" for note in section.notes]
    parts += [_picture(picture) for picture in section.pictures]
    parts += [_table(table) for table in section.tables]
    if section.seconds > 0:
        parts.append(f"<p class=note>Measured in {section.seconds:.0f} s.</p>")
    return "".join(parts) + "</section>\n"


def _findings(findings: list[Finding]) -> str:
    spreads = any(finding.spread_text for finding in findings)
    rows = []
    for finding in findings:
        word = {True: "met", False: "missed", None: ""}[finding.met]
        aim = escape(finding.aim_text)
        spread = f"<td class=n>{escape(finding.spread_text)}</td>" if spreads else ""
        rows.append(
            f"<tr><td>{escape(finding.what)}</td><td class=n><b>{escape(finding.text)}</b></td>"
            f'{spread}<td class=n>{aim}</td><td class="{word}">{word}</td></tr>'
        )
    heads = (
        f"<th>finding<th class=n>figure{'<th class=n>quartiles' if spreads else ''}"
        "<th class=n>aim<th>verdict"
    )
    return (
        f"<div class=scroll><table class=findings><thead><tr>{heads}</tr></thead>"
        f"<tbody>{''.join(rows)}</tbody></table></div>\n"
    )


def _picture(picture: Picture) -> str:
    return (
        f'<figure><div class=scroll role="img" aria-label="{escape(picture.description)}">'
        f"{picture.svg}</div><figcaption>{escape(picture.caption)}</figcaption></figure>\n"
    )


def _table(table: Table) -> str:
    numeric = [not isinstance(_first(table, k), str) for k in range(len(table.columns))]
    heads = "".join(
        f"<th{' class=n' if n else ''}>{escape(column.heading)}</th>"
        for column, n in zip(table.columns, numeric, strict=True)
    )
    body = "".join(f"<tr>{_cells(table.columns, row, numeric)}</tr>" for row in table.rows)
    whole = (
        f"<div class=scroll><table><thead><tr>{heads}</tr></thead>"
        f"<tbody>{body}</tbody></table></div>"
    )
    caption = f"{escape(table.caption)} <code>{table.name}.csv</code>"
    if table.folded:
        count = f"{len(table.rows)} rows"
        return f"<details><summary>{caption} ({count})</summary>{whole}</details>\n"
    return f"<p class=caption>{caption}</p>{whole}\n"


def _first(table: Table, k: int) -> object:
    return next((row[k] for row in table.rows if row[k] is not None), "")


def _cells(columns: Iterable[Column], row: Iterable[object], numeric: list[bool]) -> str:
    return "".join(
        f"<td{' class=n' if n else ''}>{escape(column.cell(value))}</td>"
        for column, value, n in zip(columns, row, numeric, strict=True)
    )
