"""What browsers do to a run with the mouse: drag bodies, move the targets of joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.dynamics.models import find_frame
from sphshell_pin.errors import NameNotFound
from sphshell_pin.view.live.events import BadMessage, Client, Event
from sphshell_pin.view.live.picture import Picture
from sphshell_pin.view.live.player import Interactive
from sphshell_pin.view.live.window import LiveWindow
from sphshell_pin.view.nodes import Json

if TYPE_CHECKING:
    from sphshell_pin.scenario.drag import Dragged
    from sphshell_pin.view.live.player import Player

G = 9.81
# Of the width of the picture: how far a free body hangs below the cursor, of the spring unless the
# user chooses another one.
SAG = 0.05
NOT_HERE = "this run cannot be dragged or aimed: it is a finished one, or its player cannot"


class Hands:
    """Hands the wishes of browsers to `player`, where it is Interactive; one drags at a time."""

    def __init__(self, player: Player, picture: Picture, window: LiveWindow | None) -> None:
        self._player = player if isinstance(player, Interactive) else None
        self._picture = picture
        # Where the picture is in a window of others, nothing is known of the mouse.
        self._window = window
        self._dragger: Client | None = None

    @property
    def dragging(self) -> bool:
        """Whether a browser drags a body."""
        return self._dragger is not None

    @property
    def drag(self) -> Dragged | None:
        """What is dragged now."""
        if self._player is None or self._dragger is None:
            return None
        return self._player.drag

    @property
    def can_record_patches(self) -> bool:
        """Whether patches of contacts can be had."""
        return self._player is not None and self._player.can_record_patches

    def offer(self) -> Json:
        """Return what there is to do, for the first message to a browser."""
        drag = None
        if self._player is not None and self._window is not None:
            stiffness = float(f"{G / (SAG * self._picture.view.distance):.2g}")
            drag = {"nodes": self._picture.display.grips(), "stiffness": stiffness}
        targets = () if self._player is None else self._player.targets
        names = ("joint", "rotates", "low", "high", "limited", "value")
        return {
            "drag": drag,
            "targets": [{name: getattr(one, name) for name in names} for one in targets],
        }

    def state(self) -> Json:
        """Return what is done now, for the panel."""
        drag, targets = self.drag, () if self._player is None else self._player.targets
        return {
            "targets": {one.joint: one.value for one in targets},
            "drag": drag
            and {
                "body": drag.frame,
                "newtons": float(np.linalg.norm(drag.force_world)),
                "target": drag.target_world,
            },
        }

    def do(self, client: Client, event: Event) -> None:
        """Drag a body, or move the target of a joint."""
        if self._player is None:
            raise BadMessage(NOT_HERE)
        if event["type"] == "target":
            self._player.aim(event["joint"], event["value"])
        else:
            self._pull(self._player, client, event)

    def _pull(self, player: Interactive, client: Client, event: Event) -> None:
        """Drag the body of a node by a point of the node towards a target."""
        window = self._window
        grips = self._picture.display.grips()
        frame = grips.get(event["node"])
        matrix = None if window is None else window.matrix(event["node"])
        if frame is None or matrix is None:
            raise NameNotFound("body to drag", event["node"], "the picture", grips)
        model, data = self._picture.display.scene.model, self._picture.display.data
        where = model.frames[find_frame(model, frame)]
        # Seen from the body, the point is where the picture of now has it.
        seen = matrix[:3, :3] @ np.array(event["point"]) + matrix[:3, 3]
        point = (data.oMi[where.parentJoint] * where.placement).actInv(seen)
        player.pull(frame, point, np.array(event["target"]), event["stiffness"])
        self._dragger = client

    def release(self, client: Client) -> None:
        """End the drag of a browser."""
        if self._player is not None and self._dragger is client:
            self._dragger = None
            self._player.release()

    def forget(self) -> None:
        """Drop the drag, as the run has started anew."""
        self._dragger = None

    def record_patches(self, on: bool) -> None:
        """Compute patches from now on, or no longer; where they were recorded, nothing is done."""
        if self._player is not None and self._player.can_record_patches:
            self._player.record_patches(on)
