"""Tables of cases in tests/data/tables, and what is told of each."""

import tomllib
from typing import Any

from tests.texts import text_of


def cases_of(name: str) -> dict[str, Any]:
    """Return the tables of a file."""
    return tomllib.loads(text_of(f"tables/{name}.toml"))
