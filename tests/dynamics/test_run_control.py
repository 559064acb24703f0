"""How runs start, stop, repeat and are kept: controllers, faults, files, locked joints."""

import os
import re
import signal
import sys
import threading
import warnings
from contextlib import suppress
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import errors
from sphshell_pin.dynamics.result.result_parts import Event, Kept, Origin
from sphshell_pin.dynamics.run import advance
from tests import models
from tests.results import assert_same_bits
from tests.texts import DATA

RADIUS = 0.05
START = models.free_q([0.1, -0.05, RADIUS + 0.01]), np.array([1.0, 0.3, -0.2, 10.0, -20.0, 5.0])


def bouncing(integrator=None) -> sp.Simulation:
    scene = models.on_plate(models.ball(), models.LAW, models.FRICTION)
    return sp.Simulation(scene, integrator or sp.SemiImplicitEuler(dt=1e-4))


def test_a_diverging_run_keeps_what_it_computed() -> None:
    """Explicit damping with dt kd / m = 1e4 multiplies the speed at every step."""
    sim = sp.Simulation(sp.Scene(models.slider()), sp.SemiImplicitEuler(dt=1e-2))
    with pytest.raises(errors.SimulationDiverged, match="dt") as caught:
        sim.run([0.5], [0.1], 100.0, sp.JointPD(kp=0.0, kd=1e6, q_ref=[0.5]))
    result = caught.value.result
    assert 0.0 < caught.value.t < 100.0
    assert len(result.t) == len(result.q) == len(result.v) >= 1
    assert result.t[-1] <= caught.value.t
    for rows in (result.t, result.q, result.v):
        assert np.isfinite(rows).all()


@pytest.mark.usefixtures("keyboard")
@pytest.mark.parametrize(
    "options",
    [{}, {"controller": lambda t, q, v, c: 0 * v, "control_dt": 1e-3}],
    ids=["plain", "python controller"],
)
def test_ctrl_c(options) -> None:
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(errors.Interrupted) as caught:
            bouncing().run(*START, 1e5, record_dt=1e-2, **options)
    finally:
        timer.cancel()
    t = caught.value.result.t
    assert len(t) > 1
    assert caught.value.t >= t[-1] > 0


def test_a_joint_that_is_not_of_unit_length_is_named() -> None:
    mixed = pin.JointModelComposite(pin.JointModelPX())
    mixed.addJoint(pin.JointModelRUBZ(), pin.SE3.Identity())
    parts = {
        "flyer": (pin.JointModelFreeFlyer(), slice(3, 7)),
        "sled": (pin.JointModelPlanar(), slice(2, 4)),
        "mixed": (mixed, slice(1, 3)),
        "wheel": (pin.JointModelRUBX(), slice(0, 2)),
        "socket": (pin.JointModelSpherical(), slice(0, 4)),
    }
    model, parent = models.empty(), 0
    for name, (joint, _) in parts.items():
        parent = models.add_body(model, name, joint, parent)
    for (name, (_, part)), scale in product(parts.items(), (0.0, 0.9, 2.0)):
        q, first = pin.neutral(model), model.joints[model.getJointId(f"{name}_joint")].idx_q
        q[first + part.start : first + part.stop] *= scale
        with pytest.raises(errors.InvalidParameter, match=f"'{name}_joint'.*unit") as caught:
            sp.Scene(model).check_state(q)
        assert np.linalg.norm(caught.value.value) == pytest.approx(scale)
        assert len(caught.value.value) == part.stop - part.start


def test_deep_start() -> None:
    with pytest.raises(errors.DeepStart) as caught:
        bouncing().run(models.free_q([0, 0, 0.4 * RADIUS]), np.zeros(6), 0.1)
    assert caught.value.pair == "ball-plate"
    assert caught.value.depth == pytest.approx(0.6 * RADIUS)
    assert caught.value.radius == RADIUS


def test_a_python_controller_sees_contacts() -> None:
    seen = []

    def controller(t, q, v, contacts):
        seen.append(float(contacts.normal_force.sum()))
        return np.zeros(1)

    scene = models.on_plate(models.slider(), models.linear_law(4000.0))
    rest = np.array([RADIUS - 9.81 / 4000.0])
    sim = sp.Simulation(scene, sp.SemiImplicitEuler(dt=1e-3))
    sim.run(rest, np.zeros(1), 0.01, controller, control_dt=2e-3)
    assert seen == pytest.approx([9.81] * 5, rel=1e-9)


def test_an_error_in_a_controller_comes_through() -> None:
    def controller(t, q, v, contacts):
        raise LookupError("no torque today")

    with pytest.raises(LookupError, match="no torque today") as caught:
        bouncing().run(*START, 0.1, controller, control_dt=1e-2)
    (note,) = caught.value.__notes__
    assert "raised by the controller at t = 0 s (test_run_control.py:controller, line " in note


def test_rows_of_a_result() -> None:
    result = bouncing().run(*START, 0.3, record_dt=1e-3)
    assert (result.t[0], result.t[-1]) == pytest.approx((0.0, 0.3), abs=1e-12)
    assert np.array_equal(result.q[0], START[0])
    assert np.array_equal(result.v[0], START[1])
    log, stats = result.contacts, result.stats.pairs["ball-plate"]
    assert np.array_equal(log.t, result.t[log.row])
    kinds = [e.kind for e in result.events]
    assert kinds[:2] == ["touch", "lift_off"]
    drop = ((0.2**2 + 2 * 9.81 * 0.01) ** 0.5 - 0.2) / 9.81
    assert result.events[0].t == pytest.approx(drop, abs=2e-4)
    assert stats.touches == kinds.count("touch")
    assert stats.max_depth >= log.depth.max() - 1e-12
    assert stats.peak_force >= log.normal_force.max() - 1e-9
    assert 0 < stats.mean_force < stats.peak_force
    assert 0 < stats.contact_time < 0.3


def test_a_table_without_pandas_names_the_extra_that_brings_it(monkeypatch) -> None:
    result = bouncing().run(*START, 0.01)
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(errors.MissingExtra, match=r"sphshell-pin\[tables\]"):
        result.to_dataframe()


def test_save_and_load(tmp_path: Path) -> None:
    result = bouncing().run(*START, 0.1)
    loaded = sp.Result.load(result.save(tmp_path / "run.npz"))
    assert_same_bits(result, loaded)
    assert loaded.scene is None
    assert loaded.stats == result.stats
    (tmp_path / "text.npz").write_text("not an archive")
    for wrong in ("nothing.npz", "text.npz"):
        with pytest.raises(errors.ResultError):
            sp.Result.load(tmp_path / wrong)


def imaginary() -> Kept:
    return Kept({}, {"a": np.ones(1, "c16")})


def _with(result: sp.Result, part: str, **values: object) -> sp.Result:
    return replace(result, **{part: replace(getattr(result, part), **values)})


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda r: replace(r, q=r.q.astype("f4")), "'q' holds float32, not float64"),
        (lambda r: replace(r, q=r.q[1:]), r"'q' has the shape .* with n = "),
        (lambda r: replace(r, t=r.t[::-1].copy()), "'t' does not rise at row 0"),
        (lambda r: replace(r, q=np.ma.masked_less(r.q, 0.0)), "'q' is a masked array"),
        (lambda r: replace(r, pairs=("a", "a")), "header.pairs does not list each pair once"),
        (lambda r: replace(r, events=(Event("0", r.pairs[0], "stick"),)), "header.events"),
        (lambda r: replace(r, torque=r.v[1:]), "'torque' has the shape"),
        (lambda r: _with(r, "contacts", row=r.contacts.row + 10**6), "'contacts.row'.* is 1000"),
        (lambda r: _with(r, "stats", steps=0.5), "header.stats.steps"),
        (lambda r: _with(r, "stats", wall_time=1j), "complex is not JSON"),
        (lambda r: replace(r, origin=Origin("s", {}, imaginary)), "'kept.a' holds complex128"),
    ],
)
def test_what_load_would_refuse_is_not_written(tmp_path: Path, change, said: str) -> None:
    path = tmp_path / "run.npz"
    with pytest.raises(errors.ResultError, match=rf"run\.npz: cannot write the results: .*{said}"):
        change(bouncing().run(*START, 0.1)).save(path)
    assert not path.exists()


def test_a_file_of_version_0_1_is_read() -> None:
    """It calls the ids of contacts numbers."""
    result = sp.Result.load(DATA / "run_of_version_0_1.npz")
    stats, log = result.stats, result.contacts
    assert (len(result.t), stats.steps, stats.integrator) == (11, 200, "SemiImplicitEuler")
    assert stats.pairs["ball-plate"].peak_force >= log.normal_force.max() > 0
    assert set(log.contact_id) == {0}


def test_lock_equals_the_model_reduced_by_hand() -> None:
    model, q_lock = models.arm(), np.array([0.0, 1.9, 0.0])
    reduced = pin.buildReducedModel(model, [model.getJointId("two_joint")], q_lock)
    by_hand = models.on_plate(reduced, models.LAW, models.FRICTION)
    scene = sp.Scene(model, lock=["two_joint"], q_lock=q_lock)
    more = {"friction": models.FRICTION, "method": "facets", "name": "ball-plate"}
    scene.add_contact(sp.Sphere(RADIUS, "ball"), models.plate(), law=models.LAW, **more)
    start = [0.3, 0.5], [1.0, 0.0]
    a, b = (models.run(one, sp.RungeKutta4(1e-3), *start, 0.4) for one in (by_hand, scene))
    assert len(a.contacts.depth) > 0
    assert_same_bits(a, b)


def test_what_is_kept_of_a_pair_goes_with_it() -> None:
    law = sp.HuntCrossleyLaw(1e6, 1.5, 0.5)
    scene = models.on_shell(models.ball(), models.plate(), law, radius=0.006, name="c")
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
        (sp.Adaptive(), 1e-6, "1.5e+07 rows"),
        (sp.SemiImplicitEuler(1e-5), 1e-3, ""),
        (sp.Adaptive(), None, ""),
    ],
)
def test_more_than_a_million_rows_are_announced(integrator, record_dt, rows) -> None:
    def stop(_: float) -> None:
        raise _Enough

    simulation, q = sp.Simulation(sp.Scene(models.ball()), integrator), models.free_q([0, 0, 1])
    with warnings.catch_warnings(record=True) as caught, suppress(_Enough):
        warnings.simplefilter("always")
        simulation.run(q, duration=15.0, record_dt=record_dt, progress=stop)
    told = [str(one.message) for one in caught if "rows" in str(one.message)]
    assert len(told) == bool(rows)
    if told:
        assert rows in told[0]
        assert re.search(r"record_dt = 0.00[12] s", told[0])
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
