"""What a run needs to know of its pairs at its start: found at once, the bits of each alone."""

import warnings
from contextlib import suppress
from dataclasses import astuple

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.dynamics.run import advance
from sphshell_pin.dynamics.scene.explain import explain_pairs
from tests import models

LAW = sp.HuntCrossleyLaw(1e6, 1.5, 0.5)


def of_all_kinds() -> tuple[sp.Scene, np.ndarray]:
    """Return a scene of an arm with pairs of every kind, and a state of the arm (nq,)."""
    arm = robots.load("panda")
    scene = sp.Scene(arm.model)
    plate = models.plate()
    frames = ("panda_link3", "panda_link5", "panda_link7", "panda_hand")
    where = pin.SE3(np.eye(3), np.array([0.4, 0.1, 0.2]))
    for k, frame in enumerate(frames):
        for method in ("smooth", "facets"):
            ball = sp.Sphere(0.02, frame, (0.03 * k, 0.01, 0.0))
            scene.add_contact(
                ball, plate, placement=where, law=LAW, method=method, name=f"{method}-{k}",
                friction=sp.BristleFriction(0.6, 0.5, 1e5, 30.0) if k % 2 else None,
            )  # fmt: skip
    scene.add_contact(sp.Sphere(0.02, frames[0]), plate, frame=frames[2], law=LAW, name="moving")
    scene.add_contact(sp.Sphere(0.02, frames[3]), sp.Sphere(0.03, frames[1]), law=LAW, name="two")
    scene.add_contact(sp.Plane("universe"), plate, frame=frames[3], law=LAW, name="plane")
    scene.add_contact_source(nowhere, frames[0], frames[1], law=LAW, name="own")
    return scene, np.asarray(arm.q0)


def nowhere(pose_i: pin.SE3, pose_j: pin.SE3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)


def test_the_figures_of_pairs_do_not_depend_on_the_other_pairs() -> None:
    scene, q = of_all_kinds()
    rng = np.random.default_rng(1)
    for _ in range(5):
        state = scene.check_state(q + rng.normal(scale=0.2, size=q.size), rng.normal(size=q.size))
        together = explain_pairs(scene, *state)
        for pair, figures in zip(scene.pairs, together, strict=True):
            (alone,) = explain_pairs(scene.with_pairs((pair,)), *state)
            np.testing.assert_equal(astuple(figures), astuple(alone))


def test_what_is_kept_of_a_pair_goes_with_it() -> None:
    scene = sp.Scene(models.ball())
    scene.add_contact(sp.Sphere(0.006, "ball"), models.plate(), law=LAW, name="c")
    q = models.free_q([0.0, 0.0, 0.006])
    before = scene.explain(q).pairs[0]
    scene.replace_pair("c", law=sp.HuntCrossleyLaw(1e8, 1.5, 0.5))
    after = scene.explain(q).pairs[0]
    assert after.modelled != before.modelled
    assert after.contact_time < before.contact_time


class _Enough(Exception):
    """Ends a run at its first glance."""


@pytest.mark.parametrize(
    ("integrator", "record_dt", "rows"),
    [
        (sp.SemiImplicitEuler(1e-5), None, "1.5e+06 rows"),
        (sp.SemiImplicitEuler(1e-5), 1e-7, "1.5e+06 rows"),
        (sp.Adaptive(), 1e-6, "1.5e+07 rows"),
        (sp.SemiImplicitEuler(1e-5), 1e-3, ""),
        (sp.SemiImplicitEuler(2e-5), None, ""),
        (sp.Adaptive(), None, ""),
    ],
)
def test_more_than_a_million_rows_are_announced(integrator, record_dt, rows) -> None:
    scene = sp.Scene(models.ball())
    simulation = sp.Simulation(scene, integrator)

    def stop(_: float) -> None:
        raise _Enough

    with warnings.catch_warnings(record=True) as caught, suppress(_Enough):
        warnings.simplefilter("always")
        simulation.run(scene.neutral, duration=15.0, record_dt=record_dt, progress=stop)
    told = [str(one.message) for one in caught if "rows" in str(one.message)]
    assert len(told) == bool(rows)
    if told:
        assert rows in told[0]
        assert "record_dt = 0.002 s" in told[0] or "record_dt = 0.001 s" in told[0]
        assert caught[0].filename == __file__


@pytest.mark.parametrize("limit", ["_MANY_ROWS", "_MANY_BYTES"])
def test_rows_of_error_control_are_announced_once_seen(limit: str, monkeypatch) -> None:
    monkeypatch.setattr(advance, limit, 5)
    scene = sp.Scene(models.ball())
    with pytest.warns(sp.errors.SetupWarning, match=r"rows by t = .*record_dt = 0.001 s") as caught:
        sp.Simulation(scene, sp.Adaptive(1e-8)).run(scene.neutral, duration=10.0)
    assert [one.filename for one in caught] == [__file__]


def test_a_run_whose_rows_fill_the_memory_ends_with_its_result(monkeypatch) -> None:
    sizes = iter((0.0, 0.0, 1e18))
    monkeypatch.setattr(advance, "_peak_memory", lambda: next(sizes))
    scene = sp.Scene(models.ball())
    with pytest.raises(sp.errors.RowsFillMemory, match=r"rows fill 1e\+09 GB") as caught:
        sp.Simulation(scene, sp.SemiImplicitEuler(1e-5)).run(scene.neutral, duration=60.0)
    assert 0 < caught.value.result.t[-1] == caught.value.t < 60
