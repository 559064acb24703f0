"""The unit of a CAD file: stated by its header, by the user, by both, or by nobody."""

import re

import numpy as np
import pytest

pytest.importorskip("OCP")

from sphshell_pin import Shell
from sphshell_pin.errors import InvalidParameter, ShellFileError, UnitMissing, UnitWarning
from sphshell_pin.shell.converting import convert
from tests.shell import cad_shapes as shapes
from tests.tables import cases_of

SIDES = np.array([20.0, 30.0, 10.0])
"""Of the box in the files, as their numbers have it."""

MILLIMETER = "SI_UNIT(.MILLI.,.METRE.)"


@pytest.fixture(scope="module")
def step(tmp_path_factory):
    path = tmp_path_factory.mktemp("step") / "box.step"
    return shapes.write_step(path, ("box", shapes.box()), ("pin", shapes.box())).read_text()


@pytest.fixture(scope="module")
def iges(tmp_path_factory):
    path = tmp_path_factory.mktemp("iges") / "box.iges"
    return shapes.write_iges(path, shapes.box()).read_text()


def with_unit(step, entities, part=None):
    """The text with the unit of length replaced, of the body of row `part` or of all.

    entities : what stands in brackets after "LENGTH_UNIT() NAMED_UNIT", and entities after it
    """
    rows = [m.span() for m in re.finditer(r"LENGTH_UNIT\(\) NAMED_UNIT\(\*\) SI_UNIT[^;]*;", step)]
    assert len(rows) == 2
    for row in (1, 0) if part is None else (part,):
        start, end = rows[row]
        step = step[:start] + entities.replace("#9", f"#9{row}") + step[end:]
    return step


def prefixed(prefix):
    return f"LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT({prefix},.METRE.) );"


def converted(name, millimeters):
    return (
        f"CONVERSION_BASED_UNIT('{name}',#9001) LENGTH_UNIT() NAMED_UNIT(#9003) );\n"
        f"#9001=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({millimeters}),#9002);\n"
        f"#9002=(LENGTH_UNIT() NAMED_UNIT(*) {MILLIMETER});\n"
        "#9003=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);"
    )


@pytest.fixture
def written(tmp_path):
    def written(text, suffix=".step"):
        path = tmp_path / f"part{suffix}"
        path.write_text(text)
        return path

    return written


def check_sides(shell, meters):
    """Lengths of the box in a file of one, or of the first one."""
    own = shell.vertices[shell.vertices[:, 0] < 40 * meters]
    assert np.allclose(np.ptp(own, axis=0), SIDES * meters, rtol=1e-12, atol=0.0)
    assert shell.health.scale == pytest.approx(meters, rel=1e-12)


def check_unit(path, meters, called):
    """The unit of the header holds, unless another one is stated, with a warning."""
    shell = Shell.from_file(path)
    check_sides(shell, meters)
    assert shell.unit == called
    with pytest.warns(UnitWarning, match=re.escape(f"header says '{called}'")):
        check_sides(Shell.from_file(path, "yd"), 0.9144)


UNITS = [
    (prefixed("$"), 1.0, "m"),
    (prefixed(".NANO."), 1e-9, "1e-09 m"),
    (converted("INCH", "25.4"), 0.0254, "in"),
    (converted("foot", "3.048E2"), 0.3048, "ft"),
    (converted("MILLIMETER", "1."), 1e-3, "mm"),
    (converted("FURLONG", "201168."), 201.168, "201.168 m"),
    (converted("INCH", "30."), 0.03, "0.03 m"),  # an inch that is none
]


@pytest.mark.parametrize(("entities", "meters", "called"), UNITS)
def test_step_units_are_taken_by_their_length_not_by_their_name(
    entities, meters, called, step, written
):
    check_unit(written(with_unit(step, entities)), meters, called)


def test_a_step_file_without_a_unit_needs_one(step, written):
    """Of the contexts' lists of units the first, that of length, is taken away; or all lists."""
    for text in (
        re.sub(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\(#\d+,", "GLOBAL_UNIT_ASSIGNED_CONTEXT((", step),
        re.sub(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\([^)]*\)\)", "", step),
    ):
        assert text != step
        path = written(text)
        told = r"unit = None must be stated, as the header of part\.step states none: one of m, "
        with pytest.raises(UnitMissing, match=told + r".*measures 1[\d.]+ units: say unit='mm'"):
            Shell.from_file(path)
        for unit, meters in (("mm", 1e-3), ("m", 1.0), ("in", 0.0254)):
            check_sides(Shell.from_file(path, unit), meters)


def test_several_units_hold_for_their_own_parts(step, written):
    path = written(with_unit(step, converted("INCH", "25.4"), part=1))
    for body, meters in (("box", 1e-3), ("pin", 0.0254)):
        own = Shell.from_file(path, bodies=[body])
        assert np.allclose(np.ptp(own.vertices, axis=0), SIDES * meters, rtol=1e-12, atol=0.0)
    notes = Shell.from_file(path).health.notes
    assert any("units 'mm', 'in' from the file's header" in note for note in notes)
    with pytest.raises(InvalidParameter, match=r"the 2 units 'mm', 'in' that part\.step states"):
        Shell.from_file(path, "mm")


def test_units_without_a_name_are_converted_to_one(step, written, tmp_path):
    path = written(with_unit(step, converted("FURLONG", "201168.")))
    done = convert(path, tmp_path / "out.ply")
    assert done.target.unit == "mm"
    assert done.target.size == pytest.approx(done.source.size, rel=1e-12)


def with_header(iges, unit, delimiter=",", ends=";"):
    """The text of an IGES file with another unit in its header, and other delimiters throughout."""
    lines = iges.splitlines()
    table = "".join(line[:72] for line in lines if line[72] == "G")
    assert table.startswith(",,")
    table = table[2:].replace(",2,2HMM,", f",{unit},")
    swap = str.maketrans({",": delimiter, ";": ends})
    first = "," if (delimiter, ends) == (",", ";") else f"1H{delimiter}{delimiter}1H{ends}"
    table = f"{first}{delimiter}{table.translate(swap)}"
    rows = [table[k : k + 72] for k in range(0, len(table), 72)]
    found = {kind: [line for line in lines if line[72] == kind] for kind in "SDPT"}
    header = [f"{row:72s}G{number:7d}" for number, row in enumerate(rows, 1)]
    data = [line[:64].translate(swap) + line[64:] for line in found["P"]]
    last = f"{found['T'][0][:8]}G{len(rows):7d}{found['T'][0][16:]}"
    return "\n".join([*found["S"], *header, *found["D"], *data, last, ""])


@pytest.mark.parametrize(("stated", "meters", "called"), cases_of("shell_files")["iges_units"])
def test_iges_units_come_by_flag_or_by_name(stated, meters, called, iges, written):
    check_unit(written(with_header(iges, stated), ".iges"), meters, called)


def test_iges_units_nobody_knows(iges, written):
    path = written(with_header(iges, "3,7HFURLONG"), ".iges")
    with pytest.raises(UnitMissing, match=r"the header of part\.iges states none"):
        Shell.from_file(path)
    check_sides(Shell.from_file(path, "in"), 0.0254)
    with pytest.raises(ShellFileError, match="by flag 99, which IGES does not have"):
        Shell.from_file(written(with_header(iges, "99,2HMM"), ".iges"), "mm")


@pytest.mark.parametrize(("delimiter", "ends"), ["/;", "|!", ":#"])
def test_iges_delimiters_are_those_of_the_header(delimiter, ends, iges, written):
    shell = Shell.from_file(written(with_header(iges, "1,2HIN", delimiter, ends), ".iges"))
    check_sides(shell, 0.0254)
    assert shell.is_closed
