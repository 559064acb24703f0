import sys

import numpy as np
import pytest

from sphshell_pin import plot
from sphshell_pin.dynamics.result.result_parts import PairSeries
from sphshell_pin.errors import MissingExtra
from sphshell_pin.plot.figure import NO_CONTACT
from sphshell_pin.plot.over_time import MOST_PAIRS, MOST_POINTS
from tests.view import stand_ins


def texts(figure):
    """Everything written in a figure."""
    from matplotlib.text import Text

    figure.canvas.draw()
    return [text.get_text().strip() for text in figure.findobj(Text) if text.get_text()]


def labels(figure):
    names = ("get_xlabel", "get_ylabel", "get_zlabel")
    return {getattr(axis, name)() for axis in figure.axes for name in names if hasattr(axis, name)}


def without_contact():
    q = np.tile(stand_ins.ball_configuration(np.ones(3)), (5, 1))
    return stand_ins.a_result(np.arange(5.0), q)


def test_the_figures_are_written_and_not_blank(tmp_path):
    from PIL import Image

    scene, result = stand_ins.ball_on_plate()
    paths = plot.save_figures(result, tmp_path / "new", scene)
    assert [path.stem for path in paths] == ["force_and_depth", "energy", "contact_map"]
    for path in paths:
        pixels = np.asarray(Image.open(path).convert("L"))
        assert pixels.shape[1] >= 900
        assert 0.002 < np.mean(pixels < 128) < 0.5


def test_axes_carry_their_units():
    scene, result = stand_ins.ball_on_plate()
    energies = {"kinetic": np.array([0, 2e-3]), "residual": np.array([0, 3e-9])}
    energetic = stand_ins.a_result([0, 1], np.zeros((2, 8)), **energies)
    force, energy = plot.plot_force_and_depth(result), plot.plot_energy(energetic)
    shell = plot.plot_contact_map(result, scene)
    assert {"force [N]", "largest depth [mm]", "time [s]"} <= labels(force)
    assert {"x of the shell [m]", "y of the shell [m]"} <= labels(shell)
    assert {"energy [mJ]", "residual [nJ]"} <= labels(energy)


def test_forces_of_one_pair_add_normal_as_numbers_and_friction_as_vectors():
    rows = [
        {"row": 1, "normal_force": 2.0, "friction_force_world": [1.0, 0, 0], "depth": 1e-3},
        {"row": 1, "normal_force": 3.0, "friction_force_world": [-1.0, 0, 0], "depth": 2e-3},
        {"row": 2, "pair": 1, "normal_force": 9.0},
    ]
    series = PairSeries.of(stand_ins.a_result([0, 1, 2], np.zeros((3, 8)), rows, ("one", "two")), 0)
    np.testing.assert_array_equal(series.normal, [0, 5, 0])
    np.testing.assert_array_equal(series.friction, [0, 0, 0])
    np.testing.assert_array_equal(series.depth, [0, 2e-3, 0])


def test_a_run_without_contact_is_told_in_words(tmp_path):
    result = without_contact()
    for figure in (plot.plot_force_and_depth(result), plot.plot_result(result)):
        assert NO_CONTACT in texts(figure)
    assert len(plot.save_figures(result, tmp_path)) == 2


def test_every_shell_has_its_own_picture_and_every_pair_its_name():
    model = stand_ins.ball_model()
    shells = [stand_ins.plate(name=f"plate {k}") for k in range(3)]
    names = [f"finger {k}" for k in range(6)]
    pairs = [
        stand_ins.contact_pair(model, "ball", 0.05, shells[k // 2], name=name)
        for k, name in enumerate(names)
    ]
    rows = [{"row": k, "pair": k, "point_world": [0.01 * k, 0.05 * k, 0]} for k in range(6)]
    q = np.tile(stand_ins.ball_configuration(), (6, 1))
    result = stand_ins.a_result(np.arange(6), q, rows, names)
    written = " ".join(texts(plot.plot_contact_map(result, stand_ins.a_scene(model, *pairs))))
    assert all(name in written for name in (*names, "plate 0", "plate 1", "plate 2"))


def test_of_many_pairs_the_hardest_are_drawn_and_the_rest_is_mentioned():
    count = MOST_PAIRS + 3
    rows = [{"row": 1, "pair": k, "normal_force": 1.0 + k} for k in range(count)]
    result = stand_ins.a_result([0, 1], np.zeros((2, 8)), rows, [f"pair {k}" for k in range(count)])
    for kind in ("overview", "force"):
        written = " ".join(texts(plot.plot_result(result, kind)))
        assert "pair 0" not in written
        assert f"pair {count - 1}" in written
        assert "3 pairs with smaller forces left out" in written


def test_a_long_run_keeps_its_one_row_peak():
    count = 300_000
    result = stand_ins.a_result(np.arange(count) * 1e-4, np.zeros((count, 1)), pairs=("tip",))
    result.contacts = stand_ins.contact_log([{"row": 123_457, "normal_force": 77.0}])
    line = plot.plot_force_and_depth(result).axes[0].lines[0]
    assert len(line.get_xdata()) <= MOST_POINTS + 2
    assert line.get_ydata().max() == 77.0


def test_without_matplotlib_one_sentence_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingExtra, match=r"sphshell-pin\[view\]"):
        plot.plot_result(without_contact())


def test_potential_energy_is_shown_from_where_it_started():
    result = without_contact()
    result.energy.potential = np.linspace(1000.0, 1001.0, 5)
    lines = plot.plot_energy(result).axes[0].lines
    (line,) = (one for one in lines if "potential" in one.get_label())
    assert line.get_ydata()[0] == 0.0
