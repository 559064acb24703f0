"""The report: what it says of measured data, and what it leaves when something goes wrong."""

import csv
import json
import os
import re
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from sphshell_pin import Shell
from sphshell_pin.errors import Interrupted
from sphshell_pin.study.report import PAGE, closed_forms, convergence, making, steps, surfaces
from sphshell_pin.study.report import integrators as work
from sphshell_pin.study.report import queries as query_section
from sphshell_pin.study.report.contents import Column, Finding, Section, Table
from sphshell_pin.study.report.machine import BUSY
from tests.command import call

KEYS = ["forces", "queries", "integrators", "steps"]
RNG = np.random.default_rng(4)


def times(seconds: float) -> np.ndarray:
    return seconds * RNG.uniform(0.9, 1.1, 5)


@cache
def force_rows() -> list[convergence.Row]:
    return [
        row for name in surfaces.SURFACES for row in convergence.measure(name, rounds=2, finest=2)
    ]


def forces(*, quick, progress):
    rows = force_rows()
    progress(1.0)
    return convergence.assemble(rows)


def queries(*, quick, progress):
    costs = (("smooth", 1e-6), ("facets", 9e-7), ("coal::collide", 4e-5))
    found = {(name, 199_712): times(seconds) for name, seconds in costs}
    return query_section.assemble(found | {("smooth", 2048): times(1e-6)})


def integrators(*, quick, progress):
    case = replace(closed_forms.bounces(), dts=(1e-3, 2e-4), implicit_dts=(), finest=5)
    return work.assemble(work.measure(case, quick=True), SimpleNamespace(rms=1e-8, energy=2e-6))


def panda(*, quick, progress):
    names = steps.BARE, steps.FREE, steps.FAR, steps.TOUCHING, steps.CONTROL_FREE
    whole = {name: times(2e-6 + 2e-7 * k) for k, name in enumerate(names)}
    whole[steps.CONTROL_TOUCHING] = times(3.5e-6)
    return steps.assemble(whole)


def parts_of(*measures) -> tuple[making.Part, ...]:
    return tuple(
        making.Part(known.key, known.title, measure, (1.0, 1.0))
        for known, measure in zip(making.PARTS, measures, strict=True)
    )


@pytest.fixture
def small(monkeypatch):
    """All sections on little data."""
    monkeypatch.setattr(making, "PARTS", parts_of(forces, queries, integrators, panda))


def stub(*, quick, progress):
    return Section("x", "X", findings=[Finding("a", "a | b", 1.0, aim=2.0)])


@pytest.fixture
def stubs(monkeypatch):
    """Sections of nothing but one finding, and a way to put other measures in their places."""

    def put(**others) -> None:
        measures = dict.fromkeys(KEYS, stub) | others
        monkeypatch.setattr(making, "PARTS", parts_of(*measures.values()))

    put()
    return put


def table_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_whole_report(small, tmp_path):
    heard = []
    more = {"command": "sphshell-pin report <x>", "tell": lambda _, share: heard.append(share)}
    report = making.make_report(tmp_path, quick=True, **more)
    assert [s.error for s in report.sections] == [None] * 4
    assert heard == sorted(heard)
    assert 0 <= heard[0] <= heard[-1] <= 1 + 1e-12
    text = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert all(f"## {one.title}\n" in text for one in report.sections)
    # What it names stands beside it.
    for name in re.findall(r"\]\((.*?)\)", text):
        assert (tmp_path / name).exists()
    assert "sphshell-pin report <x>" in text
    judged = [f.met for s in report.sections for f in s.findings if f.met is not None]
    assert f"{sum(judged)} of {len(judged)} aims are met." in text
    assert sorted(f.name for f in tmp_path.iterdir() if f.name.startswith(".")) == []
    found = table_of(tmp_path / "forces_orders.csv")
    assert {(row["surface"], row["method"]) for row in found} == {
        (name, rule) for name in surfaces.SURFACES for rule in convergence.RULES
    }
    data = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    verdicts = {one["key"]: one["met"] for s in data["sections"] for one in s["findings"]}
    assert verdicts["swing_energy"] is False
    assert {"processor", "cores", "system", "packages", "date", "command"} <= set(data["machine"])
    assert set(data["files"]) == {f.name for f in tmp_path.glob("*.csv")}


def test_spheres_touch_its_surfaces_as_deep_as_it_says() -> None:
    sheet = Shell(*surfaces.wavy_sheet(200, 1.0))
    centers = surfaces.touching_centers(200, 1.0, 0.02, 1e-3)
    depths, _ = sheet.contacts_batch(centers, np.full(200, 0.02))
    np.testing.assert_allclose(depths, 1e-3, rtol=0, atol=2e-5)
    vertices = surfaces.plate(0.01, 0.06).vertices
    np.testing.assert_allclose(np.abs(vertices).max(axis=0), [0.06, 0.06, 0.0], atol=1e-15)


def test_order_and_error_of_a_power_law():
    sides = (1.2, 0.61, 0.29, 0.16)
    line = [SimpleNamespace(side=h, mean=0.7 * h**4, largest=3 * h**4) for h in sides]
    assert convergence.order(line) == pytest.approx(4.0)
    assert convergence.error_at(line) == pytest.approx(0.7 * 0.3**4)
    assert convergence.error_at(line, "largest") == pytest.approx(3 * 0.3**4)


def test_measuring_queries_says_how_far_it_is():
    heard = []
    times = query_section.measure((4, 8), 1, heard.append)
    assert {triangles for _, triangles in times} == {32, 128}
    assert heard[:2] == [0.25, 0.5]
    assert heard == sorted(heard)
    assert heard[-1] == 1.0


def test_findings_on_forces_are_those_of_the_worst_surface():
    rows = force_rows()
    found = {one.key: one.value for one in convergence.assemble(rows).findings}
    lines = [convergence.of(rows, name, convergence.SMOOTH) for name in convergence.CURVED]
    assert found["force_error"] == max(map(convergence.error_at, lines))
    largest = max(convergence.error_at(line, "largest") for line in lines)
    assert found["force_error_largest"] == largest
    assert found["force_order"] == min(map(convergence.order, lines))


def broken(*, quick, progress):
    raise ValueError("a <b> broke")


def test_a_broken_section_does_not_lose_the_others(stubs, tmp_path):
    stubs(queries=broken)
    ran = call("report", "--out", tmp_path)
    assert ran.exit_code == 1
    assert "not measured: Time of a query: ValueError: a <b> broke" in ran.stderr
    text = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert "could not be measured: ValueError: a <b> broke" in text
    assert "3 of 3 aims are met. 1 section could not be measured." in text


@pytest.mark.parametrize("load", [0.0, BUSY, 1.5])
def test_a_busy_machine_is_said_on_the_page(stubs, tmp_path, monkeypatch, load):
    monkeypatch.setattr(os, "getloadavg", lambda: (load, 0.0, 0.0))
    ran = call("report", "--out", tmp_path)
    busy = load > BUSY
    page = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert ("The machine was busy" in page) == busy
    assert ("The machine was busy" in ran.stderr) == busy
    if busy:
        assert f"its load was {load:.2f}" in page
    data = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert bool(data["caution"]) == busy


@pytest.mark.parametrize("kind", [KeyboardInterrupt(), Interrupted(0.1, None)])
def test_an_interrupted_run_leaves_the_old_page(stubs, tmp_path, kind):
    making.make_report(tmp_path)
    before = {f.name: f.read_bytes() for f in tmp_path.iterdir()}

    def interrupted(*, quick, progress):
        raise kind

    stubs(steps=interrupted)
    ran = call("report", "--out", tmp_path)
    assert ran.exit_code == 130
    assert {f.name: f.read_bytes() for f in tmp_path.iterdir()} == before


def test_tables_of_an_old_report_go(stubs, tmp_path):
    def with_table(*, quick, progress):
        return Section("x", "X", tables=[Table("old", "", (Column("a", "a"),), [(1.0,)])])

    (tmp_path / "mine.csv").write_text("keep me")
    stubs(steps=with_table)
    making.make_report(tmp_path)
    assert (tmp_path / "old.csv").read_text() == "a\n1.0\n"
    stubs()
    making.make_report(tmp_path)
    assert not (tmp_path / "old.csv").exists()
    assert (tmp_path / "mine.csv").read_text() == "keep me"
