"""Pictures of a run that was really simulated, on shells that were really cleaned."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.plot import save_figures
from sphshell_pin.view import write_recording
from tests.view.stand_ins import CUBE_ELEMENTS, CUBE_VERTICES, ball_configuration, ball_model
from tests.view.test_page import unpacked

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run():
    """A ball that is thrown onto a slowly turning table."""
    model = ball_model()
    scene = sp.Scene(model)
    table = sp.Shell(0.5 * CUBE_VERTICES * [1, 1, 0.1], CUBE_ELEMENTS, name="table top")
    scene.add_contact(
        sphere=sp.Sphere(0.05, frame="ball"),
        shell=table,
        frame="table",
        placement=pin.SE3(np.eye(3), np.array([0.0, 0.0, -0.025])),
        law=sp.ImpactLaw(stiffness=1e6, exponent=1.5, damping=200.0, full_damping_depth=1e-4),
        friction=sp.CoulombFriction(0.3, 0.2, 0.01, 0.1),
        name="ball-table",
    )
    v0 = np.zeros(model.nv)
    v0[0], v0[-1] = 0.1, 0.5
    simulation = sp.Simulation(scene, sp.SemiImplicitEuler(dt=1e-4))
    return scene, simulation.run(ball_configuration([-0.1, 0.0, 0.07]), v0, 0.5, record_dt=1e-3)


def test_the_recording_holds_the_contact(run, tmp_path):
    scene, result = run
    path = write_recording(tmp_path / "recording.html", result, scene, fps=60, speed=0.25)
    commands = unpacked(path.read_text())
    clips = next(c for c in commands if c["type"] == "set_animation")["animations"]
    moving = {clip["path"] for clip in clips}
    assert {"/meshcat/shells/0_table top", "/meshcat/spheres/0_ball-table"} <= moving
    assert any(path.startswith("/meshcat/contacts/normal_0") for path in moving)
    assert [clip["clip"]["duration"] for clip in clips] == pytest.approx([2.0] * len(clips))


def test_the_figures_are_drawn(run, tmp_path):
    scene, result = run
    assert len(save_figures(result, tmp_path, scene)) == 4
    figure = result.plot()
    assert len(figure.axes) == 4
    figure.canvas.draw()


def test_a_loaded_result_has_figures_too(run, tmp_path):
    _, result = run
    result.save(tmp_path / "run.npz")
    assert len(save_figures(sp.Result.load(tmp_path / "run.npz"), tmp_path)) == 3


def test_the_drawn_edges_are_those_of_the_file():
    """A quad's diagonal is no edge of its shell, and is not drawn as one."""
    from sphshell_pin.view.surface import SurfaceMesh, outlined_edges

    cube = sp.Shell(CUBE_VERTICES, CUBE_ELEMENTS)
    assert len(outlined_edges(cube)) == 12
    assert len(SurfaceMesh.of(cube).vertices) == 24
