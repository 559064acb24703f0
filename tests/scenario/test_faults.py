"""An error in a scenario file is one sentence: file, key, value, valid choices."""

import pytest

from sphshell_pin.errors import ScenarioError
from sphshell_pin.scenario import build
from tests.scenario.files import (
    DROP,
    EGG,
    HAND,
    SENSORS,
    TIP_AT,
    TWO_BALLS,
    TWO_ROBOTS,
    arm_urdf,
    write,
)
from tests.texts import DATA, text_of

GRIPPER = text_of("scenarios/gripper.toml").replace("FILE", f"{DATA}/mjcf/gripper.xml")
ROOTED = TIP_AT.replace("SPHERE", "universe")
SENSING = SENSORS[: SENSORS.index("[[knob]]")]
METHOD = DROP.replace('shell = "plate"\n', 'shell = "plate"\nmethod = "smooth"\n')

LAW, BALL = "contact.ball-plate.law", "contact.ball-plate.sphere.radius"
STIFFNESS, SIZE = f"{LAW}.stiffness", "shell.plate.primitive.size"
NO_NUMBER = "must be a number, not true or false"
PD = '[controller]\ntype = "joint-pd"\nkp = {}\nkd = 1\nq_ref = {}\n'
IMPEDANCE, SOURCE = (text_of(f"scenarios/{name}.toml") for name in ("impedance", "source_table"))
PLATE = DROP[DROP.index("[[shell]]") : DROP.index("[[contact]]")]
BOX = 'primitive = { type = "box", size = [0.2, 0.2, 0.02] }'
NO_TOLERANCE = '[expect]\n"a.b" = { value = 1 }\n'
BALLS = 'other_sphere = { frame = "lower/ball", radius = 0.012 }'
SPHERE = 'sphere = { frame = "upper/ball", radius = 0.012 }'
FIRST = '{ frame = "upper/ball", radius = 0.012 },'
PLANE = 'sphere = {frame = "ball", radius = 0.01}\nplane ='
OTHER = 'other_sphere = {frame = "ball", radius = 0.01}'
FINGER = "robot.three_link_finger"
TAKEN = '"three_link_finger"\nlabel = "three_link_finger"'
MOUNT = 'name = "ball"\nframe = "three_link_finger/tpi"'
BOTH = "start = { right_finger = 0.01, left_finger = 0.02 }"


def knob(key, more=""):
    """Return the table of a knob."""
    return f'[[knob]]\nkey = "{key}"\n{more}\n'


def turned(text, *rows):
    """Return rows of knobs that are put into a scenario."""
    return [(text, "[run]", f"{knobs}[run]", key, said) for knobs, key, said in rows]


def at(start, said):
    """Return the row of a start that places the tip of an arm."""
    return TIP_AT.replace("SPHERE", "link_5"), "START", start, "", said


FAULTS = [
    # Scenario, old text, new text, how the key begins, words that are told.
    (DROP, "dt = 1e-4", "dtt = 1e-4", "run.dtt:", "did you mean 'dt'|integrator"),
    (DROP, "[run]", "[ruin]\nx = 1\n[run]", "ruin:", "did you mean 'run'|controller"),
    (DROP, "stiffness", "stifness", f"{LAW}.stifness:", "'stiffness'"),
    (DROP, '"impact"', '"impct"', f"{LAW}:", "impct|hertz|hunt-crossley"),
    (DROP, 'type = "impact", ', "", f"{LAW}:", "type is missing|hunt-crossley"),
    (DROP, "[[contact]]", 'side = "up"\n[[contact]]', "shell.plate.side:", "'inside'"),
    (DROP, "1e6", "-1e6", f"{STIFFNESS}:", "greater than 0|-1000000.0"),
    (DROP, "1e6", "nan", f"{STIFFNESS}:", "finite"),
    (DROP, "1e6", '"stiff"', f"{STIFFNESS}:", "number|'stiff'"),
    (DROP, "= 0.012", '= "0.012"', f"{BALL}:", "not a text (given: '0.012')"),
    (DROP, "0, -0.01]", "true, -0.01]", "shell.plate.placement.xyz[1]:", NO_NUMBER),
    (DROP, "20.0", "true", f"{LAW}.damping:", NO_NUMBER),
    (DROP, "[0.2, 0.2", "[true, 0.2", f"{SIZE}[0]:", NO_NUMBER),
    (DROP, "duration = 0.05", "", "run.duration:", "is missing"),
    (DROP, 'name = "ball"\n', "", "robot[0]:", "either name|or file"),
    (DROP, 'name = "plate"', 'name = "p"\nfile = "x"', "shell.p:", "file or primitive"),
    (DROP, "[run]", "[expect]\nx = 1\n[run]", "expect.x:", "must be a table"),
    (DROP, "[run]", f"{NO_TOLERANCE}[run]", 'expect."a.b":', "rtol or atol"),
    (DROP, "[run]", PD.format('"x"', "{}") + "[run]", "controller.kp:", "number"),
    (DROP, "[0, 0, -0.01]", "[0, 0]", "shell.plate.placement.xyz:", "at least 3"),
    (DROP, DROP, "", "", "is missing"),
    (DROP, DROP, "title = ", "", "not valid TOML"),
    # Of two of one name, each is told by its index.
    (DROP + PLATE.replace("0.02]", "-1]"), "", "", "shell[1].primitive.size[2]:", ""),
    # What is named is not there.
    (DROP, 'frame = "ball"', 'frame = "bal"', "contact.ball-plate:", "root_joint"),
    (DROP, 'shell = "plate"', 'shell = "plaet"', "contact.ball-plate.shell:", "plate"),
    (DROP, "placement", 'frame = "x"\nplacement', "contact.ball-plate:", "universe"),
    (DROP, BOX, 'file = "none.stl"', "shell.plate:", "none.stl"),
    (DROP, "0.2, 0.02]", "0.2, -0.02]", f"{SIZE}[2]:", "greater"),
    (DROP, "[run]", PD.format("[1, 2]", "{}") + "[run]", "controller.kp:", "(6,)"),
    (DROP, "[run]", PD.format("1", "[1]") + "[run]", "controller.q_ref:", "(7,)"),
    (DROP, "[run]", IMPEDANCE + "[run]", "controller:", "no frame 'x'"),
    (DROP, "[run]", PD.format("{ x = 1 }", "{}") + "[run]", "controller.kp:", "root_joint"),
    (DROP, "[run]", '[figures]\nx = "a.py:b"\n[run]', "figures.x:", "no such file"),
    (DROP, "[run]", SOURCE + "[run]", "source.s.find:", "no such file"),
    # Robots, and their joints.
    (TWO_ROBOTS, "knuckle = 0.3", "nuckle = 0.3", f'{FINGER}.start."nuckle":', "knuckle"),
    (TWO_ROBOTS, "knuckle = 1.5", "x = 1", f'{FINGER}.speed."x":', "knuckle"),
    (TWO_ROBOTS, '["middle_joint"]', '["x"]', f"{FINGER}.lock[0]:", "distal_joint"),
    (TWO_ROBOTS, "[1, 2, 3, 0, 0, 0.6, 0.8]", "1", "robot.ball.start", "list of 7"),
    (TWO_ROBOTS, "3, 4, 5, 6]", "3]", 'robot.ball.speed."root_joint":', "6 numbers"),
    (TWO_ROBOTS, "0.6, 0.8]", "0, 0.5]", "robot.ball.start", "its length is"),
    (TWO_ROBOTS, 'name = "ball"', MOUNT, "robot.ball.frame:", "three_link_finger/tip"),
    (TWO_ROBOTS, '"ball"', '"bal"', "robot.bal", "ball"),
    (TWO_ROBOTS, '"ball"', TAKEN, "robot[1]", ""),
    (TWO_ROBOTS, 'name = "ball"', 'urdf = "b.urdf"', "robot[1]", "no such file"),
    (GRIPPER, "# KEYS", BOTH, 'robot[0].start."right_finger"', "cannot be at 0.01: it mimics"),
    (GRIPPER, "# KEYS", BOTH, "", "at 0.02"),
    (GRIPPER, "# KEYS", "q = [0.1, 0.02, 0.03]", "robot[0].q:", "'right_finger' cannot be at 0.03"),
    (GRIPPER, "# KEYS", "q = [0.1]", "", "has 2 coordinates (3 with those of mimic joints), not 1"),
    (GRIPPER, "# KEYS", "speed = { right_finger = 0.1 }", "", "mimics 'left_finger': state the"),
    (GRIPPER, "# KEYS", 'pose = "home"', "", "no pose 'home'"),
    (GRIPPER, "# KEYS", "xacro_args = { a = 1 }", "", "arguments are for files that end in .xacro"),
    # The place of a tip.
    at("{ tip_at = [3, 0, 0] }", "tip_at: the tip on frame 'link_5' comes no nearer than "),
    at("{ tip_at = [3, 0] }", "start.tip_at must be [x, y, z] or a table"),
    at("{ tip_at = { xyz = [0.4, 0, 0.3], along = [0, 0, 0] } }", "along must be a direction"),
    at("{ tip_at = { xyz = [0.4, 0, 0.3], frame = 'lnk_5' } }", "no frame 'lnk_5'"),
    at("{ tip_at = { xy = [0.4, 0, 0.3] } }", "did you mean 'xyz'"),
    at("{ joint_1 = { xyz = [0.4, 0, 0.3] } }", "the table of a tip is start.tip_at"),
    at("{ tip_at = { xyz = [0, 0, 1.39], along = [0, 0, -1] } }", "with its z axis along"),
    (ROOTED, "START", "{ tip_at = [0.4, 0, 0] }", "", "name the frame of the tip"),
    # The ends of a contact.
    (EGG, "plane =", PLANE, "contact.table:", "give"),
    (EGG, 'shell = "egg"', OTHER, "", "touches a shell"),
    (EGG, 'shell = "egg"', 'shell = "egg"\nmethod = "facets"', "", "must be 'smooth'"),
    (EGG, "[0.0, 0.0, 2.0]", "[0.0, 0.0, 0.0]", "", "must not be zero"),
    (TWO_BALLS, BALLS, "", "contact.balls:", "give either shell |or other_sphere, not both"),
    (TWO_BALLS, BALLS, f'{BALLS}\nshell = "plate"', "contact.balls:", "give either shell"),
    (TWO_BALLS, BALLS, f'{BALLS}\nmethod = "smooth"', "contact.balls:", "method belongs to a sh"),
    (TWO_BALLS, "spheres = [", f"{SPHERE}\nspheres = [", "contact.floor:", "give either sphere "),
    (TWO_BALLS, '"lower/ball", radius', '"ball", radius', "contact.balls:", "'ball'"),
    (TWO_BALLS, FIRST, '"universe",', "contact.floor.spheres:", "'universe' has no sphere in its"),
    (TWO_BALLS, FIRST, '"hand",', "contact.floor.spheres:", "'hand'"),
    (HAND, "allegro_right_hand", "turntable", "contact.tips.spheres:", "no collision geometry of"),
    # Sensors.
    (SENSING, 'frame = "root_joint"', 'frame = "tip"', "sensor.inside:", "no frame 'tip'"),
    (SENSING, '"force-torque"', '"force"', "", "unknown type 'force'; valid types: force-"),
    (SENSING, "rate = 500", "rte = 500", "sensor.inside.rte:", "unknown key; did you mean 'rate'"),
    (SENSING, "rate = 500", "rate = -500", "sensor.inside.rate:", "should be greater than 0"),
    (SENSING, 'contact = "ball-plate"', 'contact = "b"', "sensor.touch:", "no contact 'b'"),
    (SENSING, '"touch"', '"inside"', "sensor:", "sensors[1].name = 'inside' is taken"),
    (SENSING, "threshold = 0.5", "", "sensor.touch.threshold:", "is missing"),
    *turned(
        DROP,
        (knob(f"{LAW}.stifness"), f"{LAW}.stifness:", "no 'stifness'|did you mean 'stiffness'"),
        (knob("contact.tip.law.stiffness"), "", "there are: ball-plate"),
        (knob("shell.plate.name"), "", "shell.plate.name: is not a number"),
        (knob("run.rtol"), "", "run.rtol: is not a number"),
        (knob(LAW), "", "is not a number"),
        (knob(STIFFNESS) + knob(STIFFNESS), "knob[1].key:", "is a knob already"),
        (knob(STIFFNESS) + knob("contact.0.law.stiffness"), "", "is a knob already"),
        (knob(STIFFNESS, "min = 2e6\nmax = 3e6"), "", "outside its range 2e+06 to 3e+06"),
        (knob(STIFFNESS, "min = 3e6\nmax = 2e6"), "", "min 3e+06 must be less than max 2e+06"),
        (knob(STIFFNESS, "min = 0\nmax = 2e6\nlog = true"), "", "min must be positive with log"),
        (knob("gravity.2"), "", "needs min and max, as 'gravity.2' is not positive"),
        (knob(STIFFNESS, "mim = 3"), "", "did you mean 'min'"),
        (knob("contact.ball-plate.method"), "", "is not set"),
    ),
    *turned(
        METHOD,
        (knob("contact.ball-plate.method", "min = 1"), "", "is for numbers"),
        (knob("contact.ball-plate.method", 'unit = "m"'), "", "is for numbers"),
    ),
]


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
