"""The contact map: what each element took, and from where it is seen."""

from __future__ import annotations

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.run_stats import PairFigures, RunStats
from sphshell_pin.errors import NameNotFound, ResultError
from sphshell_pin.plot import plot_contact_map, plot_result
from sphshell_pin.plot.contact_map import element_values
from sphshell_pin.plot.relief import Eye
from tests.test_plot import texts
from tests.view.stand_ins import (
    a_result,
    a_scene,
    ball_configuration,
    ball_model,
    ball_on_plate,
    contact_pair,
)


def grid(cells=4, size=1.0):
    """A square of cells x cells quads at z = 0; element number = row * cells + column."""
    side = np.linspace(-0.5 * size, 0.5 * size, cells + 1)
    x, y = np.meshgrid(side, side)
    vertices = np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size)))
    n = cells + 1
    elements = [
        [r * n + c, r * n + c + 1, (r + 1) * n + c + 1, (r + 1) * n + c]
        for r in range(cells)
        for c in range(cells)
    ]
    return sp.Shell(vertices, elements, name="grid")


def on(shell, rows, pairs=("tip",), t=(0.0, 1.0, 3.0, 4.0)):
    """Result and scene of a ball with these contacts on `shell`."""
    model = ball_model()
    scene = a_scene(model, *(contact_pair(model, "ball", 0.05, shell, name=n) for n in pairs))
    q = np.tile(ball_configuration(np.zeros(3)), (len(t), 1))
    return a_result(t, q, rows, pairs), scene


def painted(figure):
    """Faces of the main picture: (m, 4, 2) corners and (m, 4) colours."""
    polygons = figure.axes[0].collections[0]
    return np.array([p.vertices[:4] for p in polygons.get_paths()]), polygons.get_facecolor()


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
    impulse = element_values(result, [0, 1], 16, "impulse")
    assert impulse[5] == pytest.approx(0.5 * 2 + 1.5 * 5)
    assert impulse[6] == pytest.approx(1.5 * 8 + 0.5 * 9)
    assert np.count_nonzero(impulse) == 2
    force = np.array([2.0, 5.0, 8.0, 9.0])
    assert impulse.sum() == pytest.approx(np.trapezoid(force, result.t))
    np.testing.assert_allclose(element_values(result, [0, 1], 16, "time")[[5, 6]], [2.0, 2.0])
    np.testing.assert_allclose(element_values(result, [0, 1], 16, "peak")[[5, 6]], [4.0, 9.0])
    np.testing.assert_allclose(element_values(result, [1], 16, "impulse")[[5, 6]], [0, 12.0])


def test_the_touched_elements_are_coloured_where_they_are():
    result, scene = on(grid(), ROWS, ("tip", "toe"))
    figure = plot_contact_map(result, scene)
    corners, colors = painted(figure)
    assert len(corners) == 16
    bright = np.ptp(colors[:, :3], axis=1) > 0.2
    assert np.count_nonzero(bright) == 2
    eye = Eye.before(np.array([0.0, 0.0, 1.0]))
    shell = scene.pairs[0].shell
    wanted = eye.flat(np.asarray(shell.vertices)[np.asarray(shell.elements)[[5, 6]]]).mean(axis=1)
    got = corners[bright].mean(axis=1)
    assert min(np.linalg.norm(got - one, axis=1).min() for one in wanted) < 1e-12
    assert {"tip", "toe"} <= set(texts(figure))
    assert figure.axes[-1].get_ylabel() == "normal impulse on each element [N s]"


@pytest.mark.parametrize(
    ("quantity", "label"),
    [
        ("time", "time in contact of each element [s]"),
        ("peak", "peak normal force on each element [N]"),
    ],
)
def test_other_quantities_carry_their_unit(quantity, label):
    result, scene = on(grid(), ROWS, ("tip", "toe"))
    assert plot_contact_map(result, scene, quantity).axes[-1].get_ylabel() == label


def test_an_eye_sees_what_it_stands_before_and_z_points_up():
    random = np.random.default_rng(0)
    for direction in [*random.normal(size=(50, 3)), [0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0]]:
        normal = np.asarray(direction) / np.linalg.norm(direction)
        eye = Eye.before(normal)
        axes = np.array([eye.right, eye.up, eye.toward])
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        assert eye.toward @ normal > 0.5
        assert eye.up[2] > 0.0
        assert abs(eye.right[2]) < 1e-12


def test_a_solid_held_from_both_sides_has_two_pictures():
    box = sp.Shell(
        np.array(np.meshgrid(*3 * [(-0.5, 0.5)], indexing="ij")).reshape(3, -1).T,
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
        name="box",
    )
    # Elements 0 and 1 are the faces towards -x and +x.
    rows = [
        {"row": 1, "element": 0, "point_world": [-0.5, 0, 0], "normal_world": [-1.0, 0, 0]},
        {
            "row": 1,
            "pair": 1,
            "element": 1,
            "point_world": [0.5, 0, 0],
            "normal_world": [1.0, 0, 0],
            "normal_force": 3.0,
        },
    ]
    figure = plot_contact_map(*on(box, rows, ("thumb", "index")))
    titles = [axis.get_title() for axis in figure.axes]
    assert titles[:2] == ["box", "box, the other side"]
    for axis, own, other in (
        (figure.axes[0], "index", "thumb"),
        (figure.axes[1], "thumb", "index"),
    ):
        names = {text.get_text() for text in axis.texts}
        assert own in names
        assert other not in names


def test_of_a_large_shell_the_part_that_was_touched_is_shown():
    shell = grid(cells=40)
    rows = [
        {"row": k, "element": 820 + k, "point_world": [0.0125 + 0.025 * k, 0.0125, 0]}
        for k in range(3)
    ]
    result, scene = on(shell, rows)
    axis = plot_contact_map(result, scene).axes[0]
    assert np.ptp(axis.get_xlim()) < 0.35
    assert len(axis.child_axes) == 1  # the whole shell, small
    assert 3 <= len(axis.collections[0].get_paths()) < 400
    # What was touched is inside.
    eye = Eye.before(np.array([0.0, 0.0, 1.0]))
    x, y = eye.flat(np.array([0.0375, 0.0125, 0.0]))
    assert axis.get_xlim()[0] < x < axis.get_xlim()[1]
    assert axis.get_ylim()[0] < y < axis.get_ylim()[1]


def test_a_fine_mesh_is_coloured_as_wide_as_a_line(monkeypatch):
    monkeypatch.setattr("sphshell_pin.plot.relief.MOST_PAINTED", 5_000)
    shell = grid(cells=150)
    rows = [
        {"row": k % 4, "element": 151 * k, "point_world": [-0.5 + k / 150, -0.5 + k / 150, 0]}
        for k in range(150)
    ]
    result, scene = on(shell, rows)
    axis = plot_contact_map(result, scene).axes[0]
    ground, strip = axis.collections
    assert len(strip.get_paths()) == 150
    assert strip.get_linewidth()[0] > 2.0
    # Fewer, larger elements stand for the others, and leave no hole.
    assert len(ground.get_paths()) < 6_000
    area = sum(np.abs(_area(path.vertices[:4])) for path in ground.get_paths())
    whole = Eye.before(np.array([0.0, 0.0, 1.0])).flat(
        np.asarray(shell.vertices)[[0, 150, -1, -151]]
    )
    assert area > np.abs(_area(whole))


def _area(corners):
    x, y = corners.T
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


def test_the_scale_has_the_length_it_tells():
    scene, result = ball_on_plate()
    axis = plot_contact_map(result, scene).axes[0]
    told = next(t.get_text() for t in axis.texts if t.get_text().endswith(" mm"))
    lengths = [np.ptp(line.get_xdata()) for line in axis.lines if np.ptp(line.get_ydata()) == 0]
    assert any(length == pytest.approx(1e-3 * float(told.split()[0])) for length in lengths)


def test_what_cannot_be_drawn_is_told():
    scene, result = ball_on_plate()
    with pytest.raises(ResultError, match="no scene"):
        plot_contact_map(result)
    with pytest.raises(NameNotFound, match="impulse"):
        plot_contact_map(result, scene, "heat")
    with pytest.raises(NameNotFound, match="overview, force, energy, path, map"):
        plot_result(result, "forces")
    empty, scene = on(grid(), [])
    assert "No contact in this run." in texts(plot_contact_map(empty, scene))


@pytest.mark.parametrize(
    ("figures", "said"),
    [
        # What the rows of ball_on_plate hold, about: 31 rows of 0.05 s with 5 N.
        ({"contact_time": 1.55, "mean_force": 5.0, "peak_force": 6.0}, ""),
        ({"contact_time": 3.1, "mean_force": 5.0, "peak_force": 6.0}, "hold 50% of it"),
    ],
)
def test_what_passed_between_the_rows_is_told(figures, said):
    scene, result = ball_on_plate()
    rest = dict.fromkeys(("impulse", "peak_force_time", "max_depth", "max_depth_time"), 0.0)
    result.stats = RunStats(pairs={"ball": PairFigures(**figures, **rest, touches=1)})
    for quantity in ("impulse", "time"):
        title = plot_contact_map(result, scene, quantity)._suptitle.get_text()
        assert ("record more often" in title) == bool(said)
        if quantity == "time":
            assert said in title


def test_a_notebook_gets_a_picture():
    scene, result = ball_on_plate()
    for kind in ("overview", "force", "energy", "path", "map"):
        png = plot_result(result, kind, scene)._repr_png_()
        assert png.startswith(b"\x89PNG")
