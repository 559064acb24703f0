"""How near the elements of CAD files are to the exact surfaces, judged by OpenCASCADE itself."""

from __future__ import annotations

import pytest

pytest.importorskip("OCP")

from sphshell_pin import Shell
from tests.oracle.cad import ExactShape, deviation
from tests.shell import cad_shapes as shapes
from tests.shell.cad_cases import (
    KNOWN,
    REAL_FILES,
    REAL_FOLDER,
    force_errors,
    order,
    rms,
    stated_and_measured,
)


@pytest.mark.parametrize("chord_error", [2e-4, 2e-5])
@pytest.mark.parametrize("make", ["ball", "cone", "ring", "rounded_box", "drilled_plate", "roof"])
def test_elements_are_as_near_as_stated(make, chord_error, tmp_path):
    shape = getattr(shapes, make)()
    path = shapes.write_brep(tmp_path / "part.brep", shape)
    shell = Shell.from_file(path, "mm", chord_error=chord_error)
    stated, measured, held = stated_and_measured(shell)
    assert stated == chord_error
    assert held
    found = deviation(shell, ExactShape(shape), 60)
    assert found.flat.max() <= chord_error
    assert found.back.max() <= chord_error
    # What the reader says it measured is what is there, and exact normals bring more.
    assert found.flat.max() <= 1.05 * measured + 1e-12
    assert found.smooth.max() <= max(0.2 * chord_error, 1e-9)


@pytest.mark.parametrize("name", REAL_FILES)
def test_real_files_are_as_near_as_they_say(name):
    path = REAL_FOLDER / name
    if not path.is_file():
        pytest.skip(f"{name} is not here")
    from sphshell_pin.shell.cad import require_kernel

    require_kernel("this test")
    from sphshell_pin.shell.cad.reading import read_model

    shell = Shell.from_file(path, REAL_FILES[name])
    stated, measured, held = stated_and_measured(shell)
    found = deviation(shell, ExactShape(read_model(path).shape), 30)
    assert held == (measured <= stated)
    assert found.flat.max() <= 1.05 * measured
    assert found.back.max() <= 1.05 * measured


@pytest.mark.parametrize("name", KNOWN)
def test_smooth_forces_converge_to_those_on_the_exact_surface(name, tmp_path):
    known = KNOWN[name]
    path = shapes.write_brep(tmp_path / "part.brep", known.make())
    errors, chords = [], []
    for chord_error in (known.chord, known.chord / 8):
        shell = Shell.from_file(path, "mm", chord_error=chord_error)
        errors.append(rms(force_errors(shell, known)))
        chords.append(stated_and_measured(shell)[1])
    assert order(errors, chords) >= 3.0
    assert errors[1] < 2e-4
