"""What a scenario file may say, and how its faults are told: file, key, value, valid choices."""

import pytest

import sphshell_pin as sp
from sphshell_pin.errors import NameNotFound, ScenarioError, SphshellError
from sphshell_pin.scenario.format.reading import find_scenario, read_scenario, shipped_scenarios
from sphshell_pin.view.live.opening import player_of
from tests.scenario.files import DROP, write

PD = '[controller]\ntype = "joint-pd"\n'
LAW, BALL = "contact.ball-plate.law", "contact.ball-plate.sphere.radius"
NO_NUMBER = "must be a number, not true or false"
FAULTS = {
    # What is put in: old text, new text, the key that is told, words that are told.
    "unknown key": ("dt = 1e-4", "dtt = 1e-4", "run.dtt", "did you mean 'dt'|integrator"),
    "unknown table": ("[run]", "[ruin]\nx = 1\n[run]", "ruin", "did you mean 'run'|controller"),
    "unknown key in a law": ("stiffness", "stifness", f"{LAW}.stifness", "'stiffness'"),
    "unknown type": ('"impact"', '"impct"', LAW, "impct|hertz|hunt-crossley"),
    "no type": ('type = "impact", ', "", LAW, "type is missing|hunt-crossley"),
    "unknown choice": ("[[contact]]", 'side = "up"\n[[contact]]', "shell.plate.side", "'inside'"),
    "negative": ("1e6", "-1e6", f"{LAW}.stiffness", "greater than 0|-1000000.0"),
    "not a number": ("1e6", "nan", f"{LAW}.stiffness", "finite"),
    "text for a number": ("1e6", '"stiff"', f"{LAW}.stiffness", "number|'stiff'"),
    "number as a text": ("= 0.012", '= "0.012"', BALL, "not a text (given: '0.012')"),
    "true for a number": ("0, -0.01]", "true, -0.01]", "shell.plate.placement.xyz[1]", NO_NUMBER),
    "true in a law": ("20.0", "true", f"{LAW}.damping", NO_NUMBER),
    "true in a primitive": ("[0.2, 0.2", "[true, 0.2", "shell.plate.primitive.size[0]", NO_NUMBER),
    "missing": ("duration = 0.05", "", "run.duration", "is missing"),
    "no source": ('name = "ball"\n', "", "robot[0]", "either name|or file"),
    "two sources": ('name = "plate"', 'name = "p"\nfile = "x"', "shell.p", "file or primitive"),
    "not a table": ("[run]", "[expect]\nx = 1\n[run]", "expect.x", "must be a table"),
    "no tolerance": (
        "[run]",
        '[expect]\n"a.b" = { value = 1 }\n[run]',
        'expect."a.b"',
        "rtol or atol",
    ),
    "wrong gain": ("[run]", f'{PD}kp = "x"\nkd = 1\n[run]', "controller.kp", "number"),
    "short vector": ("[0, 0, -0.01]", "[0, 0]", "shell.plate.placement.xyz", "at least 3"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_names_file_key_and_choices(fault, tmp_path):
    old, new, key, words = FAULTS[fault]
    assert old in DROP
    path = write(tmp_path, DROP.replace(old, new, 1))
    with pytest.raises(ScenarioError) as caught:
        read_scenario(path)
    assert caught.value.key == key
    for word in (str(path), *words.split("|")):
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_not_toml_and_not_there(tmp_path):
    with pytest.raises(ScenarioError, match="not valid TOML"):
        read_scenario(write(tmp_path, "title = "))
    with pytest.raises(ScenarioError, match="is missing"):
        read_scenario(write(tmp_path, ""))
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
        read_scenario(path, {"robot.a.b.mimic": "5"})
    assert caught.value.key == "robot.a.b.mimic"


def test_items_of_one_name_are_told_by_their_index(tmp_path):
    twice = DROP[DROP.index("[[shell]]") : DROP.index("[[contact]]")]
    path = write(tmp_path, DROP + twice.replace("0.02]", "-1]"))
    with pytest.raises(ScenarioError) as caught:
        read_scenario(path)
    assert caught.value.key == "shell[1].primitive.size[2]"


def test_changes_that_fit_nowhere(tmp_path):
    path = write(tmp_path)
    with pytest.raises(ScenarioError, match=r"run\.dtt.*did you mean 'dt'"):
        read_scenario(path, {"run.dtt": "1"})
    with pytest.raises(ScenarioError, match=r"there are: ball-plate"):
        read_scenario(path, {"contact.tip.law.stiffness": "1"})
    with pytest.raises(ScenarioError, match="'dt' is a value"):
        read_scenario(path, {"run.dt.x": "1"})


def test_shipped_scenarios_are_found_by_name_and_path(tmp_path):
    shipped = shipped_scenarios()
    assert {
        "fingertip_on_blade",
        "sphere_on_shell",
        "ball_on_turntable",
        "allegro_hand_object",
        "gear_contact",
    } <= set(shipped)
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
