"""What a run leaves behind: motion, contact log, events and the energy audit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import ArrayLike

from sphshell_pin.base import upward
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_finite, read_only
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.dynamics.result import result_columns, result_parts
from sphshell_pin.dynamics.result.run_stats import EventKind, RunStats
from sphshell_pin.dynamics.scene.joint_components import moving_joints
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.scene.scene_contacts import Columns, columns
from sphshell_pin.dynamics.sensing.sensor_log import SensorLog, sensor_columns
from sphshell_pin.errors import InvalidParameter, ResultError, import_extra

if TYPE_CHECKING:
    import pandas as pd
    import pinocchio as pin
    from matplotlib.figure import Figure

    from sphshell_pin.dynamics.run.sensitivities import Sensitivities
    from sphshell_pin.dynamics.sensing.sensors import SensorSet
    from sphshell_pin.view.recording import RecordingView


EVENT_KINDS = get_args(EventKind)


@dataclass(frozen=True, repr=False)
class Result(Summarized):
    """A finished run.

    `t` (n,) [s], `q` (n, nq), `v` (n, nv) at the recorded rows; `pairs` the names of the contact
    pairs; `contacts` the contact log; `events` in order of time; `energy` the audit; `stats`
    its cost, and figures of each pair over all steps; `scene` that ran
    (None after load); `origin` the scenario it came from (None without one); `sensors` the readings
    of each sensor by its name; `patch_rows` the patches of the contacts, None where they were not
    recorded (see `patches`); `sensitivities` how the rows change with parameters and the start,
    None where this was not asked for; `torque` (n, nv) the controller's torques, cut to their
    limits [N m or N], None unless the run recorded them: nan where a torque that is held was not
    known yet;
    `states` what the run can go on from at each row (see `at`), None unless they were recorded.
    """

    t: Array
    q: Array
    v: Array
    pairs: tuple[str, ...]
    contacts: result_parts.ContactLog
    events: tuple[result_parts.Event, ...]
    energy: result_parts.EnergyAudit
    stats: RunStats
    scene: Scene | None = None
    origin: result_parts.Origin | None = None
    sensors: Mapping[str, SensorLog] = field(default_factory=dict)
    patch_rows: result_parts.Patches | None = None
    sensitivities: Sensitivities | None = None
    torque: Array | None = None
    states: tuple[Array, ...] | None = None

    def at(self, t: float) -> result_parts.RunState:
        """Return the state of the last step that was accepted by the last row at or before t [s].

        `Simulation.run(result.at(t))` makes the rest of the run again, to the same bits, with the
        same integrator and a controller that depends on the state alone. The state is that of the
        row itself where steps end at rows: those of fixed steps, and the first one.

        Raises ResultError where the run was not asked for states: run(..., record=("state",)).
        """
        if self.states is None:
            said = "has no states, as the run was not asked for them: run(..., record=('state',))"
            raise ResultError("the result", said)
        row = int(np.searchsorted(self.t, check_finite("t", t), side="right")) - 1
        if row < 0:
            raise InvalidParameter("t", t, f"must not be before the first row: {self.t[0]} s")
        return result_parts.RunState.from_values(self.states[row], self.q.shape[1], self.v.shape[1])

    def _facts(self) -> list[Fact]:
        pairs = self.stats.pairs.values()
        return [
            Fact("simulated", self.stats.duration, "s"),
            Fact("rows", len(self.t)),
            Fact("contact pairs", len(self.pairs)),
            Fact("touches", sum(one.touches for one in pairs), one="touch"),
            Fact("peak force", max((one.peak_force for one in pairs), default=0.0), "N"),
            Fact("energy residual", float(self.energy.residual[-1]) if len(self.t) else 0.0, "J"),
        ]

    @classmethod
    def _from_record(
        cls,
        whole: Columns,
        pairs: tuple[str, ...],
        stats: RunStats,
        scene: Scene,
        sensors: SensorSet,
    ) -> Result:
        """Build from the rows that the core has recorded."""
        row = read_only(whole["contact_row"].astype(np.int64))
        log = {**columns(whole["contacts"]), "t": read_only(whole["t"][row]), "row": row}
        energies = read_only(whole["energy"]).T
        owners, patches = _owners(pairs, scene), whole.get("patches")
        events = tuple(
            result_parts.Event(float(t), owners[EVENT_KINDS[kind]][number], EVENT_KINDS[kind])
            for t, number, kind in zip(
                whole["event_t"], whole["event_pair"], whole["event_kind"], strict=True
            )
        )
        return cls(
            t=read_only(whole["t"]),
            q=read_only(whole["q"]),
            v=read_only(whole["v"]),
            pairs=pairs,
            contacts=result_parts.ContactLog(**log),
            events=events,
            energy=result_parts.EnergyAudit(*energies),
            stats=stats,
            scene=scene,
            sensors=sensors.logs(whole),
            patch_rows=None
            if patches is None
            else read_only(np.frombuffer(patches, result_parts.PATCH)),
            torque=read_only(whole["torques"]) if "torques" in whole else None,
            states=result_parts.split_states(whole.get("states"), whole.get("state_sizes")),
        )

    @property
    def patches(self) -> result_parts.Patches:
        """The patch of each contact of `contacts`, in the same order: a structured array (m,).

        Its fields: `half_axes` (2,) a >= b [m], `axis_world` (3,) direction of a, `peak_pressure`
        and `mean_pressure` [Pa], `approach` [m].

        Raises ResultError where they were not recorded.
        """
        if self.patch_rows is None:
            raise ResultError(
                "the result",
                "has no patches, as the run was not asked for them: "
                "run(..., record=('patch',)), or record = ['patch'] in [run] of the scenario",
            )
        return self.patch_rows

    def save(self, path: StrPath, *, home: StrPath | None = None) -> Path:
        """Write a compressed .npz file, whole or not at all.

        It has the robots and surfaces of a scenario, to show them, but no scene of one's own. The
        path of a scenario is written relative to the folder `home`, where the results will stay
        (default: that of `path`).
        """
        from sphshell_pin.dynamics.result.result_file import save_result

        return save_result(self, Path(path), home)

    @classmethod
    def load(cls, path: StrPath, *, max_size: float = 2e9) -> Result:
        """Read what save() wrote; nothing in the file is ever executed.

        `max_size` is the memory that its arrays may need [B]: a small file may hold large ones.

        Raises
        ------
        ResultError
            The file cannot be read, or is not what save() writes: the text says which part of it.
        """
        from sphshell_pin.dynamics.result.result_file import load_result

        return load_result(cls, path, max_size)

    def to_dataframe(self) -> pd.DataFrame:
        """Return the contact log as a pandas DataFrame, one row a contact, units in the names.

        Raises MissingExtra without pandas.
        """
        pandas = import_extra("pandas", "tables", "Result.to_dataframe")
        return pandas.DataFrame(self.contact_columns())

    def row_columns(self, scene: Scene | None = None) -> dict[str, Array]:
        """Return the rows as named scalar columns, units in the names (for CSV, tables).

        They are t, q and v by joint (q.JOINT, and q.JOINT.0, ... of a joint with several numbers),
        and of each pair the sum of the normal forces, the size of that of the friction forces, the
        total force on the sphere in the world and the largest depth, zero without contact. `scene`
        names the joints (default: the one that ran); without any, coordinates are q.0, q.1, ...
        without units.
        """
        return result_columns.row_columns(self, self.scene if scene is None else scene)

    def contact_columns(self) -> dict[str, ArrayLike]:
        """Return the contact log as named scalar columns, units in the names (for CSV, tables)."""
        return result_columns.contact_columns(self)

    def event_columns(self) -> dict[str, ArrayLike]:
        """Return the events as named columns (for CSV, tables)."""
        return result_columns.event_columns(self)

    def energy_columns(self) -> dict[str, Array]:
        """Return the energy audit, and its residual, as named columns (for CSV, tables)."""
        return result_columns.energy_columns(self)

    def sensor_columns(self) -> dict[str, Array]:
        """Return the readings of all sensors as columns, units in the names (for CSV, tables).

        One row for each time at which a reading arrived; nan where another sensor has none.
        """
        return sensor_columns(self.sensors)

    def to_mcap(self, path: StrPath, scene: Scene | None = None, *, start: int = 0) -> Path:
        """Write the run as an MCAP file of ROS 2 messages, for Foxglove, RViz and rosbag2.

        `scene` is what moved (default: the one that ran, or that of the scenario the result came
        from), `start` the time stamp of t = 0 [ns since 1970]. The topics are those of the page
        "Out to other tools" (docs/export.md); the file is written whole or not at all.

        Raises ResultError without a scene, for a time before 1970 and where the file cannot be
        written, MissingExtra without mcap.
        """
        return upward.layers.write_mcap(path, self, scene, start=start)

    def plot(self, kind: str = "overview", scene: Scene | None = None) -> Figure:
        """Return a figure, which a notebook shows.

        `kind` is "overview" (forces, depth and energy over time), "force" (force and depth of each
        pair), "energy" (the audit), "sensors" (their readings) or "map" (the path on the shells,
        and the impulse that each element took). The map needs a scene: `scene`, or the one that
        ran, or that of the scenario the result came from.

        Raises NameNotFound for another kind, MissingExtra without matplotlib, ResultError where
        there is no scene for the map or it cannot be built again.
        """
        return upward.layers.plot_result(self, kind, scene)

    def save_figures(self, folder: StrPath, scene: Scene | None = None) -> list[Path]:
        """Write the figures as .png files into `folder`; see `sphshell_pin.plot.save_figures`."""
        return upward.layers.save_figures(self, folder, scene)

    def view(
        self,
        scene: Scene | None = None,
        visual_model: pin.GeometryModel | None = None,
        *,
        speed: float | None = None,
        height: int = 480,
        title: str | None = None,
    ) -> RecordingView:
        """Return the recording of this result, which a notebook shows `height` [pixels] high.

        It is drawn in `scene` (default: the one that ran, or that of the scenario the result came
        from) with `visual_model` (a pinocchio.GeometryModel, default: the scenario's; without one
        the joints are drawn). `speed` seconds of simulated time pass in one second (default: as the
        scenario has it, or 1), `title` is its heading. `.save(path)` writes the page.

        Raises ResultError without a scene, MissingExtra without meshcat.
        """
        return upward.layers.view_result(
            self, scene, visual_model, speed=speed, height=height, title=title
        )

    def render(
        self,
        path: StrPath,
        scene: Scene | None = None,
        visual_model: pin.GeometryModel | None = None,
        **options: Any,
    ) -> Path:
        """Draw this result as a picture (.png) or a film (.mp4).

        `scene` and `visual_model` are as in `view`; the options are those of
        `sphshell_pin.view.film.render_film`, among them `time` of a picture and `span` of a film
        [s], `size` [pixels] and `camera`. Returns the path.

        Raises what `render_film` does: MissingExtra without playwright, ResultError without
        Chromium.
        """
        return upward.layers.render_film(path, self, scene, visual_model, **options)


def _owners(pairs: tuple[str, ...], scene: Scene) -> dict[str, tuple[str, ...]]:
    """Return the names that the numbers of events stand for, by the kind of the event."""
    if not scene.joints.kinds():
        return dict.fromkeys(EVENT_KINDS, pairs)
    model = scene.model
    stops = scene.joints.stopped_joints(model)
    velocities = tuple(name for name, joint in moving_joints(model) for _ in range(joint.nv))
    owners = [pairs] * 5 + [stops] * 2 + [velocities] * 4
    return dict(zip(EVENT_KINDS, owners, strict=True))
