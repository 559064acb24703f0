"""A number has one name: in files, --set, sliders, sweeps, fits, `vary` and derivatives."""

import dataclasses
import json
import tomllib

import pytest

import sphshell_pin as sp
from sphshell_pin.base.parameters import parameters_of, type_name
from sphshell_pin.contact import Friction, NormalLaw
from sphshell_pin.dynamics.sensing.sensors import Sensor
from sphshell_pin.errors import NameNotFound, ScenarioError
from sphshell_pin.scenario import build, live_parameters, rebuild
from sphshell_pin.study.fit.parameters import free_parameters
from sphshell_pin.study.sweep.plan import plan_sweep
from tests import models
from tests.scenario.files import DROP, write
from tests.texts import text_of

LAW = next(line for line in DROP.splitlines() if line.startswith("law"))
STATED = tomllib.loads(text_of("scenarios/numbers.toml"))
HERTZ = STATED["law"][3]
KEYS = [
    pytest.param(part, table, name, id=f"{part}-{table.get('type')}-{name}")
    for part, tables in STATED.items()
    for table in tables
    for name, value in table.items()
    if not isinstance(value, str)
]


def drop(part: str, table: dict[str, object]) -> str:
    """Return the scenario of a drop with the law, friction or sensor of `table`."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in table.items()]
    if part == "sensor":
        return DROP + "\n[[sensor]]\n" + "\n".join(lines) + "\n"
    stated = f"{part} = {{ {', '.join(lines)} }}"
    if part == "sphere":
        return DROP.replace("radius = 0.012", "radius = 0.012, offset = [0, 0, 1e-4]")
    return DROP.replace(LAW, stated if part == "law" else f"{LAW}\n{stated}")


def inner(whole: object, path: list[str]) -> object:
    """Return what is at the end of a path of fields and numbers of an object."""
    for one in path:
        whole = whole[int(one)] if one.isdecimal() else getattr(whole, one)  # type: ignore[index]
    return whole


@pytest.mark.parametrize(("part", "table", "name"), KEYS)
def test_a_number_has_one_name(part, table, name, tmp_path):
    head = "sensor.one" if part == "sensor" else f"contact.ball-plate.{part}"
    key = f"{head}.{name}"
    path = write(tmp_path, drop(part, table) + f'\n[[knob]]\nkey = "{key}"\nmin = -1\nmax = 1e10\n')
    built = build(path)
    (knob,) = live_parameters(built)
    assert knob.key == key
    where = name.split(".")

    def value_in(scene: sp.Scene, sensors: tuple[Sensor, ...] = ()) -> object:
        (pair,) = scene.pairs
        return inner(sensors[0] if sensors else pair, [*pair.parts.get(part, ()), *where])

    before = value_in(built.scene, built.simulation.sensors)
    assert before == knob.value == table[name]
    after = before * 0.875 if name != "seed" else 3
    set_ = rebuild(built, {key: repr(after)})
    assert set_.scenario == build(path, {key: repr(after)}).scenario
    assert value_in(set_.scene, set_.simulation.sensors) == after
    assert list(plan_sweep(path, {key: [after]}).points.values) == [key]
    if name != "seed":
        (free,) = free_parameters([key], built.scenario, path)
        assert (free.keys, free.start) == ((key,), before)
    whole, values = key, [after]
    if name == "offset.2":
        whole, values = f"{head}.offset", [[0.0, 0.0, after]]
    rollout = built.simulation.rollout(built.q0, None, 1e-4, vary={whole: values})
    in_scene = whole.removeprefix("contact.").replace("sensor.", "sensors.")
    assert list(rollout.varied) == [in_scene]
    run = rollout[0]
    if part == "sensor":
        return
    assert value_in(run.scene) == pytest.approx(after)
    column = f"{in_scene}.z" if name == "offset.2" else in_scene
    for one in (key, column):
        state = (built.q0, built.v0)
        assert built.scene.dynamics_derivatives(*state, parameters=[one]).parameters == (column,)
        run = built.simulation.run(*state, 1e-4, sensitivities=[one])
        assert run.sensitivities.parameters == (column,)


@pytest.mark.parametrize(
    ("family", "part"), [(NormalLaw, "law"), (Friction, "friction"), (Sensor, "sensor")]
)
def test_the_numbers_of_all_kinds_are_tried(family, part):
    for kind, stating in family.kinds.items():
        stated = [one for one in dataclasses.fields(stating) if one.name in parameters_of(stating)]
        numbers = {one.name for one in stated if "float" in type_name(one)}
        tried = {name for table in STATED[part] if table["type"] == kind for name in table}
        if tried:
            # The radius of a ball on a plane makes another law of Hertz's.
            assert numbers - {"radius", "radius_2"} <= tried
        else:
            assert kind in ("adams", "table", "function", "none", "joint-torque")


def test_a_single_number_has_no_places() -> None:
    """Only of several numbers can one be named by its place."""
    scene = models.on_plate(models.ball(), models.linear_law(1e4, 10.0))
    state = (models.free_q([0, 0, 0.049]), [0.0] * 6)
    for number in ("law.stiffness", "sphere.radius"):
        found = scene.dynamics_derivatives(*state, parameters=[f"ball-plate.{number}"])
        assert found.parameters == (f"ball-plate.{number}",)
        with pytest.raises(NameNotFound, match=rf"{number}\.0"):
            scene.dynamics_derivatives(*state, parameters=[f"ball-plate.{number}.0"])


@pytest.mark.parametrize(
    ("wrong", "hint"),
    [("law.yuong", "young"), ("law.yuong_2", "young_2"), ("sphere.radios", "radius")],
)
def test_the_nearest_name_of_the_same_body_is_suggested(wrong, hint, tmp_path):
    path = write(tmp_path, drop("law", HERTZ))
    built, key = build(path), f"contact.ball-plate.{wrong}"
    said = rf"did you mean '(ball-plate.)?({wrong.split('.')[0]}\.)?{hint}'"
    with pytest.raises(ScenarioError, match=said):
        free_parameters([key], built.scenario, path)
    with pytest.raises(ScenarioError, match=said):
        rebuild(built, {key: "1"})
    with pytest.raises(NameNotFound, match=said):
        built.scene.dynamics_derivatives(built.q0, parameters=[f"ball-plate.{wrong}"])
    with pytest.raises(NameNotFound, match=said):
        built.simulation.rollout(built.q0, vary={f"ball-plate.{wrong}": [1.0]})


@pytest.mark.parametrize("name", ["ball-plate.law.", "ball-plate.", "", "contact."])
def test_a_name_that_ends_early_is_none(name, tmp_path):
    built = build(write(tmp_path))
    with pytest.raises(NameNotFound, match="no parameter"):
        built.scene.dynamics_derivatives(built.q0, parameters=[name])
