"""Wrong arguments of shells, laws and friction get a sentence that names them."""

import ctypes
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import SphshellError
from tests import meshes, models
from tests.contact.helpers import shell_of
from tests.contact.test_function_law import C_LAW, FORCE, OWN, force
from tests.contact.test_planes import egg, scene_of

LAW, NAN, STILL, UP = sp.ImpactLaw(1e5), np.nan, pin.Motion.Zero(), [0, 0, 1]
OTHER = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)
ZEROS, POINTER, CUBE = np.zeros(3), C_LAW.function, shell_of(meshes.cube())
MASKED = np.ma.masked_array(ZEROS, [True, False, False])
NO_POINTS = [[0, 0, NAN], [0, 0, np.inf], np.zeros(4), np.zeros((1, 3)), ZEROS * 1j, MASKED]
NO_RADII = (0.0, -1.0, NAN, np.inf, True)
SPINS = sp.BristleFriction(0.4, 0.3, 1e4, 5.0, torsional=True)
TWICE = {"restitution": 0.5, "speed": 1.0, "loss_tangent": 0.1, "frequency": 1.0}


def wrench(point=ZEROS, normal=UP, depth=0.01, **more):
    given = {"motion_i": STILL, "motion_j": STILL, "law": LAW, **more}
    sp.contact_wrench(point, normal, depth, **given)


def batch(centers=(3, 3), radii=(1.0, 1.0, 1.0), **more):
    CUBE.contacts_batch(np.zeros(centers), radii, **more)


def pressed(law=LAW, friction=None):
    models.on_plate(models.ball(), law, friction)


Call = Callable[[], object]
REFUSED: list[tuple[str, Call]] = [
    ("magic.*facets", lambda: CUBE.contacts(UP, 0.1, method="magic")),
    *(
        (words, lambda one=one, method=method: CUBE.contacts(*one, method))
        for method in ("smooth", "facets")
        for words, wrong in (
            ("center", [(point, 0.3) for point in NO_POINTS]),
            ("radius", [(ZEROS, radius) for radius in NO_RADII]),
        )
        for one in wrong
    ),
    *(("offset", lambda point=point: sp.Sphere(0.3, "tip", point)) for point in NO_POINTS),
    *(("radius", lambda radius=radius: sp.Sphere(radius, "tip")) for radius in NO_RADII),
    ("centers", lambda: batch((3, 2))),
    ("radii", lambda: batch(radii=np.ones(2))),
    *(("threads", lambda n=n: batch(threads=n)) for n in (-1, 0, 1.5, True, "all", NAN)),
    *(("radi", lambda r=r: batch(radii=r)) for r in ("1", [True] * 3, 1j, [1, NAN, 1], [1, 0, 1])),
    ("point", lambda: wrench(ZEROS[:2])),
    ("point", lambda: wrench([0, 0, NAN])),
    ("normal", lambda: wrench(normal=[0, 0, 2])),
    ("normal", lambda: wrench(normal=ZEROS)),
    ("depth", lambda: wrench(depth=NAN)),
    *(
        (next(iter(wrong)), lambda depth=depth, wrong=wrong: wrench(depth=depth, **wrong))
        for depth in (0.01, -0.01)
        for wrong in (
            {"motion_i": np.zeros(6)},
            {"motion_j": np.zeros(6)},
            {"law": 5},
            {"law": sp.ImpactLaw},
            {"friction": 0.3},
        )
    ),
    ("at a lone contact point", lambda: wrench(law=sp.HertzLaw(1e7, 0.3))),
    ("path", lambda: sp.Shell.from_file(None)),
    ("path", lambda: sp.Shell.from_file(3)),
    (
        "elements must not be masked",
        lambda: sp.Shell(np.eye(3), np.ma.masked_equal([[0, 1, 2]], 2)),
    ),
    # Laws
    ("units", lambda: sp.ImpactLaw.from_adams(1e5, 2.2, 10.0, 0.1, units="furlong")),
    ("young = -1.0 must be positive", lambda: sp.HertzLaw(-1.0, 0.3)),
    ("restitution, speed = .* together", lambda: sp.HertzLaw(1e9, 0.3, restitution=0.5)),
    ("must not be given with a restitution", lambda: sp.HertzLaw(1e9, 0.3, **TWICE)),
    ("young = 'steel' must be a number", lambda: sp.HertzLaw("steel", 0.3)),
    ("poisson = 'rubber' must be a number", lambda: sp.HertzLaw(2.1e11, "rubber")),
    (r"law.on_plane\(radius\)", lambda: sp.HertzLaw(1e7, 0.3).normal_force(1e-3)),
    ("no material 'gum'; the table has: steel, ", lambda: sp.CoulombFriction.of("steel", "gum")),
    ("force", lambda: sp.TableLaw([0, 1], [0, 1, 2])),
    ("force", lambda: sp.TableLaw([0, 1], [0, None])),
    *(("depth", lambda depth=depth: sp.TableLaw(depth, [0, 1])) for depth in ("01", [[0, 1]], 1.0)),
    ("function = 3.0 must be a C function pointer", lambda: sp.FunctionLaw(3.0)),
    ("function = .* must not be null", lambda: sp.FunctionLaw(FORCE())),
    (r"be a double f\(double, double, const double\*", lambda: sp.FunctionLaw(OTHER(abs))),
    (r"energy = .* double f\(double, const", lambda: sp.FunctionLaw(POINTER, FORCE(force))),
    (r"parameters\['k'\] = nan must be finite", lambda: sp.FunctionLaw(POINTER, None, {"k": NAN})),
    *(
        (f"'{name}' must be names", lambda name=name: sp.FunctionLaw(POINTER, None, {name: 1.0}))
        for name in ("text", "a b", "function", "parameters", "_energy")
    ),
    ("'text' must be names", lambda: sp.FunctionFriction(POINTER, {"text": 1.0})),
    (r"FunctionLaw\(function\).*docs/laws.md", lambda: pressed(force)),
    # Planes
    *(("must be 'smooth'", lambda m=m: scene_of(CUBE, method=m)) for m in ("facets", "elements")),
    ("must be a Shell", lambda: scene_of(sp.Sphere(0.1, "body"))),
    (r"take law.on_plane\(radius\), or", lambda: scene_of(egg(), sp.HertzLaw(1e9, 0.3))),
    ("follows from the radius", lambda: scene_of(egg(), friction=SPINS)),
    ("must not be zero", lambda: sp.Plane("universe", normal=(0.0, 0.0, 0.0))),
    # Friction
    ("mu_dynamic", lambda: sp.CoulombFriction(0.1, 0.3, 0.1, 1.0)),
    ("v_dynamic", lambda: sp.CoulombFriction(0.3, 0.1, 0.1, 0.1)),
    ("beside a FoundationLaw take a Coulomb", lambda: pressed(sp.FoundationLaw(1e6, 5e-3), OWN)),
]


@pytest.mark.parametrize(("words", "call"), REFUSED)
def test_a_wrong_argument_is_named(words: str, call: Call) -> None:
    with pytest.raises(SphshellError, match=words):
        call()


def test_nothing_in_reach() -> None:
    contacts = CUBE.contacts([5, 0, 0], 0.1, method="facets")
    assert len(contacts) == 0
    assert contacts.point.shape == contacts.normal.shape == (0, 3)
    assert contacts.depth.shape == contacts.element.shape == contacts.feature.shape == (0,)
