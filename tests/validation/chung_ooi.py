"""Chung and Ooi (2011): normal impacts (tests 1 to 3), at an angle, and of balls that spin."""

from dataclasses import replace

import numpy as np

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from tests.validation.balls import Ball, Impact, head_on, on_plane
from tests.validation.cases import WHY, Figure, Outcome, case, read, within
from tests.validation.kharaz import RINGS, THEORY
from tests.validation.oblique import MOBILITY, RIGID, Setting, rms
from tests.validation.pictures import Panel

STEEL = Setting(1e-5, 7850.0, 2.08e11, 0.3, 0.3)
POLYETHYLENE = Setting(1e-5, 1400.0, 1e9, 0.4, 0.3)
ALLOY = Setting(0.1, 2700.0, 7e10, 0.33, 0.4, restitution=0.5)
NYLON = Setting(0.1, 1000.0, 2.5e9, 0.4, 0.4, restitution=0.5)
COPPER = Setting(0.1, 8900.0, 1.2e11, 0.35, 0.4, restitution=0.5)
RECOIL = "the same after, of the patch"


def normal(name: str, impact: Impact) -> Outcome:
    """Compare force against depth and time, on the points of the two figures."""
    depth, time = (read(name).where("series", one) for one in ("depth", "time"))
    peak, micro = 1e3 * time["force"].max(), 1e-6
    loading = impact.t <= impact.t[np.argmax(impact.depth)]
    pressed = impact.depth[loading], impact.force[loading]
    at_depth = np.interp(micro * depth["x"], *pressed) - 1e3 * depth["force"]
    at_time = np.interp(micro * time["x"], impact.t, impact.force, left=0.0, right=0.0)
    lasted = impact.duration / (micro * time["x"][-1])
    findings = within(
        0.02,
        ("largest force, relative to the published one", impact.force.max() / peak - 1),
        ("time in touch, relative to the published one", lasted - 1),
        ("rms of force against depth, over the largest", rms(at_depth) / peak),
        ("rms of force against time, over the largest", rms(at_time - 1e3 * time["force"]) / peak),
    )
    panels = [
        Panel(
            x, "force [kN]", [("published", of["x"], of["force"])], [("ours", a / micro, f / 1e3)]
        )
        for x, of, a, f in (
            ("approach [µm]", depth, *pressed),
            ("time since the touch [µs]", time, impact.t, impact.force),
        )
    ]
    return Outcome(findings, panels)


@case("chung_ooi_1")
def spheres() -> Outcome:
    """Run test 1."""
    down, up = (Ball(0.01, 2800.0, (0, 0, speed)) for speed in (-10.0, 10.0))
    return normal("chung_ooi_1", head_on(down, up, sp.HertzLaw(4.8e10, 0.2), rows=200))


@case("chung_ooi_2")
def plane() -> Outcome:
    """Run test 2."""
    ball, law = Ball(0.1, 2699.0, (0, 0, -0.2)), sp.HertzLaw(7e10, 0.3, RIGID, 0.3)
    return normal("chung_ooi_2", on_plane(ball, law, rows=200))


@case("chung_ooi_3")
def restitution() -> Outcome:
    """Run test 3."""
    findings: list[Figure] = []
    ours, stated = [], (0.2, 0.4, 0.6, 0.8, 1.0)
    materials = ("aluminum oxide", 3.8e11, 0.23, 4000.0), ("cast iron", 1e11, 0.25, 7000.0)
    for name, young, poisson, density in materials:
        laws = [sp.HertzLaw(young, poisson, RIGID, poisson, one, 3.9) for one in stated]
        ball = Ball(2.5e-3, density, (0, 0, -3.9))
        back = [float(on_plane(ball, law).velocities[0, 2]) / 3.9 for law in laws]
        error = np.abs(np.array(back) - stated).max()
        findings += within(1e-6, (f"largest error of the restitution, {name}", error))
        ours.append((f"ours, {name}", stated, back))
    panel = Panel("restitution stated", "speed back over speed", [("stated", stated, stated)], ours)
    return Outcome(findings, [panel])


def after_sliding(one: Setting, incident: Array, quantity: str) -> Array:
    """Return the recoil or spin of test 5 (n,), as the files name them, at 5 m/s."""
    speed = 5.0
    seen = np.array([one.impact(speed, float(x) * one.mu * speed) for x in incident])
    if quantity == "recoil":
        return np.asarray(seen[:, 3] / (one.mu * seen[:, 0]))
    return np.asarray(-one.radius * seen[:, 2] / (one.mu * speed))


def by_theory(one: Setting, incident: Array, quantity: str) -> Array:
    """Return what `after_sliding` does, by the theory with micro-slip."""
    recoil = one.recoil(incident)
    return recoil if quantity == "recoil" else 2.5 * (recoil - incident) / MOBILITY


@case("chung_ooi_5")
def sliding() -> Outcome:
    """Run test 5."""
    rings, x = replace(STEEL, rings=RINGS), np.concatenate([np.linspace(0.05, 6, 25), [8, 10, 13]])
    compared = {"fem": rings, "steel": STEEL, "polyethylene": POLYETHYLENE}
    lines = {"steel": STEEL, "polyethylene": POLYETHYLENE, "steel, micro-slip": rings}
    findings: list[Figure] = []
    panels = []
    for quantity, label in (("recoil", RECOIL), ("spin", "r spin over mu normal velocity")):
        points = read("chung_ooi_5").where("quantity", quantity)
        marks = {one[0]: one for one in points.series("sphere", "incident")}
        for name, one in compared.items():
            _, incident, value = marks[name]
            title = f"rms of the {quantity}, " + ("finite elements" if name == "fem" else name)
            error = rms(after_sliding(one, incident, quantity) - value)
            why = "" if name == "fem" else WHY["contradicted"]
            findings += within(0.1, (title, error), why=why)
        ours = [(f"ours, {k}", x, after_sliding(one, x, quantity)) for k, one in lines.items()]
        published, theory = [marks[k] for k in compared], by_theory(STEEL, x, quantity)
        axes = "tangential over mu normal velocity", label
        panels.append(Panel(*axes, published, ours, [(THEORY, x, theory)]))
    return Outcome(findings, panels)


def after_spinning(one: Setting, x: Array, quantity: str) -> Array:
    """Return beta or the recoil of tests 6 and 8 (n,), as the files name them, at 0.2 m/s."""
    speed, out = 0.2, []
    reach = 3.5 * one.mu * (1 + (one.restitution or 0.0))
    for value in x:
        patch = (reach / float(value) if quantity == "beta" else float(value)) * speed
        seen = one.impact(speed, 0.0, -patch / one.radius)
        out.append(-seen[3] / patch if quantity == "beta" else seen[3] / seen[0])
    return np.array(out)


# Of each quantity the bound, where balls slide, what is drawn, and the axes.
SPINNING = {
    "beta": (
        0.02,
        lambda x, mu: x < 1,
        np.geomspace(0.15, 24.0, 26),
        ("7/2 mu (1 + e) normal / tangential velocity", "- tangential velocity after / before"),
    ),
    "recoil": (
        0.05,
        lambda x, mu: x > 3.5 * mu * 1.5,
        np.linspace(0.07, 7.0, 29),
        ("tangential / normal velocity", RECOIL),
    ),
}


def _spinning(key: str, spheres: dict[str, Setting]) -> Outcome:
    """Compare beta and recoil; the sliding points for themselves, as there only mu counts."""
    findings: list[Figure] = []
    panels = []
    for quantity, (bound, slides, drawn, axes) in SPINNING.items():
        marks = read(key).where("quantity", quantity).series("sphere", "x")
        for name, x, value in sorted(marks, key=lambda one: list(spheres).index(one[0])):
            errors = after_spinning(spheres[name], x, quantity) - value
            slide, title = slides(x, spheres[name].mu), f"rms of {quantity}, {name}"
            findings += within(bound, (f"{title}, sliding", rms(errors[slide])))
            stick = f"{title}, sticking", rms(errors[~slide])
            findings += within(bound, stick, why=WHY["damped"])
        seen = {name: after_spinning(one, drawn, quantity) for name, one in spheres.items()}
        ours = [(f"ours, {name}", drawn, one) for name, one in seen.items()]
        panels.append(Panel(*axes, marks, ours))
    return Outcome(findings, panels)


@case("chung_ooi_6")
def on_a_plane() -> Outcome:
    """Run test 6."""
    return _spinning("chung_ooi_6", {"alloy": ALLOY, "nylon": NYLON})


@case("chung_ooi_7")
def opposite() -> Outcome:
    """Run test 7."""
    data = read("chung_ooi_7")
    before = data["before"]
    findings: list[Figure] = []
    panels = []
    for name, one in (("alloy", ALLOY), ("copper", COPPER)):
        two = replace(one, young_2=one.young, radius_2=one.radius)
        seen = []
        for spin in before:
            moves = [((0, 0, -0.2 * s), (0, s * spin, 0)) for s in (1.0, -1.0)]
            balls = [Ball(0.1, two.density, *one) for one in moves]
            seen.append(head_on(*balls, *two.laws(0.4)))
        spins = np.array([one.spins[0, 1] for one in seen])
        slip = np.abs([one.velocities[0, 0] for one in seen] - data["tangential"]).max()
        error = np.abs(spins / data["after"] - 1).max()
        findings += within(1e-3, (f"largest change of the spin, relative, {name}", error))
        findings += within(1e-3, (f"largest tangential velocity, {name}", slip), unit="m/s")
        axes, ours = ("spin before [rad/s]", "spin after [rad/s]"), (f"ours, {name}", before, spins)
        panels.append(Panel(*axes, [("published", before, data["after"])], [ours]))
    return Outcome(findings, panels)


@case("chung_ooi_8")
def on_a_ball() -> Outcome:
    """Run test 8."""
    large = {
        name: replace(one, young_2=1e3 * one.young, radius_2=0.5, density_2=1e3 * one.density)
        for name, one in (("alloy", ALLOY), ("nylon", NYLON))
    }
    return _spinning("chung_ooi_8", large)
