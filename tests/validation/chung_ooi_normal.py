"""Chung and Ooi (2011), tests 1 to 3: normal impacts."""

import numpy as np

import sphshell_pin as sp
from sphshell_pin.study.report.contents import Finding
from tests.validation.balls import Ball, Impact, head_on, on_plane
from tests.validation.cases import Data, Outcome, case, read, within
from tests.validation.oblique import RIGID, rms
from tests.validation.pictures import Panel


def _outcome(data: Data, impact: Impact) -> Outcome:
    """Compare force against depth and time, on the points of the two figures."""
    depth, time = data.where("series", "depth"), data.where("series", "time")
    peak = 1e3 * time["force"].max()
    loading = impact.t <= impact.t[np.argmax(impact.depth)]
    at_depth = np.interp(1e-6 * depth["x"], impact.depth[loading], impact.force[loading])
    at_time = np.interp(1e-6 * time["x"], impact.t, impact.force, left=0.0, right=0.0)
    lasted = 1e-6 * time["x"][-1]
    apart = rms(at_depth - 1e3 * depth["force"]), rms(at_time - 1e3 * time["force"])
    findings = within(
        0.02,
        ("force", "largest force, relative to the published one", impact.force.max() / peak - 1),
        ("duration", "time in touch, relative to the published one", impact.duration / lasted - 1),
        ("depth", "rms of force against depth, over the largest", apart[0] / peak),
        ("time", "rms of force against time, over the largest", apart[1] / peak),
    )
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
    return Outcome(findings, panels)


@case("chung_ooi_1")
def spheres() -> Outcome:
    """Run test 1."""
    law = sp.HertzLaw(4.8e10, 0.2)
    down, up = Ball(0.01, 2800.0, (0, 0, -10.0)), Ball(0.01, 2800.0, (0, 0, 10.0))
    return _outcome(read("chung_ooi_1"), head_on(down, up, law, rows=200))


@case("chung_ooi_2")
def plane() -> Outcome:
    """Run test 2."""
    law = sp.HertzLaw(7e10, 0.3, RIGID, 0.3)
    ball = Ball(0.1, 2699.0, (0, 0, -0.2))
    return _outcome(read("chung_ooi_2"), on_plane(ball, law, rows=200))


STATED = (0.2, 0.4, 0.6, 0.8, 1.0)


@case("chung_ooi_3")
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
        what = f"largest error of the restitution, {name}"
        error = np.abs(np.array(back) - STATED).max()
        findings += within(1e-6, (name.replace(" ", "_"), what, error))
        ours.append((f"ours, {name}", STATED, back))
    panel = Panel("restitution stated", "speed back over speed", [("stated", STATED, STATED)], ours)
    return Outcome(findings, [panel])
