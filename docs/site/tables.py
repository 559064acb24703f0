"""Writes the tables of the pages: `python docs/site/tables.py`, after a change of what they show.

They stand between a mark and its end, in README.md and docs/*.md, so that a reader of the
repository sees them:

    <!-- measured: NAME -->    docs/measured/NAME.json, or the block NAME of report.json there
    <!-- parameters: CLASS --> what a class takes, from its description
    <!-- kinds: CLASS -->      what a scenario file may state of a family of classes
    <!-- commands: all -->     the help of the command line
    <!-- end KIND -->
"""

import re
from collections.abc import Callable
from pathlib import Path

from commands import all_commands
from measured import measured
from parameters import kinds, parameters

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
SHOWN: dict[str, Callable[[str], str]] = {
    "measured": measured,
    "parameters": parameters,
    "kinds": kinds,
    "commands": lambda _: all_commands(),
}
BLOCK = re.compile(
    rf"^(<!-- ({'|'.join(SHOWN)}): (\w+) -->\n).*?^(<!-- end \2 -->)$", re.DOTALL | re.MULTILINE
)


def filled(text: str) -> str:
    """Return a page with its tables; a name that is not there is an error."""

    def block(found: re.Match[str]) -> str:
        return f"{found[1]}\n{SHOWN[found[2]](found[3]).strip()}\n\n{found[4]}"

    return BLOCK.sub(block, text)


def main() -> None:
    """Write every page whose tables are not those of today."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        new = filled(text)
        if new != text:
            page.write_text(new, encoding="utf-8")
            print(page.relative_to(ROOT))


if __name__ == "__main__":
    main()
