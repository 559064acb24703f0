"""What a scenario file may say: one pydantic model per table; unknown keys are refused.

SI throughout: m, kg, s, N, rad, except where a key's name says `_deg`, and except for a surface
file's own length `unit`. Names refer to joints and frames of the assembled model: as the robot has
them when it stands alone, `robot/name` as soon as there are several robots.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

Vector3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Lengths3 = Annotated[list[Positive], Field(min_length=3, max_length=3)]
LISTS = ("robot", "shell", "contact", "source", "knob")
"""Tables of which there may be several."""

NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=3)]


class Section(BaseModel):
    """A table of the file: frozen, and without room for keys nobody reads."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Placement(Section):
    """Where something stands in its reference frame: first rolled, pitched, yawed, then moved."""

    xyz: Vector3 = [0.0, 0.0, 0.0]
    rpy_deg: Vector3 = [0.0, 0.0, 0.0]


class RobotSection(Section):
    """A robot or a single body: shipped (`name`) or one's own (`urdf`)."""

    name: str | None = None
    urdf: str | None = None
    package_dirs: list[str] = []
    free_flyer: bool = False
    label: str | None = None
    placement: Placement = Placement()
    lock: list[str] = []
    q: list[float] | None = None
    start: dict[str, float | list[float]] = {}
    speed: dict[str, float | list[float]] = {}

    @model_validator(mode="after")
    def check_one_source(self) -> RobotSection:
        """Refuse a robot with no description, or with two."""
        if (self.name is None) == (self.urdf is None):
            raise ValueError("give either name (a shipped robot) or urdf (a file), not both")
        if self.name is not None and (self.package_dirs or self.free_flyer):
            raise ValueError("package_dirs and free_flyer belong to urdf; drop them beside name")
        return self


class Box(Section):
    """A box of edge lengths `size` [m], centred."""

    type: Literal["box"]
    size: Lengths3


class SphereSurface(Section):
    """A ball's surface [m], centred."""

    type: Literal["sphere"]
    radius: Positive


class Cylinder(Section):
    """A cylinder along z [m], centred."""

    type: Literal["cylinder"]
    radius: Positive
    length: Positive


class Capsule(Section):
    """A capsule along z [m], centred; `length` without its caps."""

    type: Literal["capsule"]
    radius: Positive
    length: Positive


class Cone(Section):
    """A cone along z [m], centred."""

    type: Literal["cone"]
    radius: Positive
    length: Positive


class Ellipsoid(Section):
    """An ellipsoid of the three half axes `radii` [m], centred."""

    type: Literal["ellipsoid"]
    radii: Lengths3


class HalfSpace(Section):
    """A square of edge length `extent` [m] in the plane z = 0, facing +z."""

    type: Literal["half-space"]
    extent: Positive = 10.0


Primitive = Annotated[
    Box | SphereSurface | Cylinder | Capsule | Cone | Ellipsoid | HalfSpace,
    Field(discriminator="type"),
]


class ShellSection(Section):
    """A surface: a file beside the scenario, or a primitive."""

    name: str
    file: str | None = None
    unit: str | None = None
    scale: Literal["apply", "ignore"] | Positive | None = None
    primitive: Primitive | None = None
    chord_error: Positive | None = None
    bodies: Annotated[list[str], Field(min_length=1)] | None = None
    faces: Annotated[list[str | int], Field(min_length=1)] | None = None
    time_limit: Positive | None = None
    memory_limit: Positive | None = None
    segments: Count | None = None
    magnify: Positive = 1.0
    side: Literal["both", "outside", "inside"] = "both"
    crease_angle_deg: Annotated[float, Field(ge=0, le=180)] = 30.0
    frame: str = "universe"
    placement: Placement = Placement()

    @model_validator(mode="after")
    def check_one_source(self) -> ShellSection:
        """Refuse a shell with no surface or two, and keys that its kind does not read."""
        if (self.file is None) == (self.primitive is None):
            raise ValueError("give either file or primitive, not both")
        if self.file is None and (self.unit is not None or self.scale is not None):
            raise ValueError("unit and scale belong to a file; a primitive's sizes are in metres")
        if self.file is None and (self.bodies is not None or self.faces is not None):
            raise ValueError("bodies and faces belong to a CAD file, not to a primitive")
        if self.file is None and (self.time_limit is not None or self.memory_limit is not None):
            raise ValueError("time_limit and memory_limit belong to a CAD file, not to a primitive")
        if self.file is not None and self.segments is not None:
            raise ValueError("segments belong to a primitive, not to a file")
        return self


class Impact(Section):
    """ADAMS's IMPACT with SI parameters [N/m^exponent, -, N s/m, m]."""

    type: Literal["impact"]
    stiffness: Positive
    exponent: Positive = 1.5
    damping: NotNegative = 0.0
    full_damping_depth: Positive = 1e-4


class Adams(Section):
    """IMPACT as an ADAMS model states it; the defaults are ADAMS's own."""

    type: Literal["adams"]
    k: Positive = 1e5
    e: Positive = 2.2
    c: NotNegative = 10.0
    d: Positive = 0.1
    units: str = "mm-N-s"


class Hertz(Section):
    """A ball of `radius` [m] on an elastic half-space; moduli [Pa], `speed` [m/s]."""

    type: Literal["hertz"]
    radius: Positive
    young_1: Positive
    poisson_1: Annotated[float, Field(gt=-1, le=0.5)]
    young_2: Positive
    poisson_2: Annotated[float, Field(gt=-1, le=0.5)]
    restitution: Annotated[float, Field(gt=0, le=1)] | None = None
    speed: Positive | None = None


class HuntCrossley(Section):
    """Hunt and Crossley's law [N/m^exponent, -, s/m]."""

    type: Literal["hunt-crossley"]
    stiffness: Positive
    exponent: Positive = 1.5
    dissipation: NotNegative = 0.0


Law = Annotated[Impact | Adams | Hertz | HuntCrossley, Field(discriminator="type")]


class NoFriction(Section):
    """A frictionless contact."""

    type: Literal["none"]


class Coulomb(Section):
    """ADAMS's two-velocity Coulomb friction [-, -, m/s, m/s]; the defaults are ADAMS's own."""

    type: Literal["coulomb"]
    mu_static: NotNegative = 0.3
    mu_dynamic: NotNegative = 0.1
    v_static: Positive = 0.1
    v_dynamic: Positive = 1.0


class Bristle(Section):
    """Friction that sticks: spring [N/m], damper [N s/m], Stribeck's speed [m/s]."""

    type: Literal["bristle"]
    mu_static: NotNegative
    mu_dynamic: NotNegative
    stiffness: Positive
    damping: NotNegative = 0.0
    v_stribeck: Positive = 0.01
    torsional: bool = False


Friction = Annotated[NoFriction | Coulomb | Bristle, Field(discriminator="type")]


class SphereSection(Section):
    """The sphere of a contact: `radius` [m], centre `offset` [m] in the robot's `frame`."""

    frame: str
    radius: Positive
    offset: Vector3 = [0.0, 0.0, 0.0]


class ContactSection(Section):
    """A sphere that may touch a shell."""

    name: str
    sphere: SphereSection
    shell: str
    method: Literal["facets", "smooth", "elements"] | None = None
    law: Law
    friction: Friction = NoFriction(type="none")


class SourceSection(Section):
    """Contact points that come out of the user's own routine, "file.py:function"."""

    name: str
    find: str
    frame_i: str
    frame_j: str = "universe"
    law: Law
    friction: Friction = NoFriction(type="none")


class NoController(Section):
    """No joint torques."""

    type: Literal["none"] = "none"


class GravityCompensationSection(Section):
    """Joint torques that carry the robot's weight, no more."""

    type: Literal["gravity-compensation"]


Gain = float | list[float] | dict[str, float]


class JointPDSection(Section):
    """A spring and a damper at every joint [N m/rad, N m s/rad], towards `q_ref`.

    A gain is one number for all motorised joints (not the free-flying bodies), a list of nv, or a
    table by joint; `q_ref` a list of nq or a table of joints that differ from the start.
    """

    type: Literal["joint-pd"]
    kp: Gain
    kd: Gain
    q_ref: list[float] | dict[str, float] | None = None
    gravity_compensation: bool = True


class CartesianImpedanceSection(Section):
    """A frame that follows `path` and presses on a shell with `normal_force` [N]."""

    type: Literal["cartesian-impedance"]
    frame: str
    path: Annotated[list[Vector3], Field(min_length=1)]
    stiffness: NotNegative
    damping: NotNegative
    normal_force: NotNegative = 0.0
    shell: str | None = None
    speed: Positive = 0.05
    lead_in: NotNegative = 0.0
    rotational_stiffness: NotNegative = 0.0
    rotational_damping: NotNegative = 0.0
    posture_stiffness: Gain = 0.0
    joint_damping: Gain = 0.0
    q_ref: list[float] | dict[str, float] | None = None


class PythonSection(Section):
    """The user's own tau(t, q, v, contacts), "file.py:function"."""

    type: Literal["python"]
    function: str


Controller = Annotated[
    NoController
    | GravityCompensationSection
    | JointPDSection
    | CartesianImpedanceSection
    | PythonSection,
    Field(discriminator="type"),
]


ERROR_CONTROLLED = ("adaptive", "implicit")


class RunSection(Section):
    """How long and how finely to simulate [s]; `recording_speed` 0.1 films in slow motion.

    `dt` belongs to integrators with fixed steps, `rtol` and `atol` to the others.
    """

    duration: Positive
    dt: Positive | None = None
    rtol: Positive | None = None
    atol: Positive | None = None
    integrator: Literal[
        "semi-implicit-euler", "runge-kutta-4", "linearly-implicit-euler", "adaptive", "implicit"
    ] = "semi-implicit-euler"
    control_dt: Positive | None = None
    record_dt: Positive | None = None
    recording_speed: Positive = 1.0

    @model_validator(mode="after")
    def check_steps(self) -> RunSection:
        """Refuse a step where the error decides, and a tolerance where it does not."""
        if self.integrator in ERROR_CONTROLLED:
            if self.dt is not None:
                raise ValueError(
                    f"{self.integrator} takes rtol and atol, not dt: for fixed steps set "
                    "run.integrator to semi-implicit-euler, and leave rtol and atol out"
                )
        elif self.rtol is not None or self.atol is not None:
            raise ValueError(f"{self.integrator} takes dt, not rtol and atol: leave them out")
        return self


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

    @model_validator(mode="after")
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
    gravity: Vector3 = [0.0, 0.0, -9.81]
    robot: Annotated[list[RobotSection], Field(min_length=1)]
    shell: list[ShellSection] = []
    contact: list[ContactSection] = []
    source: list[SourceSection] = []
    controller: Controller = NoController()
    run: RunSection
    knob: list[KnobSection] = []
    figures: dict[str, str] = {}
    expect: dict[str, Expected] = {}

    @model_validator(mode="before")
    @classmethod
    def take_single_tables(cls, data: Any) -> Any:
        """Read `[robot]` as the list of one that `[[robot]]` would have been."""
        if not isinstance(data, dict):
            return data
        return {k: [v] if k in LISTS and isinstance(v, dict) else v for k, v in data.items()}
