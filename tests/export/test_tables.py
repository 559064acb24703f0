"""Tables of a run: every number is read back exactly, columns have their units."""

import sys

import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest

from sphshell_pin.base.tables import column, csv_text, quantity_of
from sphshell_pin.dynamics.result.result_columns import coordinates
from sphshell_pin.errors import MissingExtra, ResultError
from sphshell_pin.export.tables import tables_of, write_tables
from tests.tables import cases_of


def read(folder, format):
    exact = {"float_precision": "round_trip", "keep_default_na": False, "na_values": [""]}
    one, options = (pd.read_parquet, {}) if format == "parquet" else (pd.read_csv, exact)
    return {path.stem: one(path, **options) for path in folder.iterdir()}


@pytest.mark.parametrize("format", ["csv", "parquet"])
@pytest.mark.parametrize("run", ["finger", "table"])
def test_every_number_is_read_back_exactly(run, format, request, tmp_path):
    result = request.getfixturevalue(run)
    paths = write_tables(tmp_path / "out", result, format=format)
    found = read(tmp_path / "out", format)
    kinds = ["rows", "contacts", "events", "energy"] + ["sensors"] * bool(result.sensors)
    assert [path.stem for path in paths] == kinds
    for kind, wanted in tables_of(result).items():
        assert list(found[kind].columns) == list(wanted)
        for name, values in wanted.items():
            np.testing.assert_array_equal(found[kind][name], values, err_msg=name)


def test_the_columns_of_the_rows_are_those_of_the_result(finger):
    rows = finger.row_columns()
    assert list(rows)[:4] == ["t [s]", *(f"q.{n} [rad]" for n in finger.scene.model.names[1:])]
    for index in range(3):
        np.testing.assert_array_equal(list(rows.values())[1 + index], finger.q[:, index])
        np.testing.assert_array_equal(list(rows.values())[4 + index], finger.v[:, index])
    log = finger.contacts
    one = log.row[np.bincount(log.row)[log.row] == 1]  # rows with a single contact
    assert len(one)
    at = np.searchsorted(log.row, one)
    force = np.column_stack([rows[f"pairs.tip-wall.force_{axis} [N]"] for axis in "xyz"])
    np.testing.assert_array_equal(force[one], log.force_world[at])
    for name, wanted in (("normal_force [N]", log.normal_force), ("depth [m]", log.depth)):
        np.testing.assert_array_equal(rows[f"pairs.tip-wall.{name}"][one], wanted[at])
    free = np.setdiff1d(np.arange(len(finger.t)), log.row)
    assert not rows["pairs.tip-wall.depth [m]"][free].any()
    assert not rows["pairs.never-there.normal_force [N]"].any()


def test_joints_with_several_numbers_have_numbered_columns(table):
    in_q, in_v = coordinates(table.scene.model)
    assert in_q[:4] == ["q.axle.0 [1]", "q.axle.1 [1]", "q.ball_moves.0 [m]", "q.ball_moves.1 [m]"]
    assert in_q[-1] == "q.ball_moves.6 [1]"
    assert in_v[:2] == ["v.axle [rad/s]", "v.ball_moves.0 [m/s]"]
    assert in_v[-1] == "v.ball_moves.5 [rad/s]"
    assert list(table.row_columns())[1 : 1 + len(in_q) + len(in_v)] == [*in_q, *in_v]


def test_every_kind_of_joint_has_columns():
    import pinocchio as pin

    model, parent = pin.Model(), 0
    kinds = [getattr(pin, name) for name in dir(pin) if name.startswith("JointModel")]
    skipped = ("JointModel", "JointModelComposite", "JointModelMimic")
    for kind in kinds:
        if kind.__name__ not in skipped:
            parent = model.addJoint(parent, kind(), pin.SE3.Identity(), kind.__name__)
    in_q, in_v = coordinates(model)
    assert (len(in_q), len(in_v)) == (model.nq, model.nv)
    assert len({*in_q, *in_v}) == model.nq + model.nv
    found = {}
    for name, unit in map(quantity_of, (*in_q, *in_v)):
        letter, joint = name.split(".")[:2]
        found.setdefault((letter, joint.removeprefix("JointModel")), []).append(unit)
    for kind, (q, v) in cases_of("joint_units")["units"].items():
        assert (found["q", kind], found["v", kind]) == (q.split(), v.split())


def test_names_of_columns_and_text():
    assert quantity_of(column("depth", "m")) == ("depth", "m")
    assert quantity_of(column("a [b]", "N m")) == ("a [b]", "N m")
    assert quantity_of(column("closed")) == ("closed", "")
    text = csv_text({"x [m]": [0.1, np.nan], "n": [1, 2], "name": ["a,b", 'c"d']})
    assert text.splitlines() == ["x [m],n,name", '0.1,1,"a,b"', ',2,"c""d"']
    # No spreadsheet evaluates a name; numbers stay numbers.
    names = ["@a", "+b", "-c", "\td", "\uff1df"]
    text = csv_text({"=1+1": [*names, "e=1"], "x": [-1.0] * 6})
    first = [line.split(",")[0] for line in text.split("\r\n")][:-1]
    assert first == ["'=1+1", *(f"'{name}" for name in names), "e=1"]
    assert text.count(",-1.0") == 6


def test_a_parquet_file_says_where_it_comes_from(finger, tmp_path):
    write_tables(tmp_path / "out", finger, format="parquet")
    schema = pyarrow.parquet.read_schema(tmp_path / "out" / "rows.parquet")
    assert schema.metadata[b"scenario"] == b""


def test_tables_of_an_earlier_call_go_and_other_files_stay(finger, table, tmp_path):
    out = tmp_path / "out"
    write_tables(out, finger)
    (out / "mine.txt").write_text("mine")
    write_tables(out, table)
    names = {one.name for one in out.iterdir()}
    assert names == {"rows.csv", "contacts.csv", "events.csv", "energy.csv", "mine.txt"}


def test_a_folder_that_cannot_be_written_is_reported(finger, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultError, match="cannot be written"):
        write_tables(tmp_path / "file" / "out", finger)


def test_without_pyarrow_the_extra_is_named(finger, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtra, match="pyarrow"):
        write_tables(tmp_path / "out", finger, format="parquet")
    assert not (tmp_path / "out").exists()
