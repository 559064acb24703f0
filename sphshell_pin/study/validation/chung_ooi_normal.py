"""Chung and Ooi (2011), tests 1 to 3: normal impacts."""

from __future__ import annotations

import numpy as np

import sphshell_pin as sp
from sphshell_pin.cases.contents import Finding
from sphshell_pin.study.validation.balls import Ball, Impact, head_on, on_plane
from sphshell_pin.study.validation.cases import Array, Data, Outcome, case, read
from sphshell_pin.study.validation.pictures import Panel, draw

PAPER = (
    "Y. C. Chung and J. Y. Ooi, Benchmark tests for verifying discrete element modelling codes at "
    "particle impact level, Granular Matter 13 (2011) 643-656, "
    "https://doi.org/10.1007/s10035-011-0277-0, test "
)
READING = (
    "Two percent: how well points are read from a printed figure. The largest force of the "
    "digitised points alone is off by less."
)
RIGID = 1e20  # Young's modulus [Pa] of what the benchmark calls rigid


def _outcome(name: str, data: Data, impact: Impact) -> Outcome:
    """Compare force against depth and time, on the points of the two figures."""
    depth, time = data.where("series", "depth"), data.where("series", "time")
    peak = 1e3 * time["force"].max()
    loading = impact.t <= impact.t[np.argmax(impact.depth)]
    at_depth = np.interp(1e-6 * depth["x"], impact.depth[loading], impact.force[loading])
    at_time = np.interp(1e-6 * time["x"], impact.t, impact.force, left=0.0, right=0.0)
    lasted = 1e-6 * time["x"][-1]
    findings = [
        Finding(
            "force",
            "largest force, relative to the published one",
            abs(impact.force.max() / peak - 1),
            aim=0.02,
            headline=True,
        ),
        Finding(
            "duration",
            "time in touch, relative to the published one",
            abs(impact.duration / lasted - 1),
            aim=0.02,
        ),
        Finding(
            "depth",
            "rms of force against depth, over the largest",
            _rms(at_depth - 1e3 * depth["force"]) / peak,
            aim=0.02,
        ),
        Finding(
            "time",
            "rms of force against time, over the largest",
            _rms(at_time - 1e3 * time["force"]) / peak,
            aim=0.02,
        ),
    ]
    micro, kilo = 1e6, 1e-3
    force = kilo * impact.force
    panels = [
        Panel(
            "approach [µm]",
            "force [kN]",
            [("published", depth["x"], depth["force"])],
            [("ours", micro * impact.depth[loading], force[loading])],
        ),
        Panel(
            "time since the touch [µs]",
            "force [kN]",
            [("published", time["x"], time["force"])],
            [("ours", micro * impact.t, force)],
        ),
    ]
    caption = "Force of the contact against the approach and against time."
    return Outcome(findings, [draw(name, panels, caption)])


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


@case(
    "chung_ooi_1",
    "Two identical spheres, elastic (Chung and Ooi, test 1)",
    source=f"{PAPER}1: glass spheres, 10 m/s each.",
    setting="Radius 10 mm, E 48 GPa, Poisson's ratio 0.2, density 2800 kg/m^3, no damping; "
    "friction does not act in a normal impact.",
    bound=READING,
    leaves_out="Waves in the spheres: Hertz's contact is quasi-static, as in the benchmark.",
    files=("chung_ooi_1",),
)
def spheres() -> Outcome:
    """Run test 1."""
    law = sp.HertzLaw(4.8e10, 0.2)
    down, up = Ball(0.01, 2800.0, (0, 0, -10.0)), Ball(0.01, 2800.0, (0, 0, 10.0))
    return _outcome("chung_ooi_1", read("chung_ooi_1"), head_on(down, up, law, rows=200))


@case(
    "chung_ooi_2",
    "A sphere on a rigid plane, elastic (Chung and Ooi, test 2)",
    source=f"{PAPER}2: a sphere of aluminum alloy, 0.2 m/s.",
    setting="Radius 0.1 m, E 70 GPa, Poisson's ratio 0.3, density 2699 kg/m^3; the plane is rigid "
    "(E 1e20 Pa).",
    bound=READING,
    leaves_out="Waves in sphere and plane, as in the benchmark.",
    files=("chung_ooi_2",),
)
def plane() -> Outcome:
    """Run test 2."""
    law = sp.HertzLaw(7e10, 0.3, RIGID, 0.3)
    return _outcome(
        "chung_ooi_2", read("chung_ooi_2"), on_plane(Ball(0.1, 2699.0, (0, 0, -0.2)), law, rows=200)
    )


STATED = (0.2, 0.4, 0.6, 0.8, 1.0)


@case(
    "chung_ooi_3",
    "Restitution (Chung and Ooi, test 3)",
    source=f"{PAPER}3: spheres of aluminum oxide and cast iron on a rigid plane, 3.9 m/s.",
    setting="Radius 2.5 mm; oxide: E 380 GPa, Poisson's ratio 0.23, density 4000 kg/m^3; cast "
    "iron: 100 GPa, 0.25, 7000 kg/m^3; restitutions 0.2 to 1. Zero, which the benchmark has "
    "too, is left out: Hunt and Crossley's law has no dissipation for it.",
    reading="What comes back is what was stated. Parameters from YADE's script of the test "
    "(Test3.py, V. Angelidakis and others, 2023); the points of the figure were not found.",
    bound="One millionth: the law is stated by its restitution, and the run has a tolerance.",
    leaves_out="Restitution is stated, not computed: viscosity, plastic flow and waves are in it.",
)
def restitution() -> Outcome:
    """Run test 3."""
    findings: list[Finding] = []
    ours = []
    for name, young, poisson, density in (
        ("aluminum oxide", 3.8e11, 0.23, 4000.0),
        ("cast iron", 1e11, 0.25, 7000.0),
    ):
        back = []
        for stated in STATED:
            law = sp.HertzLaw(young, poisson, RIGID, poisson, stated, 3.9)
            seen = on_plane(Ball(2.5e-3, density, (0, 0, -3.9)), law)
            back.append(float(seen.velocities[0, 2]) / 3.9)
        findings.append(
            Finding(
                name.replace(" ", "_"),
                f"largest error of the restitution, {name}",
                float(np.abs(np.array(back) - STATED).max()),
                aim=1e-6,
                headline=not findings,
            )
        )
        ours.append((f"ours, {name}", STATED, back))
    panel = Panel("restitution stated", "speed back over speed", [("stated", STATED, STATED)], ours)
    return Outcome(findings, [draw("chung_ooi_3", [panel], "Speed back over speed, as stated.")])
