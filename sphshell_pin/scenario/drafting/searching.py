"""A search for a draft that works: one after the other is written and run, until one does."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.texts import counted
from sphshell_pin.dynamics.scene.joint_components import JointComponents
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.clearance import Links
from sphshell_pin.scenario.drafting.draft_text import draft_text
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.plan import Hold, Plan, Press
from sphshell_pin.scenario.drafting.trial import Fault, try_out
from sphshell_pin.scenario.format.bodies import joint_spans
from sphshell_pin.scenario.format.build import Built, build_scenario, explain_built
from sphshell_pin.scenario.format.reading import parse_scenario
from sphshell_pin.scenario.format.sliders import check_knobs

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.explain import Explanation

_DOES = {Press: "presses on", Hold: "stands on", type(None): "falls on"}


@dataclass(frozen=True)
class NewScenario:
    """A scenario that works, and why it is as it is."""

    path: Path
    text: str
    built: Built
    explanation: Explanation
    """Explanation of the start, see Scene.explain."""
    why: tuple[str, ...]
    """One sentence for each choice that was made for the user."""
    part: str
    """The URDF of the free part that a hand holds, beside the scenario; "" without one."""


class CannotStand(SphshellError):
    """The robot floats, and its feet do not hold it on this surface, for this `reason`."""

    def __init__(self, said: str, reason: str) -> None:
        super().__init__(said)
        self.reason = reason


class CannotReach(SphshellError):
    """The tip of a limb, on `frame`, cannot press, or links would be in the part wherever it does.

    `others` are frames at the ends of other limbs, `out` is a tip farther out of the limb.
    """

    def __init__(
        self, said: str, frame: str, others: Sequence[str], out: Tip | None = None
    ) -> None:
        super().__init__(said)
        self.frame, self.others, self.out = frame, others, out


class Search(ABC):
    """What is searched with: robot and surface as built, the tips, and the scenario's `file`."""

    def __init__(self, asked: Asked, built: Built, tips: Sequence[Tip], file: Path) -> None:
        self.asked, self.built, self.tips, self.file = asked, built, tuple(tips), file
        (self.section,), (self.shell,) = built.scenario.robot, built.shells.values()
        self.model, self.q0 = built.assembly.model, built.assembly.q0
        self.faults: list[Fault] = []
        """What failed in each draft that was run."""

    def find(self) -> NewScenario:
        """Return the first draft that works.

        Raises
        ------
        SphshellError
            None does; the text says what fails and what to change.
        """
        for plan in self.drafts():
            made = self._run(plan)
            if made is not None:
                return made
        raise self.refusal()

    @abstractmethod
    def drafts(self) -> Iterator[Plan]:
        """Yield what is run next: the last of `faults` says what failed in the last draft."""

    @abstractmethod
    def refusal(self) -> SphshellError:
        """Return the error that says why no draft works, and what to change."""

    def hold_links(self, tips: Sequence[Tip], lock: Sequence[str], q: Array | None = None) -> Links:
        """Have the robot's links held against the surface."""
        geometry = self.built.assembly.loaded[0].collision_model
        self.held = Links(self.model, geometry, self.shell, tips, lock, q)
        return self.held

    def _run(self, plan: Plan) -> NewScenario | None:
        """Write a draft and run it; None where it fails, as the last of the `faults` says."""
        loaded, (shell,) = self.built.assembly.loaded[0], self.built.scenario.shell
        does = "holds" if plan.part else _DOES[type(plan.control)]
        title = f"{loaded.name} {does} {shell.name}"
        if loaded.assumed:
            title += f", its missing inertias from its geometry at {self.section.density:g} kg/m^3"
        # What the model states of the joints that move is modeled.
        kinds = JointComponents.from_model(self.model).without(plan.lock).kinds()
        home, at = coordinates(self.model, self.q0), coordinates(self.model, plan.q)
        section = self.section.model_copy(
            update={
                "lock": list(plan.lock),
                "joints": [kind for kind in kinds if kind != "effort" or not plan.weak],
                "start": {name: at[name] for name in at if at[name] != home[name]},
                "label": "hand" if plan.part else None,
            }
        )
        text = draft_text(self.file.stem, title, section, shell, plan)
        scenario = parse_scenario(text, self.file)
        check_knobs(scenario, self.file, ranges=True)
        known = plan.part.beside(self.built, self.file.stem) if plan.part else self.built
        try:
            built = build_scenario(scenario, self.file, known)
            fault = try_out(built, plan, self.held)
        except SphshellError as error:
            fault = Fault("run", str(error))
        if fault is None:
            why, part = (*plan.why, plan.contact.note), plan.part.urdf() if plan.part else ""
            return NewScenario(self.file, text, built, explain_built(built), why, part)
        self.faults.append(fault)
        if self.asked.tell is not None:
            self.asked.tell(f"tried, run {len(self.faults)}: {fault.text}")
        return None

    def failed(self) -> str:
        """Say what failed in the last draft."""
        fault = self.faults[-1]
        when = f" at t = {fault.t:.2g} s" if fault.link else ""
        return f"no draft works ({counted(len(self.faults), 'run')}): {fault.text}{when}"


def coordinates(model: pin.Model, q: Array) -> dict[str, float | list[float]]:
    """Return the coordinates of each joint, from q (nq,), as a scenario states them."""
    found: dict[str, float | list[float]] = {}
    for name in list(model.names)[1:]:
        values = [round(float(one), 9) for one in q[joint_spans(model, name)[0]]]
        found[name] = values[0] if len(values) == 1 else values
    return found
