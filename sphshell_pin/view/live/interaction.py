"""What browsers do to a run: push and drag bodies, move the targets of joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.errors import NameNotFound
from sphshell_pin.view.arrows import Forces
from sphshell_pin.view.live.events import BadMessage, Client, Event
from sphshell_pin.view.live.picture import Picture, frame_point
from sphshell_pin.view.live.player import Interactive
from sphshell_pin.view.live.window import LiveWindow
from sphshell_pin.view.nodes import Json

if TYPE_CHECKING:
    from sphshell_pin.scenario.live.acting import Dragged, Target
    from sphshell_pin.view.live.player import Player

G = 9.81
# Share of the width of the picture: how far a free body hangs below the cursor, of the spring
# unless the user chooses another one.
SAG = 0.05
NOT_HERE = "this run cannot be dragged or aimed: its player cannot"


class Interaction:
    """Passes pushes, drags and joint targets of browsers to `player`; one drags at a time."""

    def __init__(self, player: Player, picture: Picture, window: LiveWindow) -> None:
        self._player = player
        self._interactive = player if isinstance(player, Interactive) else None
        self._picture = picture
        self._window = window
        self._dragger: Client | None = None
        self._pushed: tuple[str, Array, float] | None = None  # until a time [s]

    @property
    def push(self) -> Forces | None:
        """The push of now."""
        if self._pushed is None or self._player.time > self._pushed[2]:
            self._pushed = None
            return None
        body, force, _ = self._pushed
        display = self._picture.display
        point = frame_point(display.scene.model, display.data, body)
        return None if point is None else Forces(point[None], force[None], np.zeros((1, 3)))

    @property
    def drag(self) -> Dragged | None:
        """What is dragged now."""
        if self._interactive is None or self._dragger is None:
            return None
        return self._interactive.drag

    @property
    def can_record_patches(self) -> bool:
        """Whether patches of contacts can be had."""
        return self._interactive is not None and self._interactive.can_record_patches

    def offer(self) -> Json:
        """Return what there is to do, for the first message to a browser."""
        drag = None
        if self._interactive is not None:
            stiffness = float(f"{G / (SAG * self._picture.view.distance):.2g}")
            drag = {"nodes": self._picture.display.grips(), "stiffness": stiffness}
        names = ("joint", "rotates", "low", "high", "limited", "value")
        targets = [{name: getattr(one, name) for name in names} for one in self._targets()]
        return {"drag": drag, "targets": targets}

    def state(self) -> Json:
        """Return what is done now, for the panel."""
        drag = self.drag
        return {
            "targets": {one.joint: one.value for one in self._targets()},
            "drag": drag
            and {
                "body": drag.frame,
                "newtons": float(np.linalg.norm(drag.force_world)),
                "target": drag.target_world,
            },
        }

    def _targets(self) -> tuple[Target, ...]:
        return () if self._interactive is None else self._interactive.targets

    def do(self, client: Client, event: Event) -> None:
        """Push or drag a body, or move the target of a joint."""
        match event["type"]:
            case "push":
                self._push(event)
            case "target":
                self._able().aim(event["joint"], event["value"])
            case "drag":
                self._pull(self._able(), client, event)

    def _push(self, event: Event) -> None:
        player, body = self._player, event["body"]
        if body not in player.bodies:
            raise NameNotFound("body to push", body, "this run", player.bodies)
        force = event["newtons"] * np.array(event["direction"])
        player.push(body, force, event["seconds"])
        self._dragger = None
        self._pushed = (body, force, player.time + event["seconds"]) if force.any() else None

    def _able(self) -> Interactive:
        if self._interactive is None:
            raise BadMessage(NOT_HERE)
        return self._interactive

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
        self._dragger, self._pushed = client, None

    def release(self, client: Client) -> None:
        """End the drag of a browser."""
        if self._interactive is not None and self._dragger is client:
            self._dragger = None
            self._interactive.release()

    def forget(self) -> None:
        """Drop what acts, as the run has started anew."""
        self._dragger = self._pushed = None

    def record_patches(self, on: bool) -> None:
        """Compute patches from now on, or no longer; where they were recorded, nothing is done."""
        if self._interactive is not None and self._interactive.can_record_patches:
            self._interactive.record_patches(on)
