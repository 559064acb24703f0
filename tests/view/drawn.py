"""What is drawn in a window, as those who look at it have it."""

import meshcat
import numpy as np

from sphshell_pin.view.page import FilmWindow


class Film:
    """A canvas, and what was drawn on it, by paths below /meshcat/."""

    def __init__(self):
        self.window = FilmWindow()
        self.canvas = meshcat.Visualizer(window=self.window)

    def _told(self, kind):
        for command in self.window.commands(np.array([0.0, 1.0])):
            if command["type"] == kind:
                yield command["path"].removeprefix("/meshcat/"), command

    @property
    def matrices(self):
        """Where the nodes are (4, 4)."""
        told = self._told("set_transform")
        return {path: np.reshape(command["matrix"], (4, 4)).T for path, command in told}

    @property
    def objects(self):
        return {path: command["object"] for path, command in self._told("set_object")}

    @property
    def visible(self):
        """Whether nodes are shown, of those of which it was told."""
        told = self._told("set_property")
        return {path: one["value"] for path, one in told if one["property"] == "visible"}


def attribute(drawn, name="position"):
    """An attribute (n, 3) of the vertices of an object."""
    data = drawn["geometries"][0]["data"]["attributes"][name]["array"].data
    return np.frombuffer(data, "<f4").reshape(-1, 3)
