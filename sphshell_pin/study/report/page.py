"""The page: one HTML file that makes no external requests, in light and dark, and for paper."""

import base64
from html import escape
from pathlib import Path
from string import Template

from sphshell_pin.study.report.contents import Picture, Section, Table, findings_table

TEMPLATE = Path(__file__).with_name("page.html")


TITLE, TEXT = (
    "sphshell_pin: speed against error",
    "Contact of spheres with CAD surfaces, measured on this machine in one run. Figures are "
    "medians; ratios are taken round by round, of contestants that take turns on one core, and are "
    "shown with their quartiles. Aims are those of the design. In h / r, h is the mean length of "
    "the elements' sides and r the radius of the sphere.",
)


def tally_of(sections: list[Section]) -> str:
    """Return how many aims are met, in a sentence or two."""
    judged = [f.met for section in sections for f in section.findings if f.met is not None]
    failed = sum(section.error is not None for section in sections)
    more = f" {failed} section{'s' * (failed > 1)} could not be measured." if failed else ""
    return f"{sum(judged)} of {len(judged)} aims are met.{more}"


def render(sections: list[Section], machine: dict[str, str], caution: str = "") -> str:
    """Return the page; `caution` is what a reader should know of the machine."""
    missing = '<span class="missed"> not measured</span>'
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=escape(TITLE),
        introduction=escape(TEXT),
        caution=f'<p class="error" role="note">{escape(caution)}</p>' if caution else "",
        tally=tally_of(sections),
        links="".join(
            f'<li><a href="#{one.key}">{escape(one.title)}</a>{missing if one.error else ""}</li>'
            for one in sections
        ),
        machine="".join(
            f"<div><dt>{escape(name)}</dt><dd>{escape(text)}</dd></div>"
            for name, text in machine.items()
        ),
        sections="".join(_section(k, section) for k, section in enumerate(sections, 1)),
    )


def _section(number: int, section: Section) -> str:
    parts = [f'<section id="{section.key}"><h2><i>{number}</i>{escape(section.title)}</h2>']
    if section.text:
        parts.append(f"<p>{escape(section.text)}</p>")
    if section.error is not None:
        reason = f"This section could not be measured: {escape(section.error)}"
        parts.append(f'<p class="error">{reason}</p>')
    if section.findings:
        parts.append(_html(findings_table(section.findings), "findings"))
    parts += [f'<p class="note">{escape(note)}</p>' for note in section.notes]
    parts += [_picture(picture) for picture in section.pictures]
    parts += [_table(table) for table in section.tables]
    if section.seconds > 0:
        parts.append(f'<p class="note">Measured in {section.seconds:.0f} s.</p>')
    return "\n".join([*parts, "</section>\n"])


def _picture(picture: Picture) -> str:
    data = base64.b64encode(picture.png).decode()
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{escape(picture.description)}">'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
    )


def _table(table: Table) -> str:
    caption = f"{escape(table.caption)} <code>{table.name}.csv</code>"
    return f'<p class="caption">{caption}</p>{_html(table)}'


def _html(table: Table, kind: str = "") -> str:
    def row(tag: str, cells: list[str]) -> str:
        made = (
            f'<{tag} class="{"n " * right}{text if text in ("met", "missed") else ""}">'
            f"{escape(text)}</{tag}>"
            for text, right in zip(cells, table.numeric, strict=True)
        )
        return f"<tr>{''.join(made)}</tr>"

    heads = row("th", [column.heading for column in table.columns])
    body = "".join(row("td", cells) for cells in table.cells)
    return (
        f'<div class="scroll"><table class="{kind}"><thead>{heads}</thead>'
        f"<tbody>{body}</tbody></table></div>"
    )
