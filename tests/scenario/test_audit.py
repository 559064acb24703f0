"""Contacts of a run beside the exact CAD faces: against formulas, on edges, in the files."""

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("OCP")

from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario import build, run_built
from sphshell_pin.scenario.running.cad_audit import _counts, audit_cad
from sphshell_pin.shell.cad import CadOptions, require_kernel
from tests.command import call, succeed
from tests.scenario.files import DROP, write
from tests.shell import cad_shapes as shapes

pytestmark = pytest.mark.usefixtures("no_pictures")

RADIUS = 0.012
PRIMITIVE = (
    'primitive = { type = "box", size = [0.2, 0.2, 0.02] }\nplacement = { xyz = [0, 0, -0.01] }'
)

# Where the ball starts [m], and the placement of the shell: the ball falls on it from above.
MADE = {
    "ball": (shapes.ball, [0.001, 0.0005, 0.0243], ""),
    "ring": (shapes.ring, [0.0085, 0.001, 0.0153], ""),
    "moved ball": (
        shapes.ball,
        [0.031, 0.0205, 0.0343],
        "placement = { xyz = [0.03, 0.02, 0.01], rpy_deg = [10, 20, 30] }",
    ),
    "larger ring": (shapes.ring, [0.017, 0.002, 0.0184], "magnify = 2.0"),
}


def scenario(folder, shape, start, more="", chord_error=2e-4):
    """Write a scenario in which a ball of RADIUS falls on a shape of a STEP file."""
    shapes.write_step(folder / "part.step", ("part", shape))
    text = DROP.replace(PRIMITIVE, f'file = "part.step"\nchord_error = {chord_error}\n{more}')
    assert text != DROP
    place = ", ".join(map(str, start))
    return write(folder, text.replace("0.01, 0.02, 0.0125", place))


def exact(name, log):
    """Depths (m,) and normals (m, 3) of the formulas, for the centres of the balls in a log."""
    center = log.point_world + (RADIUS - log.depth)[:, None] * log.normal_world
    size = 2.0 if name.startswith("larger") else 1.0
    if name == "moved ball":
        center = center - [0.03, 0.02, 0.01]
    if "ball" in name:
        way, reach = center, 1e-3 * shapes.BALL
    else:
        out = center * [1, 1, 0]
        out *= 1e-3 * size * shapes.RING / np.linalg.norm(out, axis=1, keepdims=True)
        way, reach = center - out, 1e-3 * size * shapes.TUBE
    length = np.linalg.norm(way, axis=1)
    return RADIUS - (length - reach), way / length[:, None]


@pytest.mark.parametrize("name", MADE)
def test_audit_agrees_with_formulas(name, tmp_path):
    make, start, more = MADE[name]
    built = build(scenario(tmp_path, make(), start, more))
    report = run_built(built, tmp_path / "out", recording=False, audit_cad=True)
    log, audit = report.result.contacts, report.audit
    assert len(log.depth) > 50
    depth, normal = exact(name, log)
    size = built.shells["plate"].size
    assert audit.depth_error == pytest.approx(log.depth - depth, rel=0, abs=1e-9 * size)
    angle = np.arccos(np.clip(np.einsum("ij,ij->i", normal, log.normal_world), -1.0, 1.0))
    # The cosine's own round-off is 1e-8.
    assert audit.normal_error == pytest.approx(angle, rel=0, abs=1e-7)
    (pair,) = audit.pairs
    assert (pair.contacts, pair.unmatched) == (len(log.depth), 0)
    assert pair.depth[0] == np.abs(audit.depth_error).max()
    assert pair.depth[1] <= pair.depth[0]
    # The faces are closed forms; the flat elements below show that the audit finds what is off.
    assert pair.depth[0] < 1e-12 * size
    assert pair.normal[0] < 1e-7


@pytest.mark.parametrize(
    ("center", "contact", "foot"),
    [
        ((5.0, 7.0, 12.0), (5.02, 7.01, 10.0), (5.0, 7.0, 10.0)),  # over a face
        ((-1.0, 7.0, 12.0), (0.0, 7.01, 10.0), (0.0, 7.0, 10.0)),  # over an edge
        ((-1.0, -2.0, 12.0), (0.0, 0.0, 10.0), (0.0, 0.0, 10.0)),  # over a corner
        ((0.001, 7.0, 12.0), (0.0, 7.0, 10.0), (0.001, 7.0, 10.0)),  # over a face, beside an edge
        ((5.0, 7.0, 8.0), (5.0, 7.0, 10.0), (5.0, 7.0, 10.0)),  # inside
    ],
)
def test_trimmed_faces_edges_and_corners_are_found(center, contact, foot, tmp_path):
    require_kernel("this test")
    from sphshell_pin.shell.cad.exact import TrimmedFaces
    from sphshell_pin.shell.cad.surface import load_cad

    path = shapes.write_brep(tmp_path / "box.brep", shapes.box())
    faces = TrimmedFaces(load_cad(path, "mm", CadOptions()))
    found = faces.stationary_point(np.array(center), np.array(contact))
    assert found.point == pytest.approx(foot, abs=1e-12)
    assert faces.stationary_point(np.array(center), np.array([50.0, 50.0, 50.0])) is None


def test_files_and_table_have_the_audit(tmp_path):
    path = scenario(tmp_path, shapes.ball(), [0.001, 0.0005, 0.0243])
    out = tmp_path / "out"
    told = succeed("run", path, "--out", out, "--no-recording", "--audit-cad")
    assert "exact CAD faces" in told.output
    figures = json.loads((out / "summary.json").read_text())["cad_audit"]["ball-plate"]
    with (out / "contacts.csv").open() as file:
        rows = list(csv.DictReader(file))
    depth, normal = (
        np.array([float(row[name]) for row in rows])
        for name in ("cad_depth_error [m]", "cad_normal_error [rad]")
    )
    assert figures["contacts"] == len(rows)
    assert figures["unmatched"] == 0
    assert figures["depth_error"]["largest"] == np.abs(depth).max()
    assert figures["normal_error"]["rms"] == pytest.approx(np.sqrt(np.mean(normal**2)))


def test_a_scenario_without_cad_is_refused_before_it_runs(tmp_path):
    out = tmp_path / "out"
    told = call("run", str(write(tmp_path)), "--out", out, "--audit-cad")
    assert told.exit_code == 2
    (line,) = told.stderr.strip().splitlines()
    assert "no contact with a CAD surface" in line
    assert ".step" in line
    assert not out.exists()
    built = build(write(tmp_path))
    with pytest.raises(SphshellError, match="CAD surface"):
        audit_cad(built, None)


def test_what_counts():
    """Saddles, what they cancel, and rings are not judged; the deepest of a pair always is."""
    depths = np.array([3e-4, 2e-4, 1.999e-4, 2e-4, 2e-4, 1e-4, 1e-4])
    log = SimpleNamespace(
        row=np.array([0, 0, 0, 0, 1, 1, 2]),
        pair=np.array([0, 0, 0, 1, 0, 0, 0]),
        depth=depths,
        normal_force=np.array([3.0, 2.0, -2.0, 2.0, 2.0, -1.0, 1.0]),
        normal_world=np.tile([0.0, 0.0, 1.0], (7, 1)),
        feature=np.array([0, 0, 1, 0, 0, 1, 3]),
    )
    assert _counts(log).tolist() == [True, False, False, True, True, False, False]
