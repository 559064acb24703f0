"""An error in a scenario file is one sentence: file, key, value, valid choices."""

import tomllib

import pytest

from sphshell_pin.errors import ScenarioError
from sphshell_pin.scenario import build
from tests.scenario.files import DROP, SENSORS, TIP_AT, arm_urdf, write
from tests.texts import DATA, text_of

TEXTS = {
    "gripper": text_of("scenarios/gripper.toml").replace("FILE", f"{DATA}/mjcf/gripper.xml"),
    "tip_at": TIP_AT.replace("SPHERE", "link_5"),
    "tip_at_of_the_world": TIP_AT.replace("SPHERE", "universe"),
    "sensing": SENSORS[: SENSORS.index("[[knob]]")],
}
ROWS = tomllib.loads(text_of("scenarios/faults.toml"))
HEADS = {"tables": "", "controllers": "[controller]\n", "knobs": "[[knob]]\n"}
METHOD = DROP.replace('shell = "plate"\n', 'shell = "plate"\nmethod = "smooth"\n')
ON_METHOD = '[[knob]]\nkey = "contact.ball-plate.method"\n'
PLATE = DROP[DROP.index("[[shell]]") : DROP.index("[[contact]]")]
FAULTS = [
    # Scenario, old text, new text, how the key begins, words that are told.
    (DROP, DROP, "", "", "is missing"),
    (DROP, DROP, "title = ", "", "not valid TOML"),
    # Of two of one name, each is told by its index.
    (DROP + PLATE.replace("0.02]", "-1]"), "", "", "shell[1].primitive.size[2]:", ""),
    (DROP + PLATE, "", "", "shell[1]:", "two shells have this name"),
    (METHOD, "[run]", f"{ON_METHOD}min = 1\n[run]", "", "is for numbers"),
    (METHOD, "[run]", f'{ON_METHOD}unit = "m"\n[run]', "", "is for numbers"),
]
for name, rows in ROWS["replaced"].items():
    whole = TEXTS.get(name) or text_of(f"scenarios/{name}.toml")
    FAULTS += [(whole, *row) for row in rows]
for kind, rows in ROWS["added"].items():
    FAULTS += [(DROP, "[run]", f"{HEADS[kind]}{lines}\n[run]", *found) for lines, *found in rows]


@pytest.mark.parametrize(
    ("text", "old", "new", "key", "said"), FAULTS, ids=[said for *_, said in FAULTS]
)
def test_a_fault_names_file_key_and_choices(text, old, new, key, said, tmp_path):
    assert old in text
    arm_urdf(tmp_path)  # of the start that places a tip
    path = write(tmp_path, text.replace(old, new, 1))
    with pytest.raises(ScenarioError) as caught:
        build(path)
    told = str(caught.value)
    assert told.startswith(f"{path}: {key}")
    assert [word for word in said.split("|") if word not in told] == []
    assert "\n" not in told
