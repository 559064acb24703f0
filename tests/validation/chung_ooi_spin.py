"""Chung and Ooi (2011), tests 5 to 8: impacts at an angle, and of balls that spin."""

import dataclasses

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.contents import Finding
from tests.validation.balls import Ball, head_on
from tests.validation.cases import WHY, Data, Outcome, case, read, within
from tests.validation.kharaz import RINGS, THEORY
from tests.validation.oblique import MOBILITY, Setting, rms
from tests.validation.pictures import Panel

STEEL = Setting(1e-5, 7850.0, 2.08e11, 0.3, 0.3)
POLYETHYLENE = Setting(1e-5, 1400.0, 1e9, 0.4, 0.3)
ALLOY = Setting(0.1, 2700.0, 7e10, 0.33, 0.4, restitution=0.5)
NYLON = Setting(0.1, 1000.0, 2.5e9, 0.4, 0.4, restitution=0.5)


def after_sliding(one: Setting, incident: Array, quantity: str) -> Array:
    """Return the recoil or spin of test 5 (n,), as the files name them, at 5 m/s."""
    normal, out = 5.0, []
    for ratio in incident:
        seen = one.impact(normal, float(ratio) * one.mu * normal)
        recoil = seen.patch / (one.mu * seen.normal)
        out.append(recoil if quantity == "recoil" else -one.radius * seen.spin / (one.mu * normal))
    return np.array(out)


@case("chung_ooi_5")
def sliding() -> Outcome:
    """Run test 5."""
    data = read("chung_ooi_5")
    spheres = {"steel": STEEL, "polyethylene": POLYETHYLENE}
    rings = dataclasses.replace(STEEL, rings=RINGS)
    x = np.concatenate([np.linspace(0.05, 6.0, 25), [8.0, 10.0, 13.0]])
    findings: list[Finding] = []
    panels = []
    for quantity in ("recoil", "spin"):
        chosen = data.where("quantity", quantity)
        for name, compared in (("fem", rings), *spheres.items()):
            points = chosen.where("sphere", name)
            incident, value = points["incident"], points["value"]
            title = f"rms of the {quantity}, " + ("finite elements" if name == "fem" else name)
            error = rms(after_sliding(compared, incident, quantity) - value)
            findings += within(0.1, (f"{quantity}_{name}", title, error))
        panels.append(
            Panel(
                "tangential over mu normal velocity",
                RECOIL if quantity == "recoil" else "r spin over mu normal velocity",
                [_points(chosen, name, "incident") for name in ("fem", *spheres)],
                [
                    (f"ours, {name}", x, after_sliding(one, x, quantity))
                    for name, one in (*spheres.items(), ("steel, micro-slip", rings))
                ],
                [(THEORY, x, by_theory(STEEL, x, quantity))],
            )
        )
    out = [f.key for f in findings if not f.met and not f.key.endswith("_fem")]
    explained = dict.fromkeys(out, WHY["contradicted"])
    return Outcome(findings, panels, explained=explained)


RECOIL = "the same after, of the patch"


def by_theory(one: Setting, incident: Array, quantity: str) -> Array:
    """Return what `after_sliding` does, by the theory with micro-slip."""
    recoil = one.recoil(incident)
    return recoil if quantity == "recoil" else 2.5 * (recoil - incident) / MOBILITY


def _points(data: Data, name: str, x: str) -> tuple[str, Array, Array]:
    chosen = data.where("sphere", name)
    return name, chosen[x], chosen["value"]


def after_spinning(one: Setting, x: Array, quantity: str) -> Array:
    """Return beta or the recoil of tests 6 and 8 (n,), as the files name them, at 0.2 m/s."""
    normal, out = 0.2, []
    reach = 3.5 * one.mu * (1 + (one.restitution or 0.0))
    for value in x:
        patch = (reach / float(value) if quantity == "beta" else float(value)) * normal
        seen = one.impact(normal, 0.0, -patch / one.radius)
        out.append(-seen.patch / patch if quantity == "beta" else seen.patch / seen.normal)
    return np.array(out)


def _spinning(key: str, spheres: dict[str, Setting]) -> Outcome:
    """Compare beta and recoil; the sliding points for themselves, as there only mu counts."""
    data = read(key)
    findings: list[Finding] = []
    panels = []
    for quantity, bound in (("beta", 0.02), ("recoil", 0.05)):
        chosen = data.where("quantity", quantity)
        for name, one in spheres.items():
            points = chosen.where("sphere", name)
            x, value = points["x"], points["value"]
            errors = after_spinning(one, x, quantity) - value
            slides = x < 1 if quantity == "beta" else x > 3.5 * one.mu * 1.5
            for part, which in (("sliding", slides), ("sticking", ~slides)):
                title = f"rms of {quantity}, {name}, {part}"
                findings += within(bound, (f"{quantity}_{name}_{part}", title, rms(errors[which])))
        x = np.geomspace(0.15, 24.0, 26) if quantity == "beta" else np.linspace(0.07, 7.0, 29)
        panels.append(
            Panel(
                *AXES[quantity],
                [_points(chosen, name, "x") for name in spheres],
                [
                    (f"ours, {name}", x, after_spinning(s, x, quantity))
                    for name, s in spheres.items()
                ],
            )
        )
    out = [f.key for f in findings if not f.met and f.key.endswith("_sticking")]
    explained = dict.fromkeys(out, WHY["damped"])
    return Outcome(findings, panels, explained=explained)


AXES = {
    "beta": ("7/2 mu (1 + e) normal / tangential velocity", "- tangential velocity after / before"),
    "recoil": ("tangential / normal velocity", RECOIL),
}


@case("chung_ooi_6")
def on_a_plane() -> Outcome:
    """Run test 6."""
    return _spinning("chung_ooi_6", {"alloy": ALLOY, "nylon": NYLON})


@case("chung_ooi_7")
def opposite() -> Outcome:
    """Run test 7."""
    data = read("chung_ooi_7")
    before = data["before"]
    copper = Setting(0.1, 8900.0, 1.2e11, 0.35, 0.4, restitution=0.5)
    findings: list[Finding] = []
    panels = []
    for name, one in (("alloy", ALLOY), ("copper", copper)):
        two = dataclasses.replace(one, young_2=one.young, radius_2=one.radius)
        law, friction = two.laws(0.4)
        seen = [
            head_on(
                Ball(two.radius, two.density, (0.0, 0.0, -0.2), (0.0, spin, 0.0)),
                Ball(two.radius, two.density, (0.0, 0.0, 0.2), (0.0, -spin, 0.0)),
                law,
                friction,
            )
            for spin in before
        ]
        spins = np.array([one.spins[0, 1] for one in seen])
        along = np.array([one.velocities[0, 0] for one in seen])
        error = np.abs(spins / data["after"] - 1).max()
        slip = np.abs(along - data["tangential"]).max()
        spun, moved = f"largest change of the spin, relative, {name}", "largest tangential velocity"
        findings += within(1e-3, (f"spin_{name}", spun, error))
        findings += within(1e-3, (f"along_{name}", f"{moved}, {name}", slip), unit="m/s")
        panels.append(
            Panel(
                "spin before [rad/s]",
                "spin after [rad/s]",
                [("published", before, data["after"])],
                [(f"ours, {name}", before, spins)],
            )
        )
    return Outcome(findings, panels)


@case("chung_ooi_8")
def on_a_ball() -> Outcome:
    """Run test 8."""
    spheres = {
        name: dataclasses.replace(
            one, young_2=1000 * one.young, radius_2=0.5, density_2=1000 * one.density
        )
        for name, one in (("alloy", ALLOY), ("nylon", NYLON))
    }
    return _spinning("chung_ooi_8", spheres)
