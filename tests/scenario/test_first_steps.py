"""What a first user meets: surfaces before the tip, parts of a file, names nearly right, Ctrl-C."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin.scenario import build
from tests.command import call
from tests.scenario.files import DROP, arm_urdf, write


def told(*arguments):
    done = call(*arguments)
    return done.exit_code, " ".join(done.output.split())


@pytest.mark.parametrize("axes", ["zyyy", "zyyzyz", "zyzyyy"])
def test_no_joint_stands_behind_the_surface(axes, draft, tmp_path):
    """A surface under an arm that stands upright would be pierced by the arm itself."""
    urdf = arm_urdf(tmp_path, axes)
    built = draft(urdf, "plane", radius=0.01).built
    (pair,), model = built.scene.pairs, built.scene.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, built.q0)
    origins = np.array([one.translation for one in list(data.oMi)[1:]])
    plane = pair.side_j.placement
    tip = data.oMf[model.getFrameId(f"link_{len(axes) - 1}")].translation
    outward = plane.rotation[:, 2] * np.sign((tip - plane.translation) @ plane.rotation[:, 2])
    heights = (origins - plane.translation) @ outward
    # The arm stands on the plane, or beside it.
    assert heights[0] >= -1e-9
    assert heights[1:].min() > 0.009


def test_a_scenario_is_found_by_its_whole_name(tmp_path):
    path = write(tmp_path, DROP)
    code, output = told("explain", path.with_suffix(""))
    assert code == 2
    assert f"did you mean {path}" in output.replace("\n", "")
    assert "is a folder" in told("explain", tmp_path)[1]


def test_another_integrator_leaves_the_old_ones_settings_behind(draft):
    made = draft("three_link_finger")
    built = build(made.path, {"run.integrator": "semi-implicit-euler", "run.dt": "1e-4"})
    assert (built.scenario.run.dt, built.scenario.run.rtol) == (1e-4, None)
    again = build(made.path, {"run.integrator": "adaptive"})
    assert again.scenario.run.rtol == made.built.scenario.run.rtol
    code, output = told("explain", made.path, "--dt", "1e-4")
    assert code == 2
    assert "set run.integrator to semi-implicit-euler" in output
