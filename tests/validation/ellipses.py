"""Elliptical contacts at rest: half axes, approach and pressure under a published load."""

import math
from dataclasses import dataclass

import numpy as np

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.study.report.contents import Table, columns
from tests import meshes, models
from tests.validation.balls import plane
from tests.validation.cases import Data, Outcome, case, read, within
from tests.validation.pictures import Panel

FILE = "elliptical_contacts"
SIDE = 0.02  # of the elements, over the smallest radius of ball and shell
FLAT = 1e-9  # curvature, over that of the ball
QUANTITIES = ("a", "b", "approach", "pressure")


@dataclass(frozen=True)
class Touch:
    """A contact: its force [N], half axes a >= b [m], approach [m] and largest pressure [Pa]."""

    force: float
    a: float
    b: float
    approach: float
    pressure: float


def press(radius: float, shell: sp.Shell, law: NormalLaw, approach: float) -> Touch:
    """Return the contact of a ball of `radius` [m] over the shell, whose top is at the origin."""
    scene = models.on_shell(models.slider(0.0, 1e3), shell, law, radius=radius)
    result = sp.Simulation(scene).run([radius - approach], None, 1e-12, record=("patch",))
    (a, b), patch = result.patches["half_axes"][0], result.patches[0]
    force = float(result.contacts.normal_force[0])
    return Touch(force, float(a), float(b), float(patch["approach"]), float(patch["peak_pressure"]))


def under(force: float, radius: float, shell: sp.Shell, law: NormalLaw) -> Touch:
    """Return the contact under `force` [N]: for a given shape that grows as approach^1.5."""
    first = press(radius, shell, law, 1e-5 * radius)
    return press(radius, shell, law, first.approach * (force / first.force) ** (2 / 3))


def saddle(round_: float, along: float, side: float) -> sp.Shell:
    """Return a ring about y whose top is at the origin; `side` [m] is that of its elements.

    `round_` > 0 is its curvature [1/m] round the axis, `along` <= 0 that of its profile: a
    cylinder, or a groove in it.
    """
    arc = side * np.arange(-3.0, 4.0)
    tilt, inner = along * arc, 1 / round_
    # Height and place across; of a straight profile their limits.
    lift, across = 2 * np.sin(tilt / 2) ** 2 / -(along or 1), arc * np.sinc(tilt / np.pi)
    turn = np.arange(-3.0, 4.0) * min(side * round_, 0.4)
    out = np.stack([np.sin(turn), np.zeros(turn.size), np.cos(turn)], axis=1)
    y = np.array([0.0, 1.0, 0.0])
    normals = np.cos(tilt)[:, None, None] * out + np.sin(tilt)[:, None, None] * y
    vertices = (inner + lift)[:, None, None] * out + across[:, None, None] * y
    elements = meshes.grid_plate(6, 6, quads=True)[1]
    vertices[:, :, 2] -= inner
    return sp.Shell(vertices.reshape(-1, 3), elements[:, ::-1], normals=normals.reshape(-1, 3))


def shell_under(ball: float, a: float, b: float) -> sp.Shell:
    """Return the shell that makes the gap a x^2 + b y^2 [1/m], a >= b, under a `ball` [m]."""
    round_, along = 2 * a - 1 / ball, 2 * b - 1 / ball
    round_, along = (0.0 if abs(one) < FLAT / ball else one for one in (round_, along))
    radii = [ball, *(1 / abs(one) for one in (round_, along) if one)]
    return saddle(round_, along, SIDE * min(radii)) if round_ else plane(10 * ball)


def contact_of(row: Data) -> Touch:
    """Return the contact of a row of the file: a ball on a shell with the rest of A and B."""
    millimeter, mega = 1e-3, 1e6
    ball = row["ball"].item() * millimeter
    shell = shell_under(ball, row["A"].item() / millimeter, row["B"].item() / millimeter)
    shear, poisson = row["shear_modulus"].item() * mega, row["poisson"].item()
    law = sp.HertzLaw(2 * shear * (1 + poisson), poisson)
    return under(row["force"].item(), ball, shell, law)


@case("elliptical_contacts")
def elliptical_contacts() -> Outcome:
    """Press each of them."""
    data = read(FILE)
    scale = {"a": 1e3, "b": 1e3, "approach": 1e3, "pressure": 1e-6}
    errors: dict[str, dict[str, float]] = {}
    rows = []
    for name in data.texts("name"):
        row = data.where("name", name)
        touch, errors[name] = contact_of(row), {}
        for one in QUANTITIES:
            mine, text = scale[one] * float(getattr(touch, one)), row.texts(one)[0]
            error = mine / float(text) - 1 if text else math.nan
            errors[name][one] = abs(error)
            rows.append((name, one, text, f"{mine:.5g}", f"{error:.1e}" if text else ""))

    def worst(names: list[str], quantities: tuple[str, ...]) -> float:
        return float(np.nanmax([errors[n][q] for n in names for q in quantities]))

    contact = [name for name in errors if name != "bearing"]
    axes = worst(contact, ("a", "b"))
    numerical = "largest error relative to CONTACT's numerical one"
    bearing = "bearing 6206, half axes and pressure relative to those of approximate formulas"
    findings = [
        *within(5e-4, ("half axes, largest error relative to CONTACT's", axes)),
        *within(
            4e-3,
            (f"approach, {numerical}", worst(contact, ("approach",))),
            (f"largest pressure, {numerical}", worst(contact, ("pressure",))),
        ),
        *within(0.03, (bearing, worst(["bearing"], QUANTITIES))),
    ]
    panels = []
    for one, unit in (("a", "mm"), ("b", "mm"), ("pressure", "MPa")):
        published = data[one]
        values = np.array([float(r[3]) for r in rows if r[1] == one])
        line: Array = np.array([published.min() / 2, published.max() * 2])
        marks, equal = ("contacts", published, values), ("equal", line, line)
        names = f"published {one} [{unit}]", f"our {one} [{unit}]"
        panels.append(Panel(*names, [marks], (), [equal], logarithmic=True))
    heads = ("contact", "quantity", "published: published [mm, MPa]", "ours", "error")
    return Outcome(findings, panels, [Table(FILE, "All figures.", columns(*heads), rows)])


@case("hertz_coefficients")
def hertz_coefficients() -> Outcome:
    """Press a ball on a cylinder of each of the ratios."""
    data = read("hertz_coefficients")
    law, young, poisson = sp.HertzLaw(2e11, 0.3), 2e11, 0.3
    total, force = 100.0, 10.0  # sum of the curvatures [1/m], load [N]
    unit = (3 * force * (1 - poisson**2) / (young * total)) ** (1 / 3)
    found = []
    for share in data["cos_tau"]:
        a, b = (1 + share) * total / 4, (1 - share) * total / 4
        ball = 1 / (2 * b)
        touch = under(force, ball, shell_under(ball, a, b), law)
        found.append((touch.a / unit, touch.b / unit, 2 * touch.approach / (total * unit**2)))
    names = {"xi": "half axis a", "eta": "half axis b", "zeta": "approach"}
    what = "largest error relative to the printed coefficient"
    ours = dict(zip(names, np.array(found).T, strict=True))
    errors = {key: np.abs(ours[key] / data[key] - 1).max() for key in names}
    findings = within(0.006, *((f"{names[key]}, {what}", errors[key]) for key in names))
    # From a circle at the right to slender ellipses at the left.
    x = 1 - data["cos_tau"]
    panel = Panel(
        "1 - cos tau: ratio of curvatures",
        "coefficient",
        [(f"printed, {name}", x, data[key]) for key, name in names.items()],
        [(f"ours, {name}", x, ours[key]) for key, name in names.items()],
        logarithmic=True,
    )
    return Outcome(findings, [panel])
