"""Texts that tests read and change: scenarios, robots and meshes in tests/data."""

from pathlib import Path

DATA = Path(__file__).parent / "data"


def text_of(name: str) -> str:
    """Return what is in a file of tests/data."""
    return (DATA / name).read_text("utf-8")
