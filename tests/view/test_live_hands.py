"""Drags, targets and switches as messages of a browser: what they do, and what they are refused."""

import json

import numpy as np
import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from tests.models import pose_of
from tests.scenario.arms import write_arm
from tests.scenario.files import write
from tests.view.live_driver import OTHER_TAB, TAB, frames, say

NODE = "/meshcat/robot/visuals/lower_0"


@pytest.fixture
def arm(make, tmp_path):
    return make(LiveRun(build(write_arm(tmp_path))), watched=True)


@pytest.fixture
def ball(make, tmp_path):
    return make(LiveRun(build(write(tmp_path))), watched=True)


def drag(live, target, client=TAB, **fields):
    given = {"node": NODE, "point": [0.0, 0.0, 0.1], "stiffness": 100.0, "target": target}
    say(live, "drag", client, **given | fields)


def drawn(live):
    """Return the placements (4, 4) of the nodes of a drag; None before the first one."""
    return [live._window.matrix(f"/meshcat/drag/{name}") for name in ("held", "cursor", "line")]


def test_the_page_is_told_what_can_be_taken_hold_of(arm):
    offered = json.loads(arm._panel.news(0)[1][0])
    # The base has no joint.
    assert offered["drag"]["nodes"][NODE] == "lower"
    assert set(offered["drag"]["nodes"].values()) == {"upper", "lower"}
    assert offered["drag"]["stiffness"] > 0.0
    limits = {"low": -2.0, "high": 1.5, "limited": True}
    elbow = {"joint": "elbow", "rotates": True, "value": 0.5} | limits
    assert offered["targets"][1] == elbow


def test_a_drag_pulls_the_point_of_the_node_that_was_hit(arm):
    frames(arm, 5)
    live, model = arm.player, arm.player.scene.model
    drag(arm, [1.0, 0.0, 0.5])
    frames(arm, 1, wall=0.0)
    assert arm.told == []
    # The box of the link is drawn around its middle, 0.15 m from the joint.
    shown = live.drag
    expected = pose_of(model, live.q, "lower").act(np.array([0.0, 0.0, 0.25]))
    np.testing.assert_allclose(shown.point_world, expected, atol=1e-6)
    held, cursor, line = drawn(arm)
    np.testing.assert_allclose(held[:3, 3], shown.point_world, atol=1e-6)
    np.testing.assert_allclose(cursor[:3, 3], [1.0, 0.0, 0.5], atol=1e-6)
    span = shown.target_world - shown.point_world
    np.testing.assert_allclose(line[:3, 1], span, atol=1e-6)  # a rod along y, one unit long
    frames(arm, 30)
    assert (live.drag.point_world - shown.point_world) @ span > 0.01
    state = arm._state()
    assert state["drag"]["body"] == "lower"
    assert state["drag"]["newtons"] == pytest.approx(np.linalg.norm(live.drag.force_world))


def test_it_comes_back_when_it_is_released_or_the_browser_leaves(arm):
    rest = arm.player.q.copy()
    for end in (lambda: say(arm, "release"), lambda: arm.server.leave(TAB)):
        drag(arm, [1.0, 0.0, 0.5])
        frames(arm, 60)
        assert np.linalg.norm(arm.player.q - rest) > 0.02
        end()
        frames(arm, 1)
        assert arm.player.drag is None
        assert arm._state()["drag"] is None
        assert drawn(arm)[0][0, 0] < 1e-5  # hidden
        frames(arm, 180)
        np.testing.assert_allclose(arm.player.q, rest, atol=1e-4)


def test_the_last_browser_drags_and_only_it_releases(arm):
    drag(arm, [1.0, 0.0, 0.5])
    frames(arm, 2)
    drag(arm, [-1.0, 0.0, 0.5], OTHER_TAB)
    frames(arm, 2)
    say(arm, "release")
    frames(arm, 2)
    np.testing.assert_array_equal(arm.player.drag.target_world, [-1.0, 0.0, 0.5])
    say(arm, "release", OTHER_TAB)
    frames(arm, 2)
    assert arm.player.drag is None


def test_messages_that_cannot_be_are_one_sentence_and_the_run_goes_on(arm):
    drag(arm, [1.0, 0.0, 0.5], node="/meshcat/robot/visuals/base_0")
    drag(arm, [1.0, 0.0, 0.5], node="nothing")
    say(arm, "target", joint="wrist", value=0.1)
    say(arm, "target", joint="elbow", value=9.0)
    frames(arm, 6)
    # Of messages of a kind the last one counts.
    body, joint, limit = (text for _, text in arm.told)
    assert "no body to drag 'nothing'" in body
    assert NODE in body
    assert "shoulder, elbow" in joint
    assert "limits of the joint" in limit
    assert "\n" not in body + joint + limit
    assert arm.player.time > 0.05
