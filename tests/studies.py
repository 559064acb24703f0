"""Parameters of a test of which `make test` takes some and `make studies` the others."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def mostly_studies(parameters: Iterable[Any], kept: Callable[[Any], bool]) -> list[Any]:
    """Mark the parameters that are not `kept` as studies; tuples are several arguments."""
    out = []
    for one in parameters:
        values = one if isinstance(one, tuple) else (one,)
        out.append(one if kept(one) else pytest.param(*values, marks=pytest.mark.study))
    return out
