"""One description of each component: checks, files, C++ and documents follow from it."""

import re
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

import sphshell_pin as sp
from sphshell_pin import _core
from sphshell_pin.base.parameters import Component, parameter, parameters_of, type_name
from sphshell_pin.contact import Friction, NormalLaw
from sphshell_pin.dynamics.control.controllers import Controller
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.dynamics.sensing.sensors import Sensor
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.scenario.format import shape_tables as primitives
from sphshell_pin.scenario.format.shape_tables import Primitive

FAMILIES = (NormalLaw, Friction, Controller, Integrator, Primitive, Sensor)
CORES = {NormalLaw: _core.NormalLaw, Friction: _core.FrictionLaw}


def concrete(family: type[Component]) -> list[type[Component]]:
    """Return the classes of a family without the other ways to state them."""
    if "kind" in vars(family):
        return [family]
    return [one for base in family.__subclasses__() for one in concrete(base)]


KINDS = [kind for family in FAMILIES for kind in family.kinds.values()]
DOCS = Path(__file__).parent.parent / "docs"
PAGES = ("laws", "scenarios")
MARK = re.compile(r"^<!-- (parameters|kinds): (\w+) -->$", re.MULTILINE)


@dataclass(frozen=True)
class Spring(Component):
    """A component of every kind of bounds.

    Parameters
    ----------
    stiffness : k
    exponent : e
    """

    stiffness: float = parameter(above=0, unit="N/m^{0.exponent:g}")
    exponent: float = parameter(1.5, above=1)
    damping: float = parameter(0.0, at_least=0, unit="N s/m", help="c")
    share: float | None = parameter(None, above=0, at_most=1, help="s")
    twist: bool = parameter(False, help="t")
    note: str | None = None


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"stiffness": 0}, r"stiffness = 0 must be positive \[N/m\^exponent\]"),
        ({"stiffness": "1"}, "stiffness = '1' must be a number"),
        ({"stiffness": float("nan")}, "must be finite"),
        ({"exponent": 1.0}, "exponent = 1.0 must be more than 1"),
        ({"damping": -1}, r"damping = -1 must not be negative \[N s/m\]"),
        ({"share": 1.5}, r"share = 1.5 must lie in \(0, 1\]"),
        ({"twist": 1}, "must be True or False"),
    ],
)
def test_a_value_is_checked_against_its_description(values, said):
    with pytest.raises(InvalidParameter, match=said) as caught:
        Spring(**{"stiffness": 1.0, **values})
    assert caught.value.name == next(iter(values))


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (np.float64(-0.5), "-0.5"),
        (np.sin, "<ufunc 'sin'>"),
        (np.zeros(3), "[0.0, 0.0, 0.0]"),
        (np.zeros(1000), "array([0., 0., 0., "),
        (SimpleNamespace(size=len), "namespace(size=<built-in function len>)"),
        ("s" * 300, f"'{'s' * 99} ... "),
    ],
)
def test_a_refused_value_is_shown_as_it_would_be_typed(value, shown):
    assert str(InvalidParameter("speed", value, "must be")).startswith(f"speed = {shown}")


def test_units_may_depend_on_other_values():
    spring = Spring(2)
    assert spring.stiffness.hex() == (2.0).hex()
    assert spring.unit_of("stiffness") == "N/m^1.5"
    assert parameters_of(spring)["stiffness"].general_unit == "N/m^exponent"
    assert Spring(2, share=1, twist=True)._numbers() == [2.0, 1.5, 0.0, 1.0, 1.0]


def test_pydantic_reads_the_same_description():
    adapter = TypeAdapter(Spring)
    assert adapter.validate_python({"stiffness": 1}) == Spring(1.0)
    for wrong in ({"stiffness": -1}, {"stiffness": 1, "share": 2}, {"stiffness": 1, "k": 2}):
        with pytest.raises(ValidationError):
            adapter.validate_python(wrong)
    schema = adapter.json_schema()["properties"]["stiffness"]
    assert schema["exclusiveMinimum"] == 0
    assert schema["description"] == "k"


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_parameter_is_described(kind):
    for one in fields(kind):
        about = parameters_of(kind).get(one.name)
        if about is None:
            assert one.default is not MISSING, "what no file can state has a default"
            continue
        assert about.help
        assert "\n" not in about.help
        if type_name(one) == "float":
            assert about.bounds, f"{one.name} has no bounds"


FOLLOWING = {
    *((sp.HertzLaw, name) for name in ("dissipation", "relaxation_time")),
    (sp.FoundationLaw, "radius"),
}
LAWS = [(kind, core) for family, core in CORES.items() for kind in concrete(family)]


@pytest.mark.parametrize(
    ("kind", "core"), [one for one in LAWS if one[0].kind != "function" and "kind" in vars(one[0])]
)
def test_cpp_states_the_same_bounds_units_and_defaults(kind, core):
    """What C++ programs fill in, `sphshell_pin/laws/*.hpp`, is what Python's class says."""
    stated = {f.name: (parameters_of(kind)[f.name], f) for f in fields(kind) if f.metadata}
    for name, unit, above, at_least, at_most, default in core.parameters(kind.kind):
        if name not in stated:  # what follows from others in Python
            assert (kind, name) in FOLLOWING
            continue
        about, field = stated.pop(name)
        assert unit == about.general_unit
        bounds = {"gt": above, "ge": at_least, "le": at_most}
        if name != "radius":  # 0 stands for none
            assert {k: v for k, v in bounds.items() if abs(v) < float("inf")} == about.bounds
        if field.default is not MISSING and default is not None:
            assert default == (field.default or 0.0)
    assert not stated.keys() - {"restitution", "speed", "loss_tangent", "frequency"}


# Valid values of what has no default.
VALUES = {
    **dict.fromkeys(("stiffness", "young", "young_2", "modulus"), 1e6),
    **dict.fromkeys(("radius", "length", "thickness"), 0.01),
    **dict.fromkeys(("poisson", "poisson_2", "mu_static", "mu_dynamic"), 0.3),
    **dict.fromkeys(("kp", "kd", "damping", "threshold"), 1.0),
    **dict.fromkeys(("frame", "name", "joint"), "a"),
    **{"size": [0.1, 0.2, 0.3], "radii": [0.1, 0.2, 0.3], "path": [[0.0, 0.0, 0.0]]},
    **{"function": "a.py:b", "file": "a.csv"},
}
# Where one of several is needed.
ALSO = {"contact-switch": {"contact": "c"}}


def out_of_bounds(about):
    """Yield what a parameter must not be."""
    for limit, beyond in ((about.above, 0.0), (about.at_least, -1.0), (about.at_most, 1.0)):
        if limit is not None:
            yield limit + beyond
    yield from (float("nan"), float("inf"), "1", True, [1.0])


BOUNDS = [
    pytest.param(kind, one, wrong, id=f"{kind.__name__}-{one}-{wrong}")
    for kind in KINDS
    for one, about in parameters_of(kind).items()
    if about.bounds
    for wrong in out_of_bounds(about)
]


@pytest.mark.parametrize(("kind", "name", "wrong"), BOUNDS)
def test_a_value_out_of_bounds_is_named(kind, name, wrong):
    needed = [one.name for one in fields(kind) if one.default is MISSING]
    good = {one: VALUES[one] for one in needed} | ALSO.get(kind.kind, {})
    kind(**good)
    with pytest.raises(InvalidParameter, match=f"^{name}") as caught:
        kind(**{**good, name: wrong})
    assert caught.value.name == name


@pytest.mark.parametrize(("family", "core"), CORES.items())
def test_the_compiled_core_has_the_same_kinds(family, core):
    own = {one.kind for one in concrete(family)}
    assert {kind for kind in core.kinds() if kind != "none"} == own
    with pytest.raises(ValueError, match="unknown kind 'x'"):
        core("x", [])


def test_the_documents_show_every_law_and_every_family():
    """The site makes the tables: docs/site/parameters.py."""
    laws, keys = (set(MARK.findall((DOCS / f"{one}.md").read_text())) for one in PAGES)
    every = (one for family in CORES for one in concrete(family))
    assert laws == {("parameters", one.__name__) for one in every}
    shown = {getattr(sp, one, None) or getattr(primitives, one) for _, one in keys}
    for family in set(FAMILIES) - {Integrator}:
        assert any(issubclass(one, family) for one in shown), family
