"""The contact map: what each element took, and from where it is seen."""

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.result.run_stats import PairFigures, RunStats
from sphshell_pin.errors import NameNotFound, ResultError
from sphshell_pin.plot import plot_contact_map, plot_result
from sphshell_pin.plot.contact_map import element_impulses
from sphshell_pin.plot.on_shell import eye_direction
from tests import meshes
from tests.test_plot import texts
from tests.view import stand_ins


def grid(cells=4):
    """A square of cells x cells quads at z = 0; element number = row * cells + column."""
    return sp.Shell(*meshes.grid_plate(cells, cells, quads=True), name="grid")


def on(shell, rows, pairs=("tip",), t=(0.0, 1.0, 3.0, 4.0)):
    """Result and scene of a ball with these contacts on `shell`."""
    q = np.tile(stand_ins.ball_configuration(), (len(t), 1))
    return stand_ins.a_result(t, q, rows, pairs), stand_ins.ball_scene(shell, names=pairs)


def painted(axis):
    """Elements of a picture: their middles (m, 3) in its unit, and their colors (m, 4)."""
    polygons = axis.collections[0]
    return np.array(polygons._faces)[:, :4].mean(axis=1), polygons._facecolor3d


ROWS = [
    {"row": 0, "element": 5, "normal_force": 2.0},
    {"row": 1, "element": 5, "normal_force": 4.0},
    {"row": 1, "element": 5, "normal_force": 1.0},
    {"row": 2, "element": 6, "normal_force": 8.0, "pair": 1},
    {"row": 3, "element": 6, "normal_force": 9.0},
]


def test_elements_take_force_over_time():
    result, _ = on(grid(), ROWS, ("tip", "toe"))
    # The rows at 0, 1, 3, 4 s stand for 0.5, 1.5, 1.5, 0.5 s: the trapezoidal rule.
    impulse = element_impulses(result, [0, 1], 16)
    np.testing.assert_allclose(impulse[[5, 6]], [0.5 * 2 + 1.5 * 5, 1.5 * 8 + 0.5 * 9])
    assert np.count_nonzero(impulse) == 2
    np.testing.assert_allclose(element_impulses(result, [1], 16)[[5, 6]], [0, 12.0])


def test_the_touched_elements_are_colored_where_they_are():
    result, scene = on(grid(), ROWS, ("tip", "toe"))
    figure = plot_contact_map(result, scene)
    middles, colors = painted(figure.axes[0])
    assert len(middles) == 16
    bright = np.ptp(colors[:, :3], axis=1) > 0.2
    np.testing.assert_allclose(middles[bright], [[-0.125, -0.125, 0.0], [-0.125, 0.125, 0.0]])
    assert {"tip", "toe"} <= set(texts(figure))
    assert figure.axes[-1].get_ylabel() == "normal impulse on each element [N s]"


def test_the_eye_is_before_the_surface_a_little_aside():
    random = np.random.default_rng(0)
    for direction in [*random.normal(size=(50, 3)), [0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0]]:
        normal = np.asarray(direction) / np.linalg.norm(direction)
        toward = eye_direction(np.asarray(direction))
        assert np.linalg.norm(toward) == pytest.approx(1.0)
        assert 0.5 < toward @ normal < 0.99
        assert abs(toward[2]) < 0.98  # z points up in the picture


def test_a_solid_held_from_both_sides_has_two_pictures():
    box = sp.Shell(*meshes.cube(quads=True), name="box")
    # Elements 0 and 1 are the faces towards -x and +x.
    left = {"row": 1, "element": 0, "point_world": [-0.5, 0, 0], "normal_world": [-1.0, 0, 0]}
    right = {"row": 1, "element": 1, "point_world": [0.5, 0, 0], "normal_world": [1.0, 0, 0]}
    rows = [left, {**right, "pair": 1, "normal_force": 3.0}]
    figure = plot_contact_map(*on(box, rows, ("thumb", "index")))
    assert [axis.get_title() for axis in figure.axes][:2] == ["box", "box, the other side"]
    for axis, own in zip(figure.axes[:2], ("index", "thumb"), strict=True):
        assert {text.get_text().strip() for text in axis.texts} & {"index", "thumb"} == {own}


def test_a_fine_mesh_is_colored_as_wide_as_a_line(monkeypatch):
    monkeypatch.setattr("sphshell_pin.plot.on_shell.MOST_PAINTED", 5_000)
    way = np.linspace(-0.5, 0.5, 150, endpoint=False)
    rows = [{"row": k % 4, "element": 151 * k, "point_world": [x, x, 0]} for k, x in enumerate(way)]
    ground, strip = plot_contact_map(*on(grid(150), rows)).axes[0].collections
    assert len(strip._faces) == 150
    assert strip.get_linewidth()[0] > 2.0
    # Fewer, larger elements replace the others, and leave no hole.
    assert len(ground._faces) < 6_000
    sides = np.ptp(np.array(ground._faces), axis=1)
    assert (sides[:, 0] * sides[:, 1]).sum() > 1.0


def test_what_cannot_be_drawn_is_reported():
    scene, result = stand_ins.ball_on_plate()
    with pytest.raises(ResultError, match="no scene"):
        plot_contact_map(result)
    with pytest.raises(NameNotFound, match="overview, force, energy, map"):
        plot_result(result, "forces")
    empty, scene = on(grid(), [])
    assert "No contact in this run." in texts(plot_contact_map(empty, scene))


@pytest.mark.parametrize(
    ("figures", "said"),
    [
        # What the rows of ball_on_plate hold, about: 31 rows of 0.05 s with 5 N.
        ({"contact_time": 1.55, "mean_force": 5.0, "peak_force": 6.0}, ""),
        ({"contact_time": 3.1, "mean_force": 5.0, "peak_force": 6.0}, "hold 51% of it"),
    ],
)
def test_what_passed_between_the_rows_is_reported(figures, said):
    scene, result = stand_ins.ball_on_plate()
    rest = dict.fromkeys(("impulse", "peak_force_time", "max_depth", "max_depth_time"), 0.0)
    result.stats = RunStats(pairs={"ball": PairFigures(**figures, **rest, touches=1)})
    title = plot_contact_map(result, scene)._suptitle.get_text()
    assert ("record more often" in title) == bool(said)
    assert said in title


def test_of_a_large_shell_the_part_that_was_touched_is_shown():
    places = [[0.0125, 0.0125 + 0.025 * k, 0] for k in range(3)]
    rows = [{"row": k, "element": 820 + k, "point_world": at} for k, at in enumerate(places)]
    axis = plot_contact_map(*on(grid(40), rows)).axes[0]
    assert axis.get_xlabel() == "x of the shell [mm]"
    assert 3 <= len(painted(axis)[0]) < 400
    # What was touched is inside.
    for (low, high), x in zip((axis.get_xlim(), axis.get_ylim()), (12.5, 37.5), strict=True):
        assert low < x < high < low + 350.0
