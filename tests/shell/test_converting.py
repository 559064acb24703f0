"""From file to file: within the chord error, compared in any case, and never half done."""

import numpy as np
import pytest

pytest.importorskip("OCP")


from sphshell_pin import Shell, errors
from sphshell_pin.errors import NameNotFound, ShellFileError
from sphshell_pin.shell import converting
from sphshell_pin.shell.converting import convert
from tests.command import call, succeed
from tests.meshes import cube
from tests.shell import cad_shapes as shapes
from tests.tables import cases_of


@pytest.fixture
def plate(tmp_path):
    return shapes.write_step(tmp_path / "plate.step", ("plate", shapes.drilled_plate()))


def test_cad_to_mesh_stays_within_the_chord_error(plate, tmp_path):
    done = convert(plate, tmp_path / "out.obj", unit_out="m", chord_error=5e-5)
    shell = Shell.from_file(tmp_path / "out.obj", "m")
    assert done.target.num_elements == shell.num_elements
    assert shell.is_closed
    # Seen from the hole the exact surface is nearer to its axis than 10 mm nowhere.
    inner = np.linalg.norm(shell.vertices[:, :2] - 0.020, axis=1).min()
    assert inner == pytest.approx(0.010, rel=1e-6)
    assert done.largest < 1e-15
    assert any("chord error 5e-05 m stated" in note for note in done.notes)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".shl"])
def test_exact_normals_reach_the_file_corner_by_corner(plate, suffix, tmp_path):
    exact = Shell.from_file(plate)
    done = convert(plate, tmp_path / f"out{suffix}")
    assert not any("normals" in note for note in done.notes)
    shell = Shell.from_file(tmp_path / f"out{suffix}", None if suffix == ".shl" else "mm")
    assert len(shell.triangles) == len(exact.triangles)
    assert shell.normals is not None
    # The curved elements, which follow from the normals, are the same.
    middles = exact.vertices[exact.triangles].mean(axis=1)
    places, again = (one.closest_points(middles) for one in (exact, shell))
    assert again.distances == pytest.approx(places.distances, abs=1e-7 * shell.size)
    assert again.normals == pytest.approx(places.normals, abs=1e-6)
    report = shell.curvature_report()
    assert report.largest == pytest.approx(exact.curvature_report().largest, rel=1e-5)
    assert not report.problems


@pytest.mark.parametrize("suffix", [".stl", ".off"])
def test_what_a_format_does_not_hold_is_stated(plate, suffix, tmp_path):
    target = tmp_path / f"out{suffix}"
    done = convert(plate, target)
    assert f"{suffix} files hold no normals" in done.notes[-1]
    assert "recognized again" in done.notes[-1]
    (face,) = [one for one in Shell.from_file(target, "mm").faces if one.radius]
    assert face.radius == pytest.approx(0.010, rel=1e-6)
    again = convert(target, tmp_path / "copy.off", "mm")
    assert not any("normals" in note for note in again.notes)


def test_quads_stay_quads_between_meshes(tmp_path):
    Shell([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]).to_file(tmp_path / "a.off")
    done = convert(tmp_path / "a.off", tmp_path / "a.shl", "cm")
    assert (done.source.num_elements, done.target.num_elements) == (1, 1)
    assert done.largest < 1e-15
    assert Shell.from_file(tmp_path / "a.shl").size == pytest.approx(0.01 * 2**0.5)


def test_a_body_is_converted_alone(tmp_path):
    bodies = ("plate", shapes.box()), ("pin", shapes.cylinder())
    path = shapes.write_step(tmp_path / "two.step", *bodies)
    pin = convert(path, tmp_path / "pin.stl", bodies=["pin"]).target
    assert pin.is_closed
    assert np.allclose(pin.box[0, 0], 0.095, atol=1e-4)
    assert not convert(path, tmp_path / "side.stl", faces=[7]).target.is_closed


def test_a_failed_conversion_leaves_the_old_file_and_nothing_else(plate, tmp_path, monkeypatch):
    convert(plate, tmp_path / "mesh.stl")
    (tmp_path / "out.stl").write_bytes(b"precious")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(NameNotFound):
        convert(plate, tmp_path / "out.stl", bodies=["nothing"])

    def fail(*_):
        raise ShellFileError("out.stl", "no room")

    monkeypatch.setattr(converting, "encoded", fail)
    with pytest.raises(ShellFileError, match="no room"):
        convert(tmp_path / "mesh.stl", tmp_path / "out.stl", "mm")
    assert (tmp_path / "out.stl").read_bytes() == b"precious"
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("source", "target", "options", "kind", "told"), cases_of("shell_files")["conversions"]
)
def test_what_cannot_be_is_refused(source, target, options, kind, told, plate, tmp_path):
    Shell(*cube()).to_file(tmp_path / "box.stl")
    unit = "mm" if source == "box.stl" else None
    with pytest.raises(getattr(errors, kind), match=told):
        convert(tmp_path / source, tmp_path / target, unit, **options)


def test_the_command_prints_what_it_measured(plate, tmp_path):
    target = tmp_path / "out.stl"
    told = succeed("convert", plate, target, "--chord-error", "1e-4")
    assert "distance of a vertex of either" in told.output
    assert "chord error 0.0001 m stated" in told.output
    told = succeed("check", plate, "--face", "7", "--chord-error", "1e-5")
    assert "1 CAD face, tolerance" in told.output
    told = call("convert", target, tmp_path / "out.obj")
    assert told.exit_code == 2
    assert "--unit-in mm" in told.output
