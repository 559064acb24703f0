"""What a scenario file may say, and how its faults are told: file, key, value, valid choices."""

import pytest

import sphshell_pin as sp
from sphshell_pin.errors import NameNotFound, ScenarioError, SphshellError
from sphshell_pin.scenario.format.reading import find_scenario, read_scenario, shipped_scenarios
from sphshell_pin.view.live.opening import player_of
from tests.scenario.files import DROP, write


def test_no_text_and_not_there(tmp_path):
    with pytest.raises(ScenarioError, match="cannot be read"):
        read_scenario(tmp_path / "nothing.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ScenarioError, match="UTF-8"):
        read_scenario(binary)


def test_changes_by_dotted_key(tmp_path):
    path = write(tmp_path)
    changes = {
        "run.dt": "2e-5",
        "contact.ball-plate.law.stiffness": "5e5",
        "contact.0.sphere.radius": "0.01",
        "robot.name": "turntable",
        "shell.plate.side": "outside",
        "controller.type": "gravity-compensation",
    }
    scenario = read_scenario(path, changes)
    assert scenario.run.dt == 2e-5
    assert scenario.contact[0].law.stiffness == 5e5
    assert scenario.contact[0].sphere.radius == 0.01
    assert scenario.robot[0].name == "turntable"
    assert scenario.shell[0].side == "outside"
    assert scenario.controller.kind == "gravity-compensation"


@pytest.mark.parametrize("table", ["[robot]", "[[robot]]"])
def test_a_key_as_a_fault_tells_it_may_be_set(table, tmp_path):
    path = write(tmp_path, DROP.replace("[robot]", table).replace('name = "ball"', 'name = "a.b"'))
    with pytest.raises(ScenarioError) as caught:
        read_scenario(path, {"robot.a.b.free_flyer": "5"})
    assert caught.value.key == "robot.a.b.free_flyer"


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("run.dtt", r"run\.dtt.*did you mean 'dt'"),
        ("contact.tip.law.stiffness", "there are: ball-plate"),
        ("run.dt.x", "'dt' is a value"),
        ("duration", r"did you mean 'run\.duration'\?"),
    ],
)
def test_changes_that_fit_nowhere(key, said, tmp_path):
    with pytest.raises(ScenarioError, match=said):
        read_scenario(write(tmp_path), {key: "1"})


def test_shipped_scenarios_are_found_by_name_and_path(tmp_path):
    shipped = shipped_scenarios()
    assert find_scenario("gear_contact") == shipped["gear_contact"]
    path = write(tmp_path)
    assert find_scenario(path) == path
    with pytest.raises(NameNotFound, match="gear_contact"):
        find_scenario("gear_contat")
    with pytest.raises(ScenarioError, match="no such file"):
        find_scenario("folder/that/is/not.toml")


@pytest.mark.parametrize("name", ["x" * 3000, "a\0b", f"{'x' * 300}/y.toml"])
def test_a_name_that_the_system_refuses_is_no_such_file(name, tmp_path):
    with pytest.raises(SphshellError):
        find_scenario(tmp_path / name)
    with pytest.raises(SphshellError):
        player_of(tmp_path / f"{name}.toml")
    with pytest.raises(SphshellError, match=r"no such file|cannot be read"):
        sp.Shell.from_file(tmp_path / f"{name}.stl", "mm")
