"""A scenario file becomes a scene: what it names is found, or a fault names what would be valid."""

import numpy as np
import pytest

from sphshell_pin import Adaptive, ImpactLaw, RungeKutta4, SemiImplicitEuler
from sphshell_pin.errors import ScenarioError
from sphshell_pin.scenario import build
from tests.scenario.files import DROP, write
from tests.texts import text_of

HERTZ = '{ type = "hertz", radius = 0.012, young = 2e11, poisson = 0.3 }'
LAW_LINE = next(line for line in DROP.splitlines() if line.startswith("law"))


@pytest.mark.parametrize(
    ("law", "kind", "attribute", "value"),
    [
        ('{ type = "adams" }', "ImpactLaw", "stiffness", 1e5 * 1000**2.2),
        ('{ type = "adams" }', "ImpactLaw", "exponent", 2.2),
        ('{ type = "impact", stiffness = 5 }', "ImpactLaw", "exponent", ImpactLaw(5.0).exponent),
        ('{ type = "hunt-crossley", stiffness = 5 }', "HuntCrossleyLaw", "stiffness", 5.0),
        (HERTZ, "ImpactLaw", "stiffness", 4 / 3 * np.sqrt(0.012) * 1e11 / 0.91),
    ],
)
def test_laws(law, kind, attribute, value, tmp_path):
    built = build(write(tmp_path, DROP.replace(LAW_LINE, f"law = {law}")))
    found = built.scene.pairs[0].law
    assert type(found).__name__ == kind
    assert getattr(found, attribute) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    "primitive",
    [
        'type = "box", size = [0.1, 0.2, 0.3]',
        'type = "sphere", radius = 0.1',
        'type = "cylinder", radius = 0.1, length = 0.2',
        'type = "capsule", radius = 0.1, length = 0.2',
        'type = "cone", radius = 0.1, length = 0.2',
        'type = "ellipsoid", radii = [0.1, 0.2, 0.3]',
    ],
)
def test_primitives_are_closed_shells_of_their_size(primitive, tmp_path):
    old = 'type = "box", size = [0.2, 0.2, 0.02]'
    shell = build(write(tmp_path, DROP.replace(old, primitive))).scene.pairs[0].side_j.shell
    assert shell.is_closed
    assert 0.1 <= shell.size <= 0.8


def test_a_python_controller_is_found_beside_the_file(tmp_path):
    (tmp_path / "own.py").write_text("def tau(t, q, v, contacts):\n    return 0\n")
    text = DROP.replace("[run]", '[controller]\ntype = "python"\nfunction = "own.py:tau"\n[run]')
    assert build(write(tmp_path, text)).controller(0, 0, 0, 0) == 0
    (tmp_path / "wrong.py").write_text("import nothing_of_that_name\n")
    for function, said in (
        ("own.py:tua", r"no function 'tua'.*has: tau"),
        ("other.py:tau", "no such file"),
        ("own", r"file\.py:function"),
        ("wrong.py:tau", "nothing_of_that_name"),
    ):
        with pytest.raises(ScenarioError, match=said):
            build(write(tmp_path, text.replace("own.py:tau", function)))


def test_a_gain_spares_the_free_bodies(tmp_path):
    built = build(write(tmp_path, text_of("scenarios/finger_and_free_ball.toml")))
    model, controller = built.scene.model, built.controller
    driven = controller.actuated(model)
    np.testing.assert_allclose(driven * controller.gain("kp", model), [2, 2, 2, 0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(controller.gain("kd", model), [0.1, 0, 0, 0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(controller.posture(model, built.q0)[:4], [0.5, 0, 0, 0])


@pytest.mark.parametrize("method", ["facets", "smooth", "elements"])
def test_methods(method, tmp_path):
    built = build(write(tmp_path, DROP.replace(LAW_LINE, f'method = "{method}"\n{LAW_LINE}')))
    (pair,) = built.scene.pairs
    assert pair.side_j.method == method
    assert len(built.scene.contacts(built.q0, built.v0)) == 0
    built.q0[2] = 0.0119
    contacts = built.scene.contacts(built.q0, built.v0)
    np.testing.assert_allclose(contacts.depth, [1e-4], rtol=1e-9)


@pytest.mark.parametrize(
    ("keys", "integrator"),
    [
        ("", Adaptive()),
        ("rtol = 1e-4\n", Adaptive(1e-4)),
        ("dt = 2e-5\n", SemiImplicitEuler(2e-5)),
        ('integrator = "runge-kutta-4"\n', RungeKutta4()),
    ],
)
def test_the_integrator_is_adaptive_unless_dt_is_given(keys, integrator, tmp_path):
    path = write(tmp_path, DROP.replace("dt = 1e-4\n", keys))
    assert build(path).simulation.integrator == integrator
    if not keys:
        fixed = build(path, {"run.dt": "1e-3"}).simulation.integrator
        assert fixed == SemiImplicitEuler(1e-3)
