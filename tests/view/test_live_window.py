"""What browsers are told of the scene: all of it once, then what changed."""

import meshcat
import numpy as np
import pytest
import umsgpack

from sphshell_pin.view.live.window import LiveWindow
from sphshell_pin.view.nodes import material, mover, set_object, show, sphere


class Browser:
    """Replays messages as the page does, independently of how they were made."""

    def __init__(self, window):
        self.window, self.frame = window, 0
        self.objects, self.matrices, self.properties = {}, {}, {}
        self.log = []

    def look(self):
        self.frame, message = self.window.news(self.frame)
        self.log = [] if message is None else umsgpack.unpackb(message)
        for command in self.log:
            path = command.get("path")
            if command["type"] == "move":
                rows = np.frombuffer(command["matrices"].data, "<f4").reshape(-1, 4, 4)
                for name, row in zip(command["paths"], rows, strict=True):
                    self.matrices[name] = row.T
            elif command["type"] == "set_object":
                self.objects[path] = command["object"]
            elif command["type"] == "set_property":
                self.properties[path, command["property"]] = command["value"]
            elif command["type"] == "delete":
                for kept in (self.objects, self.matrices):
                    for name in [n for n in kept if (n + "/").startswith(path + "/")]:
                        del kept[name]
        return self


@pytest.fixture
def window():
    return LiveWindow()


@pytest.fixture
def canvas(window):
    return meshcat.Visualizer(window=window)


def place(x):
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix


def put(node, radius=1.0):
    set_object(node, sphere(radius), material("MeshPhong", 0))


def test_only_what_moved_is_told(window, canvas):
    moves = [mover(canvas[f"n{k}"]) for k in range(200)]
    for k, move in enumerate(moves):
        put(canvas[f"n{k}"])
        move(place(k))
    window.commit()
    early = Browser(window).look()
    assert len(early.objects) == len(early.matrices) == 200
    for k, move in enumerate(moves):
        move(place(k + 0.5 * (k == 7)))
    window.commit()
    early.look()
    assert [command["type"] for command in early.log] == ["move"]
    assert early.log[0]["paths"] == ["/meshcat/n7"]
    np.testing.assert_array_equal(early.matrices["/meshcat/n7"], place(7.5))
    window.commit()
    assert window.news(early.frame) == (3, None)


def test_a_slow_browser_gets_the_newest_and_a_late_one_the_whole(window, canvas):
    rng = np.random.default_rng(1)
    fast, slow = Browser(window), Browser(window)
    nodes = [canvas[name] for name in "abcdef"]
    for frame in range(60):
        node = nodes[rng.integers(len(nodes))]
        action = rng.integers(5)
        if action == 0:
            put(node, float(rng.uniform(0.1, 1.0)))
        elif action == 1 and frame > 20:
            node.delete()
        elif action == 2:
            put(node["below"])
            show(node, bool(rng.integers(2)))
        else:
            node.set_transform(place(rng.uniform()))
            mover(node["below"])(place(rng.uniform()))
        window.commit()
        fast.look()
        if frame % 17 == 0:
            slow.look()
    late = Browser(window).look()
    slow.look()
    for other in (slow, late):
        assert other.objects == fast.objects
        assert other.matrices.keys() == fast.matrices.keys()
        for name, matrix in fast.matrices.items():
            np.testing.assert_array_equal(other.matrices[name], matrix)


def test_a_scene_that_is_drawn_anew_again_and_again_does_not_grow(window, canvas):
    for _ in range(50):
        canvas["shells"].delete()
        for k in range(10):
            put(canvas["shells"][f"s{k}"])
            mover(canvas["shells"][f"s{k}"])(place(k))
        window.commit()
    commands = Browser(window).look().log
    assert len(commands) == 12  # one delete, ten objects, one move
    assert len(commands[-1]["paths"]) == 10
