"""What only the live picture has: growing trails, spheres that change size."""

from types import SimpleNamespace

import meshcat
import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.view.arrows import Forces
from sphshell_pin.view.camera import View
from sphshell_pin.view.live.picture import Picture, lowered
from sphshell_pin.view.live.window import LiveWindow
from tests.scenario.files import DROP, write
from tests.view.drawn import attribute
from tests.view.live_player import ArmPlayer, BallPlayer
from tests.view.stand_ins import a_scene, ball_configuration, ball_model, contact_pair, plate
from tests.view.test_camera import in_picture
from tests.view.test_live_window import Browser


class Easel:
    """A picture of a player, and what a browser sees of it."""

    def __init__(self, player):
        self.player, window = player, LiveWindow()
        self.picture = Picture(player, meshcat.Visualizer(window=window))
        self.browser = Browser(window)
        self.window = window

    def draw(self, push=None):
        self.picture.update(self.player, push)
        self.window.commit()
        return self.browser.look()

    def where(self, name):
        return self.draw().matrices[f"/meshcat/{name}"]


def test_a_sphere_that_changes_size_is_drawn_anew_and_nothing_else_is():
    easel = Easel(BallPlayer())
    easel.draw()
    easel.player.change("radius", 0.04)
    log = easel.draw().log
    redrawn = [c["path"] for c in log if c["type"] == "set_object"]
    assert redrawn
    assert all(path.startswith("/meshcat/spheres/") for path in redrawn)
    (ball,) = [c for c in log if c.get("path", "").endswith("/ball")]
    assert ball["object"]["geometries"][0]["radius"] == 0.04
    assert easel.draw().log == []


class Turning(BallPlayer):
    """A ball that stands still on a table, which turns below it."""

    def _make_scene(self):
        self.model = ball_model()
        pair = contact_pair(self.model, "ball", 0.05, plate(), "table")
        self.scene = a_scene(self.model, pair)

    def reset(self):
        super().reset()
        self.q = ball_configuration([0.3, 0.0, 0.049])


def test_a_trail_grows_on_its_shell_and_moves_with_it():
    """On the table the contact runs on an arc."""
    player = Turning()
    easel = Easel(player)
    for angle in np.linspace(0.0, 1.0, 200):
        player.q = ball_configuration([0.3, 0.0, 0.049], angle)
        easel.draw()
    pieces = [o for path, o in easel.browser.objects.items() if "/trail/" in path]
    assert len(pieces) > 1
    points = np.vstack([attribute(drawn) for drawn in pieces])
    radius = np.hypot(points[:, 0], points[:, 1])
    np.testing.assert_allclose(radius, 0.3, atol=2.0 * easel.picture.display.trail_width)
    seen = -np.arctan2(points[:, 1], points[:, 0])
    assert seen.min() < 0.02
    assert seen.max() > 0.95
    easel.picture.clear()
    assert not any("/trail/" in path for path in easel.draw().objects)


def test_a_push_is_an_arrow_from_the_body():
    easel = Easel(BallPlayer())
    easel.draw(Forces(np.array([[0, 0, 0.2]]), np.array([[3.0, 0, 0]]), np.zeros((1, 3))))
    shaft = easel.browser.matrices["/meshcat/push/total_0/shaft"]
    np.testing.assert_allclose((shaft @ [0, -0.5, 0, 1])[:3], [0.0, 0.0, 0.2], atol=1e-6)
    assert (shaft @ [0, 0.5, 0, 1])[0] > 0.01
    easel.draw(None)
    assert np.abs(easel.browser.matrices["/meshcat/push/total_0/shaft"][:3, :3]).max() < 1e-5


def test_axes_show_how_frames_are_placed_and_the_grid_says_its_spacing():
    player = ArmPlayer()
    easel = Easel(player)
    assert not any("/frames/" in path for path in easel.draw().objects)
    easel.picture.show("frames", True)
    seen = easel.draw()
    model = player.scene.model
    data = model.createData()
    pin.forwardKinematics(model, data, player.q)
    for joint in range(model.njoints):
        place = seen.matrices[f"/meshcat/frames/frame_{joint}"]
        np.testing.assert_allclose(place, data.oMi[joint].homogeneous, atol=1e-6)
        for axis, wanted in zip("xyz", data.oMi[joint].rotation.T, strict=True):
            tip = place @ seen.matrices[f"/meshcat/frames/frame_{joint}/{axis}"] @ [0, 0.5, 0, 1]
            along = tip[:3] - place[:3, 3]
            np.testing.assert_allclose(along / np.linalg.norm(along), wanted, atol=1e-5)
    points = attribute(seen.objects["/meshcat/grid"])
    step = np.diff(np.unique(points[:, 0].round(5))).min()
    assert easel.picture.display.grid == f"grid of {1e3 * step:g} mm at z = 0 m"
    assert np.ptp(points[:, :2], axis=0) == pytest.approx(40 * step, rel=1e-5)
    assert not points[:, 2].any()
    # A scene that is replaced takes its axes along.
    player.scene = SimpleNamespace(model=model, pairs=())
    assert any("/frames/" in path for path in easel.draw().objects)
    easel.picture.show("frames", False)
    assert not any("/frames/" in path for path in easel.draw().objects)


def test_the_curved_surface_of_contact_can_be_compared_with_the_flat_one(tmp_path):
    # The middles of the sides of a tube lie inside its circle, those of curved ones much less so.
    tube = """primitive = { type = "cylinder", radius = 0.1, length = 0.2 }"""
    text = DROP.replace('primitive = { type = "box", size = [0.2, 0.2, 0.02] }', tube)
    player = LiveRun(build(write(tmp_path, text.replace("[run]", 'method = "smooth"\n[run]'))))
    easel = Easel(player)

    def least_radius():
        drawn = easel.draw().objects["/meshcat/shells/0_plate/surface"]
        index = drawn["geometries"][0]["data"]["index"]["array"].data
        corners = attribute(drawn)[np.frombuffer(index, "<u4").reshape(-1, 3)]
        mantle = np.ptp(corners[..., 2], axis=1) > 1e-3
        middles = 0.5 * (corners + np.roll(corners, 1, axis=1))[mantle]
        return np.hypot(middles[..., 0], middles[..., 1]).min()

    curved = least_radius()
    assert easel.picture.switches(player, False)["curved"]
    easel.picture.show("curved", False)
    assert 0.1 - least_radius() > 10 * (0.1 - curved)
    easel.picture.show("curved", True)
    assert least_radius() == curved
    assert "curved" not in Easel(BallPlayer()).picture.switches(BallPlayer(), False)


@pytest.mark.parametrize("seed", range(20))
def test_what_is_moved_down_below_the_figures_stays_in_the_picture(seed):
    random = np.random.default_rng(seed)
    around = random.uniform(-1, 1, (300, 3))
    view = View.of(np.zeros((1, 3)), around, np.zeros(3), 0.05, reach=100.0)
    before, after = (in_picture(one, around) for one in (view, lowered(view)))
    assert np.abs(after).max() < 1.0
    assert after[:, 1].max() < before[:, 1].max() - 0.1


def test_a_contact_that_jumps_starts_another_piece():
    player = BallPlayer()
    easel = Easel(player)
    for start in (-0.4, 0.3):
        for x in np.linspace(start, start + 0.05, 30):
            player.q = np.array([x, 0.0, 0.049])
            easel.draw()
    for path, drawn in easel.browser.objects.items():
        if "/trail/" in path:
            assert np.ptp(attribute(drawn)[:, 0]) < 0.1


def test_arrows_can_be_magnified():
    easel = Easel(BallPlayer())
    easel.draw()
    found = easel.picture.arrow_scale.meters_per_newton
    easel.picture.magnify_arrows(2.0)
    easel.draw()
    assert easel.picture.arrow_scale.meters_per_newton == pytest.approx(2.0 * found)
