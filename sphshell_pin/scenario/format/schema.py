"""What a scenario file may say: one pydantic model per table; unknown keys are refused.

SI throughout: m, kg, s, N, rad, except where a key's name says `_deg`, and except for a surface
file's own length `unit`. Names refer to joints and frames of the assembled model: as the robot has
them when it stands alone, `robot/name` as soon as there are several robots.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias, cast

import pydantic

from sphshell_pin.base.parameters import Component, Parameter, parameters_of
from sphshell_pin.contact import Friction as FrictionLaw
from sphshell_pin.contact import NormalLaw
from sphshell_pin.contact.friction import NoFriction
from sphshell_pin.dynamics.control import controllers
from sphshell_pin.dynamics.control.controllers import NoController
from sphshell_pin.dynamics.run.integrators import Adaptive, Integrator, SemiImplicitEuler
from sphshell_pin.dynamics.sensing import sensors
from sphshell_pin.scenario.format import shape_tables

LISTS = ("robot", "joint", "shell", "contact", "source", "sensor", "knob")
"""Tables of which there may be several."""

TIP_AT = "tip_at"
"""Key of a robot's start that states where its tip is, beside those of its joints."""

NotNegative = Annotated[float, pydantic.Field(ge=0, allow_inf_nan=False)]
Count = Annotated[int, pydantic.Field(ge=3)]


class Section(pydantic.BaseModel):
    """A table of the file: frozen; unknown keys are refused."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @pydantic.model_validator(mode="before")
    @classmethod
    def check_keys(cls, data: object) -> object:
        """Refuse an unknown key first: it often hides a missing one ("stifness")."""
        if isinstance(data, Mapping):
            shape_tables.refuse_unknown_keys(data, list(cls.model_fields))
        return data


class Placement(Section):
    """A placement in a reference frame: first rolled, pitched, yawed, then moved."""

    xyz: Annotated[shape_tables.Vector3, Parameter("m")] = [0.0, 0.0, 0.0]
    rpy_deg: Annotated[shape_tables.Vector3, Parameter("deg")] = [0.0, 0.0, 0.0]


class TipAt(Section):
    """Where a robot's tip is at the start: a point of a frame, found by inverse kinematics."""

    xyz: shape_tables.Vector3
    frame: str | None = None
    offset: shape_tables.Vector3 = [0.0, 0.0, 0.0]
    along: shape_tables.Vector3 | None = None


def _start_kind(value: object) -> str:
    return "tip" if isinstance(value, dict | TipAt) else "joint"


StartValue: TypeAlias = Annotated[
    Annotated[float | list[float], pydantic.Tag("joint")] | Annotated[TipAt, pydantic.Tag("tip")],
    pydantic.Discriminator(_start_kind),
]


class RobotSection(Section):
    """A robot or a single body: shipped (`name`) or your own (`file`; `urdf` is the same key)."""

    name: str | None = None
    file: str | None = None
    urdf: str | None = None
    package_dirs: list[str] = []
    xacro_args: dict[str, bool | int | float | str] = {}
    density: shape_tables.Positive | None = None
    srdf: str | None = None
    pose: str | None = None
    base: Literal["fixed", "floating"] | None = None
    free_flyer: bool = False
    mimic: bool = True
    label: str | None = None
    frame: str = "universe"
    placement: Placement = Placement()
    lock: list[str] = []
    compiled: bool = False
    joints: list[Literal["limits", "damping", "friction", "armature", "effort", "speed"]] = []
    q: list[float] | None = None
    start: dict[str, StartValue] = {}
    speed: dict[str, float | list[float]] = {}

    @pydantic.model_validator(mode="after")
    def check_one_source(self) -> RobotSection:
        """Refuse a robot with no description, or with two."""
        if sum(one is not None for one in (self.name, self.file, self.urdf)) != 1:
            raise ValueError(
                "give either name (a shipped robot) or file (a URDF, xacro or MJCF; urdf is the "
                "same key), not both"
            )
        of_files = ("package_dirs", "xacro_args", "density", "srdf")
        beside = [key for key in of_files if getattr(self, key)]
        if self.name is not None and beside:
            raise ValueError(f"{' and '.join(beside)} belong to a file; drop them beside name")
        if self.free_flyer and self.base is not None:
            raise ValueError('free_flyer = true is base = "floating": state base alone')
        for name, value in self.start.items():
            if isinstance(value, TipAt) and name != TIP_AT:
                raise ValueError(
                    f"start.{name} takes numbers; the table of a tip is start.{TIP_AT}"
                )
        at = self.start.get(TIP_AT)
        listed = isinstance(at, list) and len(at) == 3
        if at is not None and not isinstance(at, TipAt) and not listed:
            raise ValueError(f"start.{TIP_AT} must be [x, y, z] or a table {{ xyz, frame, ... }}")
        return self

    @property
    def joint_start(self) -> dict[str, float | list[float]]:
        """The stated start of joints."""
        return {
            name: value
            for name, value in self.start.items()
            if name != TIP_AT and not isinstance(value, TipAt)
        }

    @property
    def tip_start(self) -> TipAt | None:
        """The stated start of the tip."""
        at = self.start.get(TIP_AT)
        return TipAt(xyz=at) if isinstance(at, list) else at if isinstance(at, TipAt) else None

    @property
    def path(self) -> str | None:
        """The robot's file, or None for a shipped robot."""
        return self.file if self.file is not None else self.urdf

    @property
    def floats(self) -> bool | None:
        """Whether the base floats; None: as the file states it."""
        return True if self.free_flyer else None if self.base is None else self.base == "floating"


_OF_FILES = {
    ("unit", "scale"): "a file; a primitive's sizes are in meters",
    ("bodies", "faces"): "a CAD file, not to a primitive",
    ("time_limit", "memory_limit"): "a CAD file, not to a primitive",
}


class ShellSection(Section):
    """A surface: a file beside the scenario, or a primitive."""

    name: str
    file: str | None = None
    unit: str | None = None
    scale: Literal["apply", "ignore"] | shape_tables.Positive | None = None
    primitive: (
        Annotated[shape_tables.Primitive, shape_tables.OneOf(shape_tables.Primitive)] | None
    ) = None
    chord_error: shape_tables.Positive | None = None
    bodies: Annotated[list[str], pydantic.Field(min_length=1)] | None = None
    faces: Annotated[list[str | int], pydantic.Field(min_length=1)] | bool | None = None
    time_limit: shape_tables.Positive | None = None
    memory_limit: shape_tables.Positive | None = None
    segments: Count | None = None
    magnify: shape_tables.Positive = 1.0
    side: Literal["both", "outside", "inside"] = "both"
    crease_angle_deg: Annotated[float, pydantic.Field(ge=0, le=180)] = 30.0
    frame: str = "universe"
    placement: Placement = Placement()

    @pydantic.model_validator(mode="after")
    def check_one_source(self) -> ShellSection:
        """Refuse a shell with no surface or two, and keys that its kind does not read."""
        if (self.file is None) == (self.primitive is None):
            raise ValueError("give either file or primitive, not both")
        for keys, why in _OF_FILES.items():
            if self.file is None and any(getattr(self, key) is not None for key in keys):
                raise ValueError(f"{' and '.join(keys)} belong to {why}")
        if self.file is not None and self.segments is not None:
            raise ValueError("segments belong to a primitive, not to a file")
        return self


Law = Annotated[Component, shape_tables.OneOf(NormalLaw)]
Friction = Annotated[Component, shape_tables.OneOf(FrictionLaw)]


class JointSection(Section):
    """What acts in one joint, in place of what the robot's file states: see JointComponents."""

    name: str
    lower: Annotated[float | None, Parameter("rad or m", "lower end")] = None
    upper: Annotated[float | None, Parameter("rad or m", "upper end")] = None
    stop: Law | None = None
    damping: Annotated[NotNegative | None, Parameter("N m s/rad", "joint damping")] = None
    friction: Annotated[shape_tables.Positive | None, Parameter("N m", "dry friction")] = None
    friction_stiffness: Annotated[
        shape_tables.Positive | None, Parameter("N m/rad", "sticking stiffness")
    ] = None
    friction_damping: Annotated[NotNegative | None, Parameter("N m s/rad")] = None
    armature: Annotated[NotNegative | None, Parameter("kg m^2", "armature")] = None
    effort: Annotated[NotNegative | None, Parameter("N m", "effort limit")] = None
    speed: Annotated[shape_tables.Positive | None, Parameter("rad/s", "speed limit")] = None

    @pydantic.model_validator(mode="after")
    def check_friction(self) -> JointSection:
        """Refuse a spring of dry friction without the friction."""
        alone = self.friction_stiffness is not None or self.friction_damping is not None
        if self.friction is None and alone:
            raise ValueError("friction_stiffness and friction_damping belong to friction: give it")
        return self


class SphereSection(Section):
    """The sphere of a contact: `radius` [m], center `offset` [m] in the robot's `frame`."""

    frame: str
    radius: Annotated[shape_tables.Positive, Parameter("m", "sphere radius")]
    offset: Annotated[shape_tables.Vector3, Parameter("m", "sphere offset")] = [0.0, 0.0, 0.0]


class PlaneSection(Section):
    """The plane of a contact, through `offset` [m] in `frame`; `normal` leads out of the solid."""

    frame: str
    offset: shape_tables.Vector3 = [0.0, 0.0, 0.0]
    normal: shape_tables.Vector3 = [0.0, 0.0, 1.0]


Spheres = Annotated[list[SphereSection | str], pydantic.Field(min_length=1)]


class ContactSection(Section):
    """A sphere, or several, that may touch a shell or another sphere; or a plane and a shell."""

    name: str
    sphere: SphereSection | None = None
    spheres: Literal["collision"] | Spheres | None = None
    plane: PlaneSection | None = None
    shell: str | None = None
    other_sphere: SphereSection | None = None
    method: Annotated[Literal["facets", "smooth", "elements"] | None, Parameter(label="method")] = (
        None
    )
    law: Law
    friction: Friction = NoFriction()

    @pydantic.model_validator(mode="after")
    def check_ends(self) -> ContactSection:
        """Refuse a contact that lacks one of its two bodies, or has too many."""
        given = [one for one in (self.sphere, self.spheres, self.plane) if one is not None]
        if len(given) != 1:
            raise ValueError("give either sphere (one), spheres (several) or plane, one of them")
        if (self.shell is None) == (self.other_sphere is None):
            raise ValueError("give either shell (its name) or other_sphere, not both")
        if self.plane is not None and self.other_sphere is not None:
            raise ValueError("a plane touches a shell: give shell (its name), not other_sphere")
        if self.other_sphere is not None and self.method is not None:
            raise ValueError("method belongs to a shell; drop it beside other_sphere")
        return self


class SourceSection(Section):
    """Contact points that come out of the user's own routine, "file.py:function"."""

    name: str
    find: str
    frame_i: str
    frame_j: str = "universe"
    law: Law
    friction: Friction = NoFriction()


Controller = Annotated[Component, shape_tables.OneOf(controllers.Controller)]


Sensor = Annotated[Component, shape_tables.OneOf(sensors.Sensor)]


def _bounds(about: Parameter) -> object:
    return pydantic.Field(gt=about.above, ge=about.at_least, le=about.at_most)


# The parameters of all integrators, by name.
STEPPING = {
    name: about for kind in Integrator.kinds.values() for name, about in parameters_of(kind).items()
}
_keys: dict[str, Any] = {
    name: (Annotated[float | None, _bounds(about), about], None) for name, about in STEPPING.items()
}
_Stepping: Any = pydantic.create_model("_Stepping", __base__=Section, **_keys)


def _check_integrator(kind: str) -> str:
    if kind and kind not in Integrator.kinds:
        valid = [f"'{one}'" for one in Integrator.kinds]
        raise ValueError(f"should be {', '.join(valid[:-1])} or {valid[-1]}")
    return kind


class RunSection(_Stepping):  # type: ignore[misc]  # of the keys that the integrators have
    """How long and how finely to simulate [s]; `recording_speed` 0.1 films in slow motion.

    With `record = ["patch"]` the patch of each contact is recorded and drawn.

    The parameters of the integrator stand in this table; it is adaptive unless `dt` is given.
    """

    duration: Annotated[shape_tables.Positive, Parameter("s")]
    integrator: Annotated[str, pydantic.AfterValidator(_check_integrator)] = ""
    control_dt: Annotated[shape_tables.Positive | None, Parameter("s", "control period")] = None
    record_dt: Annotated[shape_tables.Positive | None, Parameter("s", "time between rows")] = None
    record: list[Literal["patch", "torque"]] = pydantic.Field(default_factory=list)
    recording_speed: Annotated[shape_tables.Positive, Parameter(label="speed of the recording")] = (
        1.0
    )

    @pydantic.model_validator(mode="after")
    def check_steps(self) -> RunSection:
        """Choose the integrator if none is given, and refuse what it does not take."""
        if not self.integrator:
            kind = Adaptive if self.dt is None else SemiImplicitEuler
            # Not as something that was set: it follows a change of dt.
            self.__dict__["integrator"] = kind.kind
        taken = parameters_of(Integrator.kinds[self.integrator])
        foreign = [name for name in STEPPING if name not in taken]
        wrong = [name for name in foreign if getattr(self, name) is not None]
        if wrong:
            others = [k for k, one in Integrator.kinds.items() if wrong[0] in parameters_of(one)]
            raise ValueError(
                f"{self.integrator} takes {' and '.join(taken)}, not {' and '.join(foreign)}: "
                f"leave {' and '.join(wrong)} out, or set run.integrator to {others[0]}"
            )
        return self

    def made(self) -> Integrator:
        """Return the integrator."""
        kind = Integrator.kinds[self.integrator]
        values = {name: getattr(self, name) for name in parameters_of(kind)}
        made = kind(**{k: v for k, v in values.items() if v is not None})
        return cast(Integrator, made)


class KnobSection(Section):
    """A number to turn while the scenario is looked at; what is left out follows from the key."""

    key: str
    label: str | None = None
    unit: str | None = None
    min: float | None = None
    max: float | None = None
    log: bool | None = None


class Expected(Section):
    """One expected figure: `value` within `rtol` (relative) plus `atol`, or a range."""

    value: float | None = None
    rtol: NotNegative = 0.0
    atol: NotNegative = 0.0
    min: float | None = None
    max: float | None = None

    @pydantic.model_validator(mode="after")
    def check_complete(self) -> Expected:
        """Refuse an expectation that nothing or everything fulfils."""
        ranged = self.min is not None or self.max is not None
        if (self.value is None) != ranged:
            raise ValueError("give either value (with rtol, atol) or min and/or max")
        if self.value is not None and self.rtol == 0.0 and self.atol == 0.0:
            raise ValueError("give rtol or atol beside value: a simulated figure is never exact")
        return self

    def met_by(self, measured: float) -> bool:
        """Whether `measured` is what was expected."""
        if self.value is not None:
            return abs(measured - self.value) <= self.rtol * abs(self.value) + self.atol
        low = self.min is None or measured >= self.min
        return low and (self.max is None or measured <= self.max)

    def __str__(self) -> str:
        """As a table shows it."""
        if self.value is not None:
            return f"{self.value:.6g} +- {self.rtol * abs(self.value) + self.atol:.2g}"
        if self.min is None:
            return f"<= {self.max:.6g}"
        if self.max is None:
            return f">= {self.min:.6g}"
        return f"{self.min:.6g} to {self.max:.6g}"


class Scenario(Section):
    """A whole scenario file."""

    title: str
    description: str = ""
    gravity: Annotated[shape_tables.Vector3, Parameter("m/s^2", "gravity")] = [0.0, 0.0, -9.81]
    robot: Annotated[list[RobotSection], pydantic.Field(min_length=1)]
    joint: list[JointSection] = []
    shell: list[ShellSection] = []
    contact: list[ContactSection] = []
    source: list[SourceSection] = []
    sensor: list[Sensor] = []
    controller: Controller = NoController()
    run: RunSection
    knob: list[KnobSection] = []
    figures: dict[str, str] = {}
    expect: dict[str, Expected] = {}

    @pydantic.model_validator(mode="before")
    @classmethod
    def take_single_tables(cls, data: object) -> object:
        """Read `[robot]` as the list of one that `[[robot]]` would have been."""
        if not isinstance(data, dict):
            return data
        return {k: [v] if k in LISTS and isinstance(v, dict) else v for k, v in data.items()}
