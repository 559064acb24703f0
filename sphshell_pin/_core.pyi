"""The C++ core as Python sees it. Arguments are trusted: the package's own classes check them."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

_Doubles = NDArray[np.float64]
_Ints = NDArray[np.int32]
_Bytes = NDArray[np.uint8]
_Longs = NDArray[np.int64]

class Shell:
    def __init__(
        self,
        vertices: _Doubles,
        triangles: _Ints,
        triangle_element: _Ints,
        crease_angle: float,
        side: int,
        face: _Ints | None = None,
        normals: _Doubles | None = None,
    ) -> None: ...
    def curve(
        self,
        normals: _Doubles | None,
        exact: bool = False,
        straight: _Bytes | None = None,
        rounding: float = 0.0,
        faces: bool = True,
        known: _Ints | None = None,
        shapes: _Doubles | None = None,
    ) -> Shell: ...
    def contacts(
        self, center: _Doubles, radius: float, method: int, gradient: bool = False
    ) -> tuple[bytes, bytes | None]: ...
    def contacts_batch(
        self, centers: _Doubles, radii: _Doubles, method: int, threads: int
    ) -> tuple[_Doubles, _Ints]: ...
    def closest_points(
        self, points: _Doubles, smooth: bool, threads: int = 1
    ) -> tuple[_Doubles, _Doubles, _Doubles, _Ints]: ...
    @property
    def vertices(self) -> _Doubles: ...
    @property
    def triangles(self) -> _Ints: ...
    @property
    def triangle_element(self) -> _Ints: ...
    @property
    def pinched_vertices(self) -> _Ints: ...
    @property
    def num_elements(self) -> int: ...
    @property
    def num_patches(self) -> int: ...
    @property
    def control_point_offsets(self) -> _Doubles: ...
    @property
    def corner_normals(self) -> _Doubles: ...
    @property
    def bending(self) -> _Bytes: ...
    @property
    def normals_set_aside(self) -> _Bytes: ...
    @property
    def faces(self) -> tuple[_Ints, _Doubles]: ...
    @property
    def triangle_face(self) -> _Ints: ...
    @property
    def chord_errors(self) -> _Doubles: ...
    @property
    def exact_triangles(self) -> _Bytes: ...
    @property
    def inexact_faces(self) -> _Doubles: ...
    @property
    def creases(self) -> int: ...
    @property
    def has_flats(self) -> bool: ...
    @property
    def has_other_flats(self) -> bool: ...
    @property
    def element_patch(self) -> _Ints: ...
    @property
    def edge_vertices(self) -> _Ints: ...
    @property
    def edge_class(self) -> _Bytes: ...
    @property
    def edge_angle(self) -> _Doubles: ...
    @property
    def triangle_normals(self) -> _Doubles: ...

_FoundationRows = tuple[_Ints, _Ints, _Doubles, _Doubles, _Doubles, _Doubles, _Doubles]
_FoundationPoints = tuple[_Doubles, _Doubles, _Doubles, _Doubles, _Doubles, _Ints]

class Foundation:
    def __init__(self) -> None: ...
    def find(
        self, shell: Shell, center: _Doubles, radius: float, method: int, points: bool = False
    ) -> tuple[_FoundationRows, _FoundationPoints]: ...
    def find_on_ball(
        self, ball: float, center: _Doubles, radius: float, points: bool = False
    ) -> tuple[_FoundationRows, _FoundationPoints]: ...

# Of name, unit, bounds (above, at least, at most) and default.
_ParameterRow = tuple[str, str, float, float, float, float | None]

class NormalLaw:
    def __init__(self, kind: str, numbers: Sequence[float]) -> None: ...
    @staticmethod
    def kinds() -> list[str]: ...
    @staticmethod
    def parameters(kind: str) -> list[_ParameterRow]: ...
    @staticmethod
    def of_function(
        parameters: Sequence[float],
        force: int,
        of_force: object,
        energy: int,
        of_energy: object | None,
    ) -> NormalLaw: ...
    @property
    def needs_rate(self) -> bool: ...
    def force(self, depth: float, gap_rate: float) -> float: ...
    def stiffness(self, depth: float) -> float: ...
    def energy(self, depth: float) -> float: ...

class FrictionLaw:
    def __init__(self, kind: str, numbers: Sequence[float]) -> None: ...
    @staticmethod
    def kinds() -> list[str]: ...
    @staticmethod
    def parameters(kind: str) -> list[_ParameterRow]: ...
    @staticmethod
    def of_function(parameters: Sequence[float], force: int, of_force: object) -> FrictionLaw: ...
    @property
    def has_state(self) -> bool: ...
    @property
    def torsional(self) -> bool: ...
    def coefficient(self, speed: float, load: float = 1.0) -> float: ...

def contact_moduli(materials: Sequence[float]) -> tuple[float, float, float]: ...
def contact_force(
    law: NormalLaw,
    friction: FrictionLaw | None,
    depth: float,
    normal: _Doubles,
    relative: _Doubles,
    spin: float,
    rolling: _Doubles,
    bristle: _Doubles,
    radius: float,
    relaxation: float,
) -> tuple[float, _Doubles, _Doubles, _Doubles]: ...
def contact_row_type() -> Any: ...
def shell_contact_row_type() -> Any: ...
def patch_row_type() -> Any: ...

class Pair:
    relaxation: float
    group: str
    def __init__(
        self,
        name: str,
        joint_i: int,
        placement_i: _Doubles,
        joint_j: int,
        placement_j: _Doubles,
        radius: float,
        ball: float,
        shell: Shell | None,
        source: Callable[[pin.SE3, pin.SE3], tuple[_Doubles, _Doubles, _Doubles]] | None,
        method: int,
        law: NormalLaw,
        friction: FrictionLaw | None,
        plane: bool,
    ) -> None: ...

class CompiledRobot:
    def __init__(self, path: str, model: pin.Model) -> None: ...

class JointEffects:
    def __init__(
        self, damping: _Doubles, least_effort: _Doubles, most_effort: _Doubles, speed: _Doubles
    ) -> None: ...
    def add_stop(self, q: int, v: int, end: float, sign: float, law: NormalLaw) -> None: ...
    def add_friction(
        self, v: int, limit: float, stiffness: float, damping: float, relaxation: float
    ) -> None: ...
    def use(self, compiled: CompiledRobot) -> None: ...

class Parameter:
    def __init__(
        self,
        pair: int,
        kind: int,
        axis: int = 0,
        less: Pair | None = None,
        more: Pair | None = None,
        step: float = 0.0,
        scale: float = 1.0,
    ) -> None: ...

class _Evaluations:
    def __init__(
        self,
        model: pin.Model,
        shown: pin.Model,
        pairs: Sequence[Pair],
        joints: JointEffects | None,
        convert: Callable[[object, object, object], tuple[_Doubles, _Doubles, _Doubles]],
    ) -> None: ...
    def joint_forces(self, q: ArrayLike, v: ArrayLike | None = None) -> _Doubles: ...
    def external_forces(self, q: ArrayLike, v: ArrayLike | None = None) -> pin.StdVec_Force: ...
    def contacts(self, q: ArrayLike, v: ArrayLike | None = None) -> NDArray[np.uint8]: ...
    def contact_derivatives(
        self, q: ArrayLike, v: ArrayLike | None = None
    ) -> tuple[_Doubles, _Doubles]: ...
    def dynamics_derivatives(
        self,
        q: ArrayLike,
        v: ArrayLike | None,
        tau: ArrayLike | None,
        parameters: Sequence[Parameter],
        repeat: int = 1,
    ) -> tuple[_Doubles, _Doubles, _Doubles, _Doubles, _Doubles]: ...
    def contact_force_derivatives(
        self, q: ArrayLike, v: ArrayLike | None, parameters: Sequence[Parameter]
    ) -> tuple[NDArray[np.uint8], _Doubles, _Doubles, _Doubles]: ...
    def step_derivatives(
        self,
        integrator: str,
        dt: float,
        q: ArrayLike,
        v: ArrayLike | None,
        tau: ArrayLike | None,
        parameters: Sequence[Parameter],
    ) -> tuple[_Doubles, _Doubles, _Doubles, _Doubles, _Doubles]: ...

def model_fault(model: pin.Model) -> tuple[str, str, str] | None: ...
def touches_at(
    model: pin.Model, pairs: Sequence[Pair], q: _Doubles, v: _Doubles
) -> list[tuple[float, float, float, float]]: ...

class SceneState(_Evaluations):
    def copy(self) -> SceneState: ...
    def save(self) -> _Doubles: ...
    def restore(self, values: _Doubles) -> bool: ...
    def advance(self, q: ArrayLike, v: ArrayLike, dt: float) -> None: ...

def mujoco_passive() -> int: ...
def mujoco_filter() -> int: ...
def mujoco_register(register_plugin: int, get_config: int) -> int: ...
def mujoco_taken(model: int, instance: int) -> bool: ...
def mujoco_end(model: int) -> None: ...

class MujocoContacts:
    def __init__(
        self,
        state: SceneState,
        layout: list[int],
        memory: tuple[int, int, int],
        ids: list[int],
        roots: list[int],
        dofs: list[list[int]],
        roles: list[int],
        touches: list[str],
        logs: bool,
    ) -> None: ...
    def attach(self, model: int) -> str: ...
    def acts_on(self, model: int) -> bool: ...
    def detach(self) -> None: ...
    def apply(self, model: int, data: int) -> None: ...
    def contacts(self, model: int, data: int) -> _Bytes: ...
    def log(self, data: int) -> tuple[_Doubles, _Bytes]: ...
    def forget(self, data: int) -> None: ...
    def take_fault(self) -> str: ...

class Scene(_Evaluations):
    @property
    def bristle_size(self) -> int: ...
    def rates(self, q: _Doubles, v: _Doubles, z: _Doubles, tau: _Doubles) -> _Doubles: ...
    def rate_jacobian(self, q: _Doubles, v: _Doubles, z: _Doubles, tau: _Doubles) -> _Doubles: ...

class Sensor:
    rate: float
    delay: float
    cutoff: float
    range: Sequence[float]
    noise: Sequence[float]
    seed: int
    def __init__(self, kind: str, fields: dict[str, _Doubles]) -> None: ...
    @property
    def size(self) -> int: ...

def normal_noise(seed: int, sample: int, value: int) -> float: ...

class Controller:
    def __init__(self, kind: str, fields: dict[str, _Doubles]) -> None: ...

class PythonController(Controller):
    def __init__(self, callable: Callable[..., Any]) -> None: ...

class RunSettings:
    def __init__(
        self,
        *,
        integrator: str,
        dt: float,
        rtol: float,
        atol: float,
        duration: float,
        start_time: float,
        control_dt: float,
        record_dt: float,
        patches: bool,
        torques: bool,
        states: bool,
    ) -> None: ...

class OneUser:
    def __init__(self, what: str) -> None: ...

class Use:
    def __init__(self, user: OneUser, doing: str) -> None: ...
    def __enter__(self) -> None: ...
    def __exit__(self, *args: object) -> None: ...

class Simulation:
    def __init__(
        self,
        model: pin.Model,
        pairs: Sequence[Pair],
        joints: JointEffects | None,
        controller: Controller | None,
        q0: _Doubles,
        v0: _Doubles,
        settings: RunSettings,
        sensors: Sequence[Sensor],
    ) -> None: ...
    def differentiate(self, parameters: Sequence[Parameter], by_q0: bool, by_v0: bool) -> None: ...
    @property
    def controller_remembers(self) -> bool: ...
    def take_sensitivities(self) -> dict[str, _Doubles]: ...
    def advance(self, wall_seconds: float, until: float = ...) -> int: ...
    def deep_start(self) -> tuple[int, float] | None: ...
    def change(
        self, pairs: list[Pair], joints: JointEffects | None, controller: Controller | None
    ) -> None: ...
    def take_over(self, before: Simulation) -> None: ...
    def push(
        self,
        joint: int,
        point: _Doubles,
        force_world: _Doubles,
        anchor_world: _Doubles,
        stiffness: float,
        damping: float,
        frame: int,
    ) -> None: ...
    def record_patches(self, on: bool) -> None: ...
    def take(self) -> dict[str, NDArray[Any]]: ...
    def resume(self, state: _Doubles) -> bool: ...
    def record_torques(self) -> None: ...
    def snapshot(self) -> dict[str, NDArray[Any]]: ...
    @property
    def progress(self) -> float: ...
    @property
    def time(self) -> float: ...
    @property
    def q(self) -> _Doubles: ...
    @property
    def v(self) -> _Doubles: ...
    @property
    def counts(self) -> dict[str, int]: ...
    @property
    def last_step(self) -> float: ...
    @property
    def wall_time(self) -> float: ...
    @property
    def summaries(self) -> list[dict[str, float]]: ...
    @property
    def limits(self) -> list[dict[str, float]]: ...

class Outcome:
    status: int
    fault: str
    deep_start: tuple[int, float] | None
    time: float
    last_step: float
    wall_time: float
    counts: dict[str, int]
    q: _Doubles
    v: _Doubles
    summaries: list[dict[str, float]]
    @property
    def limits(self) -> list[dict[str, float]]: ...
    residual: float
    through: list[int]

class Rollout:
    def __init__(self, model: pin.Model, threads: int) -> None: ...
    def add(
        self,
        pairs: Sequence[Pair],
        joints: JointEffects | None,
        controller: Controller | None,
        q0: _Doubles,
        v0: _Doubles,
        settings: RunSettings,
        sensors: Sequence[Sensor],
    ) -> None: ...
    def wait(self, left: int, seconds: float) -> int: ...
    def stop(self) -> None: ...
    def __len__(self) -> int: ...
    def outcome(self, number: int) -> Outcome: ...
    def record(self, number: int) -> dict[str, NDArray[Any]]: ...

def mend_weld(points: _Doubles, tolerance: float) -> tuple[_Ints, float]: ...
def mend_edges(
    offsets: _Longs, corners: _Ints, vertex_count: int
) -> tuple[_Ints, _Ints, _Ints]: ...
def mend_duplicates(
    offsets: _Longs, corners: _Ints, slot_edge: _Ints, users: _Ints
) -> tuple[_Ints, _Bytes]: ...
def mend_repeats(offsets: _Longs, corners: _Ints) -> _Bytes: ...
def mend_shapes(offsets: _Longs, corners: _Ints, points: _Doubles) -> _Doubles: ...
def mend_sums(
    points: _Doubles,
    triangles: _Ints,
    triangle_polygon: _Ints,
    component: _Ints,
    flip: _Bytes,
    components: int,
    center: _Doubles,
) -> tuple[_Doubles, _Doubles, _Doubles]: ...
def mend_clip_ears(
    offsets: _Longs, corners: _Ints, points: _Doubles, tolerance: float
) -> tuple[_Longs, _Ints, _Bytes]: ...
def mend_t_junctions(
    offsets: _Longs,
    corners: _Ints,
    points: _Doubles,
    open_slots: _Longs,
    open_polygons: _Ints,
    candidates: _Ints,
    tolerance: float,
    most: int,
) -> tuple[_Longs, _Ints, _Doubles]: ...
def mend_flood_fill(
    offsets: _Longs, corners: _Ints, slot_edge: _Ints, users: _Ints
) -> tuple[_Ints, _Bytes, _Bytes]: ...
def mend_components(nodes: int, pairs: _Ints) -> _Ints: ...
def mend_overlaps(
    points: _Doubles,
    triangles: _Ints,
    triangle_component: _Ints,
    places: _Doubles,
    place_component: _Ints,
    group: _Ints,
) -> tuple[_Ints, _Doubles]: ...
def evaluate_into(
    scene: Scene, q: _Doubles, v: _Doubles, tau: _Doubles, acceleration: _Doubles, forces: _Doubles
) -> None: ...
def differentiate_into(
    scene: Scene,
    q: _Doubles,
    v: _Doubles,
    tau: _Doubles,
    by_state: _Doubles,
    by_tau: _Doubles,
    forces_by_state: _Doubles,
) -> None: ...
def step_into(
    scene: Scene,
    integrator: str,
    dt: float,
    q: _Doubles,
    v: _Doubles,
    tau: _Doubles,
    next: _Doubles,
    forces: _Doubles,
) -> None: ...
def differentiate_step_into(
    scene: Scene,
    integrator: str,
    dt: float,
    q: _Doubles,
    v: _Doubles,
    tau: _Doubles,
    by_state: _Doubles,
    by_tau: _Doubles,
    forces_by_state: _Doubles,
) -> None: ...

class Frame:
    def __init__(self, joint: int, placement: _Doubles, reference: _Doubles) -> None: ...

def frame_into(scene: Scene, frame: Frame, q: _Doubles, residual: _Doubles) -> None: ...
def differentiate_frame_into(scene: Scene, frame: Frame, q: _Doubles, by_q: _Doubles) -> None: ...
