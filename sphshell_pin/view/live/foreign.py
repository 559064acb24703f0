"""A picture in another meshcat window: fewer commands, as the sender waits for each answer."""

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view.nodes import Sent, Window, is_below

PERIOD = 1.0 / 30.0  # [s] between two frames


class ForeignWindow:
    """Hands commands on to `window`, a meshcat ViewerWindow; drops transforms that change nothing.

    Such a window answers every command, and the sender waits for the answer.
    """

    def __init__(self, window: Window) -> None:
        self._window = window
        self._matrices: dict[str, list[float]] = {}
        self._due = 0.0

    @property
    def url(self) -> str | None:
        """Where that window's own page is, where it has one."""
        url = getattr(self._window, "web_url", None)
        return url if isinstance(url, str) else None

    def due(self, now: float) -> bool:
        """Tell whether the next frame may be drawn at `now` [s], and count it as drawn."""
        if now < self._due:
            return False
        self._due = now + PERIOD
        return True

    def send(self, command: Sent) -> None:
        """Hand on one meshcat command."""
        data = command.lower()
        path = data.get("path", "")
        if data["type"] == "set_transform":
            if self._matrices.get(path) == data["matrix"]:
                return
            self._matrices[path] = data["matrix"]
        elif data["type"] == "delete":
            for one in [one for one in self._matrices if is_below(one, path)]:
                del self._matrices[one]
        self._window.send(command)


def window_of(visualizer: object) -> Window:
    """Return the window of a meshcat.Visualizer or a pinocchio MeshcatVisualizer."""
    inner = getattr(visualizer, "viewer", visualizer)
    window = getattr(inner, "window", None)
    if window is None or not callable(getattr(window, "send", None)):
        raise InvalidParameter(
            "visualizer",
            type(visualizer).__name__,
            "must be a meshcat.Visualizer, or a pinocchio MeshcatVisualizer after initViewer",
        )
    found: Window = window
    return found
