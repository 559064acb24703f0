"""Joint torques: the controllers that run inside the compiled loop."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin import _core
from sphshell_pin.base import checks
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.parameters import Component, flat_fields, parameter
from sphshell_pin.dynamics.scene.models import find_joint, set_joint
from sphshell_pin.dynamics.scene.scene import Scene, SceneContacts
from sphshell_pin.dynamics.sensing.sensor_log import Readings
from sphshell_pin.errors import InvalidParameter, SphshellError, add_origin
from sphshell_pin.shell import Shell

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result.result import Result

__all__ = ["GravityCompensation", "JointPD"]

TAKES = ("t", "q", "v", "contacts")
"""Arguments of a callable that is a controller."""


def check_callable(callback: Callable[..., object]) -> None:
    """Raise InvalidParameter unless `callback` can be called as tau(t, q, v, contacts).

    One with an argument `sensors` gets that too. A callable whose signature Python cannot know, as
    of some compiled ones, passes.
    """
    try:
        signature = inspect.signature(callback)
    except (TypeError, ValueError):
        return
    try:
        signature.bind(*TAKES, **({"sensors": None} if reads_sensors(callback) else {}))
    except TypeError as error:
        name = getattr(callback, "__name__", type(callback).__name__)
        raise InvalidParameter(
            "controller",
            callback,
            f"must take tau({', '.join(TAKES)}): {error}",
            f"'{name}{signature}'",
        ) from None


def reads_sensors(callback: Callable[..., object]) -> bool:
    """Whether a controller takes an argument called `sensors`."""
    try:
        return "sensors" in inspect.signature(callback).parameters
    except (TypeError, ValueError):
        return False


# One number for all driven joints, one each (nv,), or by joint, 0 for the others.
Gain = float | Sequence[float] | Array | Mapping[str, float]
# Coordinates (nq,), or those of some joints, the others as at the start.
Posture = Sequence[float] | Array | Mapping[str, float | Sequence[float]]
# tau(t, q, v, contacts), or tau(t, q, v, contacts, sensors).
Callback = Callable[..., ArrayLike]
ShellPlace = tuple[Shell, str, pin.SE3]


class Controller(Component):
    """Base of the controllers: joint torques, bound to a scene when a run begins.

    `joints` names the driven joints; by default all but free-flyers (a floating base or object has
    no motor).
    """

    joints: Iterable[str] | None
    posture_gain: ClassVar[str | None] = None
    """The gain that pulls the joints to `q_ref`, of a controller that has both."""

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless `joints` is None or a list of names."""
        super().__post_init__()
        if self.joints is not None:
            object.__setattr__(self, "joints", checks.check_names("joints", self.joints))

    def _bind(self, scene: Scene, q0: Array) -> _core.Controller:
        """Build the C++ controller for `scene`, started at q0 (nq,)."""
        return _core.Controller(self.kind, flat_fields(self._fields(scene, q0)))

    def _fields(self, scene: Scene, q0: Array) -> dict[str, ArrayLike]:
        """Return what the C++ class of this kind is made of, by name."""
        raise NotImplementedError

    def actuated(self, model: pin.Model) -> Array:
        """Return (nv,): 1 where a velocity is driven, else 0."""
        mask = np.zeros(model.nv)
        free = "JointModelFreeFlyer"
        names = self.joints
        if names is None:
            names = [n for n in model.names[1:] if find_joint(model, n).shortname() != free]
        for name in names:
            joint = find_joint(model, name)
            mask[joint.idx_v : joint.idx_v + joint.nv] = 1
        return mask

    def gain(self, name: str, model: pin.Model) -> Array:
        """Return the gain called `name` as (nv,); InvalidParameter where it is no gain."""
        given: Gain = getattr(self, name)
        if isinstance(given, Mapping):
            gains = np.zeros(model.nv)
            for joint_name, value in given.items():
                number = checks.check_not_negative(f"{name}.{joint_name}", value)
                with _joint_of(name, joint_name):
                    joint = find_joint(model, joint_name)
                gains[joint.idx_v : joint.idx_v + joint.nv] = number
            return gains
        if np.ndim(given) == 0:
            return np.full(model.nv, checks.check_not_negative(name, given))
        gains = checks.check_vector(name, given, model.nv, f": nv = {model.nv}")
        if (gains < 0).any():
            k = int(np.argmin(gains))
            raise InvalidParameter(f"{name}[{k}]", float(gains[k]), "must not be negative")
        return gains

    def posture(self, model: pin.Model, start: Array) -> Array:
        """Return `q_ref` as a configuration (nq,); what it leaves out is as at the start."""
        given: Posture | None = getattr(self, "q_ref", None)
        q = start.copy()
        if given is None:
            return q
        if not isinstance(given, Mapping):
            return checks.check_configuration("q_ref", model, given, f": nq = {model.nq}")
        for name, value in given.items():
            with _joint_of("q_ref", name):
                set_joint(model, q, name, value)
        return checks.check_configuration("q_ref", model, q)

    def in_scenario(self, find_shell: Callable[[str], ShellPlace]) -> Controller:
        """Return this controller with the shells that it names."""
        return self

    def _setup_warnings(self, scene: Scene, q0: Array) -> list[str]:
        """Say what of the parameters is probably a mistake, for a start at q0 (nq,)."""
        return []

    def _result_warnings(self, result: Result) -> list[str]:
        """Say what in a finished run shows that the parameters are probably a mistake."""
        return []


@dataclass(frozen=True)
class NoController(Component, kind="none", of=Controller):
    """No joint torques."""

    def _build(self, folder: Path = Path()) -> None:
        """Return None."""


@dataclass(frozen=True)
class PythonFunction(Component, kind="python", of=Controller):
    """The user's own tau(t, q, v, contacts).

    Parameters
    ----------
    function : "file.py:function"
    """

    function: str = parameter()

    @property
    def files(self) -> tuple[str, ...]:
        """File of the function."""
        return (self.function.rpartition(":")[0],)


@dataclass(frozen=True)
class GravityCompensation(Controller, kind="gravity-compensation"):
    """Torques that hold the robot against gravity."""

    joints: Iterable[str] | None = None

    def _fields(self, scene: Scene, q0: Array) -> dict[str, ArrayLike]:
        return {"actuated": self.actuated(scene.model)}


@dataclass(frozen=True)
class JointPD(Controller, kind="joint-pd"):
    """Torques kp (q_ref - q) - kd v, plus gravity unless `gravity_compensation` is False.

    `kp` [N m/rad or N/m] and `kd` [N m s/rad or N s/m] are one number, (nv,), or a mapping from
    joints; `q_ref`, (nq,) or a mapping from joints, is the start of the run where it is None or
    leaves a joint out; the difference is pinocchio.difference's.

    Parameters
    ----------
    kp : stiffness of the joints
    kd : damping of the joints
    q_ref : posture; by default that of the start
    gravity_compensation : add the torques that carry the weight
    friction_compensation : add the torques that damping and dry friction of the joints take
    """

    posture_gain: ClassVar[str | None] = "kp"
    kp: Gain = parameter(unit="N m/rad", label="joint stiffness")
    kd: Gain = parameter(unit="N m s/rad", label="joint damping")
    q_ref: Posture | None = parameter(None)
    gravity_compensation: bool = parameter(True)
    friction_compensation: bool = parameter(False)
    joints: Iterable[str] | None = None

    def _fields(self, scene: Scene, q0: Array) -> dict[str, ArrayLike]:
        model = scene.model
        return {
            **{name: self.gain(name, model) for name in ("kp", "kd")},
            "q_ref": self.posture(model, q0),
            "gravity": self.gravity_compensation,
            "friction_compensation": self.friction_compensation,
            "actuated": self.actuated(model),
        }


def wrap_callable(
    callback: Callback,
    model: pin.Model,
    readings: Callable[[bytes | bytearray], Readings] | None = None,
) -> _core.Controller:
    """Wrap tau(t, q, v, contacts) -> (nv,) for the core; its answers are checked.

    With `readings`, which reads the core's memory, it gets them as `sensors`.
    """
    check_callable(callback)

    def torque(
        t: float, q: bytearray, v: bytearray, rows: bytearray, latest: bytes | bytearray = b""
    ) -> Array:
        contacts = SceneContacts.from_rows(rows)
        more = {} if readings is None else {"sensors": readings(latest)}
        try:
            tau = callback(t, np.frombuffer(q), np.frombuffer(v), contacts, **more)
        except Exception as error:
            add_origin(error, f"the controller at t = {t:.6g} s")
            raise
        return checks.check_vector("controller's tau", tau, model.nv)

    return _core.PythonController(torque)


@contextmanager
def _joint_of(called: str, joint: str) -> Iterator[None]:
    """Name the parameter in an error about one of its joints."""
    try:
        yield
    except SphshellError as error:
        raise InvalidParameter(called, joint, f"is wrong: {error}", f"of joint '{joint}'") from None
