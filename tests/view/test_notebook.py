"""A result in a notebook: the recording as the value of a cell."""

import dataclasses
import html
import re

import pytest

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.errors import InvalidParameter, ResultError
from sphshell_pin.scenario import build
from sphshell_pin.scenario.running.run import simulate
from tests.scenario.files import DROP, write
from tests.view.stand_ins import plate
from tests.view.test_page import unpacked


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """What was saved of a run, loaded again."""
    home = tmp_path_factory.mktemp("drop")
    text = DROP.replace("dt = 1e-4", "dt = 1e-4\nrecording_speed = 0.1")
    result, _ = simulate(build(write(home, text)))
    return sp.Result.load(result.save(home / "run.npz"))


def test_a_loaded_result_shows_itself(result, tmp_path):
    shown = result.view(height=321)
    assert "<title>a ball falls on a box</title>" in shown.page
    clock = next(one["clock"] for one in unpacked(shown.page) if one["type"] == "panel")
    assert clock["speed"] == 0.1
    frame = shown._repr_html_()
    assert 'height="321"' in frame
    inside = html.unescape(re.fullmatch(r'<iframe srcdoc="([^"]*)".*</iframe>', frame)[1])
    assert inside == shown.page
    assert shown.save(tmp_path / "page.html").read_text() == shown.page
    assert len(repr(shown)) < 100


def test_a_robot_without_geometry_is_hinted_where_it_is_seen(result):
    finger = robots.load("three_link_finger")
    scene = sp.Scene(finger.model)
    scene.add_contact(sp.Sphere(0.01, "tip"), plate(), law=sp.ImpactLaw(1e4))
    moved = sp.Simulation(scene).run([0.2, 0.6, 0.4], duration=0.01)
    bare = moved.view()
    assert "visual_model" in bare.hint
    assert html.escape(bare.hint) in bare._repr_html_()
    assert bare.hint in repr(bare)
    assert bare.hint not in bare.page  # who gets the page did not write the program
    assert moved.view(visual_model=finger.visual_model).hint == ""
    # A ball is drawn by its sphere, and a scenario has its robot's geometry.
    assert result.view().hint == ""
    ball = build("sphere_on_shell")
    assert ball.simulation.run(ball.q0, duration=0.01).view().hint == ""


def test_a_result_without_a_scene_is_told(result):
    lost = dataclasses.replace(result, origin=None)
    with pytest.raises(ResultError, match=r"give scene=\.\.\."):
        lost.view()
    built = build("sphere_on_shell")
    with pytest.raises(InvalidParameter, match="height"):
        lost.view(built.scene, height=0)
