"""Where exact faces meet: of two tangent faces one has the contact, whatever the facets are."""

import re
from pathlib import Path

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.shell.curvature import curved_mesh
from sphshell_pin.shell.raw import random_places
from tests.contact.test_faces import VALVE_BODY
from tests.joints.boxes import BOXES
from tests.joints.solids import write_step
from tests.parts import occ

MM = 1e-3


def test_no_sphere_is_lost_beside_the_rounded_rim_of_the_valve_body():
    shell, center = sp.Shell.from_file(VALVE_BODY), [0.040307777, 0.003406919, -0.005294333]
    around = center + np.random.default_rng(0).uniform(-1e-4, 1e-4, (500, 3))
    deepest, counts = shell.contacts_batch(around, np.full(500, 6e-3))
    assert (counts == 1).all()
    flat, _ = shell.contacts_batch(around, np.full(500, 6e-3), method="facets")
    assert np.abs(deepest - flat).max() <= 1e-3 * 6e-3


def read(solid, folder: Path, digits: int | None = None, **more) -> sp.Shell:
    """The shell of a STEP file, the coordinates of its vertices rounded to some digits [mm]."""
    path = write_step(solid, folder / "part.step")
    text = path.read_text()
    for point in re.findall(r"VERTEX_POINT\('',#(\d+)\)", text) if digits else ():
        old = re.search(rf"#{point} = CARTESIAN_POINT\('',\((.*?)\)\s*\)", text, re.DOTALL)
        numbers = [round(float(x), digits) for x in old[1].split(",")]
        new = f"#{point} = CARTESIAN_POINT('',({','.join(map(str, numbers))}))"
        text = text.replace(old[0], new)
    path.write_text(text)
    return sp.Shell.from_file(path, **more)


def tee():
    """Two pipes that cross [mm]."""
    outside = occ.fuse(occ.cylinder(12.3, 80.0, [-40, 0, 0], [1, 0, 0]), occ.cylinder(9.9, 40.0))
    inside = (occ.cylinder(9.781, 82.0, [-41, 0, 0], [1, 0, 0]), occ.cylinder(7.0, 41.0))
    return occ.placed(occ.cut(outside, *inside), np.random.default_rng(1), 20.0)


def test_vertices_of_a_file_are_moved_onto_its_faces(tmp_path):
    few = read(tee(), tmp_path, 5)
    assert all(face.exact for face in few.faces)
    bore = next(f for f in few.faces if f.kind == "cylinder" and abs(f.radius - 9.781e-3) < 1e-9)
    rng, ball = np.random.default_rng(0), 0.9 * bore.radius
    side = np.cross(bore.axis, rng.normal(size=(50, 3)))
    middle = few.vertices.mean(axis=0)
    along = bore.point + (middle - bore.point) @ bore.axis * bore.axis + 20 * MM * bore.axis
    centers = along + 0.11 * bore.radius * side / np.linalg.norm(side, axis=1)[:, None]
    deepest, counts = few.contacts_batch(centers, np.full(50, ball))
    assert (counts == 1).all()
    assert np.abs(deepest - 0.01 * bore.radius).max() <= 1e-12 * ball


def test_a_face_says_why_it_is_not_exact(tmp_path):
    rough = read(tee(), tmp_path, 1)
    reasons = [face.reason for face in rough.faces if not face.exact]
    assert reasons
    assert all(reason.endswith(" nm") and "off it by" in reason for reason in reasons)
    assert all(face.reason == "" for face in rough.faces if face.exact)


def test_a_plane_is_flat_however_far_off_it_its_vertices_are(tmp_path):
    """Files of some systems are off by micrometers; forces on planes are exact all the same."""
    block = occ.box([-20, -20, 0], [20, 20, 8])
    upright = occ.edges_where(block, lambda p: np.ptp(p[:, 2]) > 1)
    solid = occ.placed(occ.filleted(block, upright, 3.0), np.random.default_rng(2), 0.0)
    shell = read(solid, tmp_path, 2)
    rng, ball, depth, law = np.random.default_rng(0), 1e-3, 1e-6, sp.ImpactLaw(1.0, 1.5)
    planes = [face for face in shell.faces if face.kind == "plane"]
    assert len(planes) == 6
    for face in planes:
        assert face.exact
        corners = shell.vertices[shell.triangles[np.isin(shell.triangle_element, face.elements)]]
        middle = corners.reshape(-1, 3).mean(axis=0)
        for _ in range(20):
            place = middle + 5e-4 * rng.normal(size=3)
            place -= (place - face.point) @ face.axis * face.axis
            force = shell.contacts(place + (ball - depth) * face.axis, ball).force(law)
            assert np.linalg.norm(force) == pytest.approx(depth**1.5, rel=1e-9)


def test_where_cylinders_end_in_planes_the_planes_stay_flat(tmp_path):
    """Borders are moved onto both faces at once; a plane has the last word."""
    shell = read(BOXES["mitre"](np.random.default_rng(0)), tmp_path)
    points, _, _ = curved_mesh(shell, 3)
    points = points.reshape(len(shell.triangles), -1, 3)
    for face in shell.faces:
        if face.kind == "plane":
            off = (points[np.isin(shell.triangle_element, face.elements)] - face.point) @ face.axis
            assert np.abs(off).max() <= 1e-14 * shell.size


def test_a_border_that_runs_through_the_facet_beside_its_own():
    """Of a bore in a plate: beside a needle at its rim the round rim is beyond the next facet."""
    count, radius, height = 32, 0.1, 0.09
    turn = 2 * np.pi * np.arange(count) / count
    rim = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    chord, out = rim[1] - rim[0], (rim[0] + rim[1]) / np.linalg.norm(rim[0] + rim[1])
    bulge = chord @ chord / 2  # at a share s of the chord the rim is s (1 - s) of it beyond
    needle = rim[0] + 0.05 * chord + 0.3 * bulge * out
    vertices = np.concatenate([rim, 2 * rim, rim - [0, 0, 1.0], [needle]])
    i, j = np.arange(count), np.roll(np.arange(count), -1)
    quads = np.stack([i, i + count, j + count, j], axis=1)
    walls = np.stack([i, j, j + 2 * count, i + 2 * count], axis=1)
    flat = np.concatenate([quads[1:, [0, 1, 2]], quads[1:, [0, 2, 3]]])
    fan = [[a, b, 3 * count] for a, b in ((0, 1), (1, count + 1), (count + 1, count), (count, 0))]
    round_ = np.concatenate([walls[:, [0, 1, 2]], walls[:, [0, 2, 3]]])
    triangles = np.concatenate([flat, fan, round_])
    normals = np.broadcast_to([0, 0, 1.0], (len(triangles), 3, 3)).copy()
    normals[-len(round_) :] = -vertices[round_] * [1, 1, 0]
    shell = sp.Shell(vertices, triangles, normals=normals)
    assert [face.exact for face in shell.faces] == [True, True]
    for share in np.linspace(0.35, 0.9, 12):
        for beyond in np.linspace(0.3, share, 5)[1:-1] * (1 - share):
            center = rim[0] + share * chord + beyond * bulge * out + [0, 0, height]
            found = shell.contacts(center, radius)
            aside = 1 - np.hypot(*center[:2])
            assert found.depth == pytest.approx([radius - np.hypot(height, aside)], abs=1e-14)


def test_a_border_to_a_free_form_face_ends_on_its_face(tmp_path):
    """Of a boss whose fillet is no simple face: it is exact, and nothing is lost."""
    boss = occ.cylinder(6.0, 40.0, [0, 0, 4], [0.4, 0, 1])
    solid = occ.fuse(occ.box([-20, -20, 0], [20, 20, 8]), boss)
    at_foot = occ.edges_where(
        solid, lambda p: abs(p[0, 2] - 8) < 1e-6 > np.ptp(p[:, 2]) and np.abs(p).max() < 12
    )
    shell = read(occ.filleted(solid, at_foot, 2.0), tmp_path, chord_error=2e-4)
    (boss,) = [face for face in shell.faces if face.kind == "cylinder"]
    assert boss.exact
    rng, count, ball, depth = np.random.default_rng(0), 300, 2e-3, 2e-4
    mine = np.isin(shell.triangle_element, boss.elements)
    _, on = random_places(shell.vertices[shell.triangles[mine]], count, rng)
    place = on - boss.point
    along = place @ boss.axis
    out = place - along[:, None] * boss.axis
    out /= np.linalg.norm(out, axis=1)[:, None]
    centers = boss.point + along[:, None] * boss.axis
    centers += (boss.radius + ball - depth) * out
    for center in centers:
        found = shell.contacts(center, ball)
        # A fillet beside it may be deeper.
        assert found.depth.max(initial=0.0) >= depth - 1e-4 * ball
        on = np.isin(found.element, boss.elements)
        if on.any():
            assert np.abs(found.depth[on] - depth).min() <= 1e-10 * ball
