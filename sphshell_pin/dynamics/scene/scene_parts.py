"""What a scene is made of: a Pinocchio model and its contact pairs."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from contextlib import suppress
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any, Self, TypedDict, TypeVar, Unpack

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin import _core
from sphshell_pin.base import checks
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.summary import Fact, Summarized, names
from sphshell_pin.base.texts import free_name
from sphshell_pin.contact import Friction, FunctionFriction, NormalLaw, Plane, Sphere
from sphshell_pin.contact.normal_law import check_law
from sphshell_pin.dynamics.compiled.robot import load_compiled
from sphshell_pin.dynamics.scene import models
from sphshell_pin.dynamics.scene.joint_components import JointComponents, check_joints
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.sides import Find, ShellSide, Side, SourceSide
from sphshell_pin.dynamics.scene.sphere_arguments import (
    default_group,
    named,
    sides_of,
    warn_of_size,
)
from sphshell_pin.errors import InvalidParameter, NameNotFound, SetupWarning, SphshellError
from sphshell_pin.shell import Shell

C = TypeVar("C", _core.Scene, _core.SceneState)


class _Settings(TypedDict, total=False):
    law: NormalLaw
    friction: Friction | None
    method: str


class SceneParts(Summarized):
    """What a Scene is made of."""

    def __init__(
        self,
        model: pin.Model,
        lock: Iterable[str] = (),
        q_lock: ArrayLike | None = None,
        joints: JointComponents | None = None,
        compiled: bool = False,
    ) -> None:
        if not isinstance(model, pin.Model):
            raise InvalidParameter("model", type(model).__name__, "must be a pinocchio.Model")
        models.check_model(model)
        self.lock = checks.check_names("lock", lock)
        if q_lock is None:
            q = pin.neutral(model)
        elif self.lock:
            q = checks.check_configuration("q_lock", model, q_lock)
        else:
            raise InvalidParameter(
                "q_lock", q_lock, "must come with lock, the joints to hold there"
            )
        self._model = models.reduced_model(model, self.lock, q) if self.lock else pin.Model(model)
        # What a locked joint holds, its frames do not say any more.
        self._whole = (pin.Model(model), q) if self.lock else (self._model, q)
        # Nothing is left to model of joints that are held.
        held = () if joints is None else tuple(n for n in model.names if n not in self._model.names)
        self._joints = check_joints(joints, self._model, held)
        self._model = self._joints.with_armature(self._model)
        # What users get, made when they first ask; `_model` is never handed out.
        self._shown: pin.Model | None = None
        self._pairs: tuple[ContactPair, ...] = ()
        self._core: _core.Scene | None = None
        self._moves_mass = False  # checked before the first run: the model stays as it is
        self._robot: _core.CompiledRobot | None = None
        self.compiled = compiled
        self._load_robot()

    def _facts(self) -> list[Fact]:
        model = self._model
        pairs = [pair.name for pair in self._pairs]
        return [
            Fact("model", model.name or "without a name"),
            Fact("joints", model.njoints - 1),
            Fact("degrees of freedom", model.nv, one="degree of freedom"),
            Fact("contact", names(pairs)),
        ]

    def __getstate__(self) -> dict[str, object]:
        """Everything but the C++ binding, which is made again: what pickle and copy take."""
        return {**self.__dict__, "_core": None, "_robot": None}

    @property
    def model(self) -> pin.Model:
        """The scene's own model, without the locked joints.

        It is to be read: once it is changed, this and all that computes with the scene raises
        InvalidParameter. Make a new scene of a changed model.
        """
        if self._shown is None:
            self._shown = pin.Model(self._model)
        self._check_unchanged()
        return self._shown

    def _check_moved_mass(self) -> None:
        """Raise InvalidParameter for a joint that moves no mass, as runs do."""
        if not self._moves_mass:
            checks.check_moved_mass(self._model)
            self._moves_mass = True

    @property
    def whole(self) -> tuple[pin.Model, Array]:
        """The model with the locked joints, and a configuration that has them where they are."""
        return self._whole

    @property
    def neutral(self) -> Array:
        """The model's neutral configuration (nq,)."""
        return np.asarray(pin.neutral(self._model))

    @property
    def pairs(self) -> tuple[ContactPair, ...]:
        """The contact pairs, in the order in which they were added."""
        return self._pairs

    @property
    def joints(self) -> JointComponents:
        """What is modelled in the joints, without the locked ones."""
        return self._joints

    def add_contact(
        self,
        sphere: Sphere | Plane,
        shell: Shell | Sphere,
        frame: str = "universe",
        placement: pin.SE3 | None = None,
        law: NormalLaw | None = None,
        friction: Friction | None = None,
        method: str | None = None,
        name: str | None = None,
    ) -> ContactPair:
        """Let `sphere` touch `shell`, which is placed at `placement` in `frame`.

        In place of the shell there may be another Sphere, which is a solid ball in a frame of its
        own: `frame`, `placement` and `method` are then not to be given. Contact is symmetric, but
        that forces act at the point of this other sphere that is closest to the first one's center.

        In place of `sphere` there may be a Plane, a half-space that the shell touches where it is
        lowest over it: the limit of a sphere whose radius grows. Its normals, too, lead from the
        shell into the other body, against the normal of the plane.

        A `law` is needed; without `friction` the contact has none; `method` is "smooth" (default),
        "facets" or "elements". Returns the pair. Warns with UnitWarning of a shell a thousand times
        larger than the sphere or the robot.
        """
        sides = sides_of(self.frame_in_joint, sphere, shell, frame, placement, method)
        pair = self._add(name, f"{sphere.frame}-{default_group(shell)}", *sides, law, friction)
        warn_of_size(self._model, pair)
        return pair

    def add_contacts(
        self,
        spheres: Iterable[Sphere],
        shell: Shell | Sphere,
        frame: str = "universe",
        placement: pin.SE3 | None = None,
        *,
        law: NormalLaw,
        friction: Friction | None = None,
        method: str | None = None,
        name: str | None = None,
    ) -> tuple[ContactPair, ...]:
        """Let each of `spheres` touch `shell`: all contacts of a hand, a foot or a robot at once.

        The other arguments are those of `add_contact`, and hold for all. Returns the pairs, called
        "name/frame", with several spheres in one frame "name/frame-0" and so on; `name` is that of
        the shell by default. They share what they can: while they are all far from the shell, one
        distance keeps them from passing through it, and contacts with bristles that begin in one
        step share the room for them (more than 16 at once begin with the next step).
        """
        known = self._pairs
        group = default_group(shell) if name is None else name
        try:
            for sphere, called in named(spheres, group):
                sides = sides_of(self.frame_in_joint, sphere, shell, frame, placement, method)
                self._add(called, called, *sides, law, friction, group)
        except SphshellError:
            self._pairs = known
            raise
        made = self._pairs[len(known) :]
        warn_of_size(self._model, min(made, key=lambda pair: pair.least_radius))
        return made

    def add_contact_source(
        self,
        find: Find,
        frame_i: str,
        frame_j: str,
        law: NormalLaw,
        friction: Friction | None = None,
        name: str | None = None,
    ) -> ContactPair:
        """Let the user's own routine say where two bodies touch (gears, cams, ...).

        find(pose_i, pose_j), with the world placements (pinocchio.SE3) of both frames, returns
        points_world (k, 3) [m], normals_world (k, 3) (unit, from j to i), depths (k,) [m]; entries
        with depth <= 0 are no contacts. It is called in every evaluation of the forces. A scene
        that is to be pickled (multiprocessing) needs a function of a module here, no lambda.
        """
        if not callable(find):
            raise InvalidParameter("find", find, "must be callable: find(pose_i, pose_j)")
        side_i = SourceSide(frame_i, *self.frame_in_joint(frame_i, "frame_i"), find)
        side_j = Side(frame_j, *self.frame_in_joint(frame_j, "frame_j"))
        return self._add(name, f"{frame_i}-{frame_j}", side_i, side_j, law, friction)

    def check_state(self, q: ArrayLike, v: ArrayLike | None = None) -> tuple[Array, Array]:
        """Return copies of q (nq,) and v (nv,).

        InvalidParameter for other sizes, no numbers, or a joint whose quaternion or (cos, sin) pair
        is not of unit length.
        """
        self._check_unchanged()
        return checked_state(self._model, self.lock, q, v)[:2]

    def pair(self, name: str) -> ContactPair:
        """Return the pair called `name`; NameNotFound lists them."""
        checks.check_name("name", name)
        for pair in self._pairs:
            if pair.name == name:
                return pair
        raise NameNotFound("contact", name, "the scene", [p.name for p in self._pairs])

    def replace_pair(self, name: str, **changes: Unpack[_Settings]) -> None:
        """Change the law, friction or method of the pair called `name`."""
        known = tuple(_Settings.__annotations__)
        unknown = set(changes) - set(known)
        if unknown:
            raise NameNotFound("setting", unknown.pop(), "a pair", known)
        old = self.pair(name)
        new: dict[str, Any] = dict(changes)
        if method := new.pop("method", None):
            if not isinstance(old.side_j, ShellSide):
                must = f"must not be given: contact '{name}' has no shell"
                raise InvalidParameter("method", method, must)
            new["side_j"] = replace(old.side_j, method=method)
        self._pairs = tuple(replace(p, **new) if p is old else p for p in self._pairs)
        self._core = None

    @property
    def _binding(self) -> _core.Scene:
        """The C++ binding, built when first needed."""
        if self._core is None:
            self._core = self._compile(_core.Scene, [p._bind() for p in self._pairs])
        return self._core

    def _compile(self, kind: type[C], pairs: list[_core.Pair]) -> C:
        """Return what the core makes of the scene with `pairs`: itself or its state."""
        shown = self.model
        convert = partial(_converted, self._model, shown, self.lock)
        return kind(self._model, shown, pairs, self.bind_joints(), convert)

    def _load_robot(self) -> None:
        """Load what is compiled, anew after pickling; `compiled` then says whether it is used."""
        if self.compiled and self._robot is None:
            self._robot = load_compiled(self._model)
            self.compiled = self._robot is not None

    def bind_joints(self) -> _core.JointEffects | None:
        """Return what the core makes of the joints, with the compiled robot; None for neither."""
        effects = self._joints._bind(self._model)
        self._load_robot()
        if self._robot is not None:
            none = np.zeros(0)
            effects = effects or _core.JointEffects(none, none, none, none)
            effects.use(self._robot)
        return effects

    def _check_unchanged(self) -> None:
        """Raise InvalidParameter if somebody has changed the model that they got of this scene."""
        if self._shown is not None:
            _check_unchanged(self._model, self._shown)

    def _add(
        self,
        name: str | None,
        default: str,
        side_i: Side,
        side_j: Side,
        law: NormalLaw | None,
        friction: Friction | None,
        group: str = "",
    ) -> ContactPair:
        """Add a pair, called `default` unless `name` is given."""
        _warn_of_friction_at_rest(friction)
        called = self._pair_name(name, default)
        pair = ContactPair(called, side_i, side_j, check_law(law), friction, group)
        self._pairs = (*self._pairs, pair)
        self._core = None
        return pair

    def _pair_name(self, name: str | None, default: str) -> str:
        taken = {p.name for p in self._pairs}
        if name is not None:
            checks.check_name("name", name)
            if name in taken:
                raise InvalidParameter("name", name, "is taken by another contact of this scene")
            return name
        return free_name(default, taken, "-{}")

    def with_pairs(self, pairs: tuple[ContactPair, ...]) -> Self:
        """Return a scene of the same model, which both share, with other `pairs`."""
        other = copy(self)
        other._shown, other._pairs, other._core = self.model, pairs, None
        other._robot = self._robot
        return other

    def frame_in_joint(self, name: str, called: str = "frame") -> tuple[int, pin.SE3]:
        """Return the joint of the frame `name`, and where the frame is in it."""
        frame = self._model.frames[models.find_frame(self._model, name, called)]
        return int(frame.parentJoint), pin.SE3(frame.placement)


def checked_state(
    model: pin.Model, lock: tuple[str, ...], q: object, v: object = None, tau: object = None
) -> tuple[Array, Array, Array]:
    """Return copies of q (nq,), v (nv,) and tau (nv,), zeros for None; InvalidParameter if wrong.

    `lock` are the joints that were locked, which the sizes do not count.
    """
    what = f": this model has nq = {model.nq}, nv = {model.nv}"
    if lock:
        what += f" after locking {', '.join(lock)}"
    q = checks.check_configuration("q", model, q, what)
    none = np.zeros(model.nv)
    v = checks.check_vector("v", none if v is None else v, model.nv, what)
    tau = checks.check_vector("tau", none if tau is None else tau, model.nv, " [N m or N]")
    return q, v, tau


def _converted(
    model: pin.Model, shown: pin.Model, lock: tuple[str, ...], q: object, v: object, tau: object
) -> tuple[Array, Array, Array]:
    """Return what the core does not read by itself, as arrays, or raise what is wrong with it."""
    _check_unchanged(model, shown)
    return checked_state(model, lock, q, v, tau)


def _warn_of_friction_at_rest(friction: Friction | None) -> None:
    # What its function cannot answer is raised where it is called for.
    with suppress(SphshellError):
        if isinstance(friction, FunctionFriction) and not friction.vanishes_at_rest:
            warnings.warn(
                "the force of a FunctionFriction does not vanish at rest: at a slip of 1e-6 m/s it "
                "is more than a tenth of its largest, which takes steps of a microsecond or less; "
                "let it grow from zero over a slip speed, or take a BristleFriction, which sticks",
                SetupWarning,
                stacklevel=4,
            )


def _check_unchanged(model: pin.Model, shown: pin.Model) -> None:
    # Some hold numbers that are not equal to themselves (nan); of them no change is noticed.
    if shown == model or model != model:  # noqa: PLR0124
        return
    raise InvalidParameter(
        "scene.model",
        shown,
        "must stay as it is, as the scene has been checked and compiled with it: change the "
        "model first, and make a new Scene of it",
        "was changed, but",
    )
