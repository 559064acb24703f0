"""Measured data: what is wrong with them gets one sentence, and says where."""

import math

import numpy as np
import pytest

pytest.importorskip("scipy")

import sphshell_pin as sp
from sphshell_pin.errors import DataError, InvalidParameter, NameNotFound, ScenarioError
from sphshell_pin.scenario import build, read_scenario
from sphshell_pin.study.fit.data import read_experiment
from sphshell_pin.study.fit.search import Trial
from sphshell_pin.study.fit.units import factor_to_si
from sphshell_pin.study.fit.writing import scenario_text
from tests.command import refused
from tests.study.fitted_sets import SCENARIO
from tests.tables import cases_of

HEIGHT = "q.root_joint.2"
HEAD = f"t [s],{HEIGHT} [m]\n"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "bounce.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return build(path)


@pytest.fixture
def read(built, tmp_path):
    """Reads a csv file with this text, or columns."""
    found = Trial(built).measure(np.zeros(1))
    known = {name: unit for name, (unit, _) in found.items()}

    def read_data(data, **options):
        if isinstance(data, str | bytes):
            path = tmp_path / "data.csv"
            path.write_bytes(data if isinstance(data, bytes) else data.encode())
            data = path
        duration = built.scenario.run.duration
        return read_experiment(sp.Experiment(data), 1, known, duration, **options)

    return read_data


def test_units_empty_cells_and_comments(read):
    found = read(
        "\ufeff# of Monday\n"
        f" t[ms] ,{HEIGHT} [mm],pairs.tip.normal_force [kN],pairs.tip.normal_force.sigma [N]\n"
        "\n0,17,,\n1,16.5,0.001,2\n# pause\n2,,0.002,3\n"
    )
    height, force = found
    assert height.experiment == "data"
    assert (height.name, force.name) == (HEIGHT, "pairs.tip.normal_force")
    np.testing.assert_allclose(height.t, [0.0, 1e-3])
    np.testing.assert_allclose(height.measured, [0.017, 0.0165])
    assert (height.given, force.given) == (False, True)
    np.testing.assert_allclose(force.t, [1e-3, 2e-3])
    np.testing.assert_allclose(force.measured, [1.0, 2.0])
    np.testing.assert_allclose(force.sigma, [2.0, 3.0])


def test_columns_may_be_chosen(read):
    text = f"t [s],{HEIGHT} [m],remark [1]\n0,1,7\n"
    (column,) = read(text, only=[HEIGHT])
    assert column.measured.tolist() == [1.0]
    with pytest.raises(NameNotFound, match="no column 'depth'"):
        read(text, only=["depth"])


TABLES = cases_of("wrong_measurements")
WRONG = TABLES["files"]
WRONG["not UTF-8"] = HEAD.encode() + b"0,\xff\n", "is not a text file in UTF-8"


@pytest.mark.parametrize("case", WRONG)
def test_wrong_data_get_a_sentence(read, case):
    text, said = WRONG[case]
    with pytest.raises(DataError, match=said) as caught:
        read(text)
    assert str(caught.value).count("\n") == 0
    assert str(caught.value).startswith(str(caught.value.path))


@pytest.mark.parametrize(("columns", "said"), TABLES["columns"]["rows"])
def test_wrong_columns_get_a_sentence(read, columns, said):
    with pytest.raises(DataError, match=said):
        read(columns)


def test_nan_is_no_value(read):
    (column,) = read({"t [s]": [0.0, 0.1], f"{HEIGHT} [m]": [math.nan, 1.0]})
    assert column.t.tolist() == [0.1]
    assert column.measured.tolist() == [1.0]


def test_no_file_gets_a_sentence(built, tmp_path):
    with pytest.raises(DataError, match=r"missing\.csv: cannot be read: No such file"):
        sp.fit(built.path, tmp_path / "missing.csv", ["gravity.2"])


def test_too_few_values_get_a_sentence(built):
    data = {"t [s]": [0.1], f"{HEIGHT} [m]": [0.01]}
    with pytest.raises(InvalidParameter, match="data with 1 value must be more than parameters"):
        sp.fit(built.path, data, ["gravity.2"])
    with pytest.raises(InvalidParameter, match="at least one csv file"):
        sp.fit(built.path, [], ["gravity.2"])


def test_an_experiment_cannot_set_what_is_fitted_by_any_name(built):
    """Names that may be left out of a key name the same value."""
    data = {"t [s]": [0.1], f"{HEIGHT} [m]": [0.01]}
    short, whole = (f"contact.{name}law.stiffness" for name in ("", "tip."))
    for given, wanted in ((short, whole), (short, short), (whole, short)):
        one = sp.Experiment(data, {given: 5.0})
        with pytest.raises(InvalidParameter, match="is fitted, so no experiment can set it"):
            sp.fit(built.path, one, [wanted])


def test_the_command_ends_with_2(built, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.csv").write_text(HEAD + "0,1\n0,1\n")
    command = ["fit", "wrong.csv", built.path, "--param", "gravity.2"]
    assert refused(*command).startswith("error: wrong.csv, line 3: time 0 s is the same")
    for wrong in ("--experiment=wrong.csv speed", "--set=no"):
        assert "must be " in refused(*command, wrong)
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("given", "unit", "factor"),
    [
        ("mm", "m", 1e-3),
        ("deg/s", "rad/s", math.pi / 180),
        ("rpm", "rad/s", math.pi / 30),
        ("N mm", "N m", 1e-3),
        ("mm/s", "m/s", 1e-3),
        (None, "", 1.0),
        (None, "1", 1.0),
        ("us", "s", 1e-6),
    ],
)
def test_units(given, unit, factor):
    assert factor_to_si("x", given, unit) == pytest.approx(factor)


LAW = 'law = { type = "hunt-crossley", stiffness = 1e5, dissipation = 0.3 }'


def test_values_are_written_in_place_whatever_the_form(tmp_path):
    """Inline tables, tables, dotted keys, lists, keys that are not there, names of files."""
    folder = tmp_path / "here"
    (folder / "parts").mkdir(parents=True)
    (folder / "parts" / "plate.stl").write_text("")
    source = folder / "a.toml"
    plate, law = 'primitive = { type = "half-space", extent = 2.0 }', LAW
    assert SCENARIO.count(plate) == SCENARIO.count(law) == 1
    text = SCENARIO.replace(plate, 'file = "parts/plate.stl"  # 0.3\nunit = "mm"')
    dotted = 'law.type = "hunt-crossley"\nlaw.stiffness = 1e5  # 1e5\nlaw.dissipation = 0.3'
    source.write_text(text.replace(law, dotted))
    changes = {
        "contact.tip.law.stiffness": "2e5",
        "contact.tip.law.dissipation": "0.0",
        "contact.tip.friction.mu_dynamic": "0.5",  # only after mu_static
        "contact.tip.friction.mu_static": "0.6",
        "robot.ball.start.root_joint.2": "0.02",
        "gravity.2": "-1.62",
        "contact.tip.sphere.offset": "[0.0, 0.0, 0.001]",
        "run.integrator": "implicit",
    }
    target = tmp_path / "there" / "b.toml"
    target.parent.mkdir()
    target.write_text(scenario_text(source, changes, target.parent))
    was, now = read_scenario(source, changes), read_scenario(target)
    assert now.shell[0].file == "../here/parts/plate.stl"
    assert was.model_copy(update={"shell": now.shell}) == now
    for comment in ("# 0.3", "# 1e5", "# 5 mm above the plate"):
        assert comment in target.read_text()
    # A table that the file does not have is made; a key that no scenario may have is refused.
    changes = {"shell.plate.placement.xyz": "[0.0, 0.0, 1.0]"}
    target.write_text(scenario_text(source, changes, target.parent))
    was, now = read_scenario(source, changes), read_scenario(target)
    assert was.shell[0].placement == now.shell[0].placement
    with pytest.raises(ScenarioError, match=r"shell\.plate\.depth"):
        scenario_text(source, {"shell.plate.depth": "1.0"}, target.parent)
