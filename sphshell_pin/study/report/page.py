"""The page: Markdown, with the tables that stand beside it."""

from sphshell_pin.base.texts import counted
from sphshell_pin.study.report.contents import Section, findings_table

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
    more = f" {counted(failed, 'section')} could not be measured." if failed else ""
    return f"{sum(judged)} of {len(judged)} aims are met.{more}"


def render(sections: list[Section], machine: dict[str, str], caution: str = "") -> str:
    """Return the page; `caution` is what a reader should know of the machine."""
    parts = [f"# {TITLE}", TEXT, caution, tally_of(sections)]
    for section in sections:
        parts += [f"## {section.title}", section.text]
        if section.error is not None:
            parts.append(f"This section could not be measured: {section.error}")
        if section.findings:
            parts.append(findings_table(section.findings).markdown())
        parts += section.notes
        for table in section.tables:
            parts += [f"{table.caption} [{table.name}.csv]({table.name}.csv)", table.markdown()]
    parts += ["## Machine and run", "\n".join(f"- {key}: {text}" for key, text in machine.items())]
    return "\n\n".join(part.strip() for part in parts if part) + "\n"
