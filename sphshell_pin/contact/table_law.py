"""The law of a table, such as a measured one."""

from __future__ import annotations

import csv
import itertools
from dataclasses import dataclass
from pathlib import Path

from sphshell_pin.base.checks import check_vector
from sphshell_pin.base.parameters import Component, parameter
from sphshell_pin.base.regular_file import StrPath, read_text
from sphshell_pin.base.texts import number_of
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.errors import InvalidParameter


@dataclass(frozen=True)
class TableLaw(NormalLaw, kind="table"):
    """Elastic force from a table, such as a measured one: no damping.

    `depth` (k,) [m] and `force` (k,) [N] start at zero and increase. Between them the force is the
    monotone cubic Hermite interpolant (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238),
    with a continuous slope; beyond the last row it is linear, with the last slope. The energy is
    its exact integral.

    Parameters
    ----------
    depth : depths, from 0, increasing
    force : elastic force at each of them, from 0
    """

    depth: tuple[float, ...] = parameter(unit="m")
    force: tuple[float, ...] = parameter(unit="N")

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless the columns start at zero and increase."""
        for name in ("depth", "force"):
            given = getattr(self, name)
            rows = len(given) if hasattr(given, "__len__") else 0
            column = check_vector(name, given, rows).tolist()
            object.__setattr__(self, name, tuple(column))
            if rows < 2:
                raise InvalidParameter(name, given, "must have at least 2 rows")
            if column[0] != 0:
                raise InvalidParameter(f"{name}[0]", column[0], "must be 0: no depth, no force")
            for k, (before, here) in enumerate(itertools.pairwise(column), 1):
                if here <= before:
                    must = f"must be more than the row before, {before!r}"
                    raise InvalidParameter(f"{name}[{k}]", here, must)
        if len(self.depth) != len(self.force):
            raise InvalidParameter(
                "force",
                self.force,
                f"must have as many rows as depth, {len(self.depth)}",
                f"has {len(self.force)} rows,",
            )

    @classmethod
    def from_file(cls, path: StrPath) -> TableLaw:
        """Read a csv file of two columns, depth [m] and force [N].

        A header and lines that start with # are left out. InvalidParameter for a file that cannot
        be read, and for its rows as for the arguments.
        """
        try:
            lines = csv.reader(read_text(path).splitlines())
            rows = [(k, row) for k, row in enumerate(lines, 1) if row and row[0].strip()[:1] != "#"]
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise InvalidParameter("file", str(path), f"cannot be read: {error}") from None
        table = []
        for i, (k, row) in enumerate(rows):
            try:
                depth, force = map(number_of, row)
            except ValueError:
                if i == 0 and not any(map(_is_number, row)):
                    continue  # the header
                must = f"must hold two numbers in line {k}: depth [m], force [N]"
                raise InvalidParameter("file", str(path), must) from None
            table.append((depth, force))
        try:
            return cls(*zip(*table, strict=True)) if table else cls((), ())
        except InvalidParameter as error:
            raise InvalidParameter("file", str(path), f"is no table of a law: {error}") from None

    def _numbers(self) -> list[float]:
        """Return all depths, then all forces, as the compiled core takes them."""
        return [*self.depth, *self.force]

    @property
    def text(self) -> str:
        """Extent in one line."""
        return (
            f"table of {len(self.depth)} rows down to {self.depth[-1] * 1e3:.4g} mm and "
            f"{self.force[-1]:.4g} N, linear beyond, undamped"
        )


def _is_number(text: str) -> bool:
    """Whether it is a number in Python, where 1_0 and nan are some."""
    try:
        float(text)
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class TableFile(Component, kind="table", of=NormalLaw):
    """A table law as a scenario states it.

    Parameters
    ----------
    file : csv file of depth [m] and force [N], relative to the scenario
    """

    file: str = parameter()

    @property
    def files(self) -> tuple[str, ...]:
        """The csv file."""
        return (self.file,)

    def _build(self, folder: Path = Path()) -> TableLaw:
        """Read the table."""
        return TableLaw.from_file(folder / self.file)
