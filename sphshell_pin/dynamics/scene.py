"""A scene: a Pinocchio model and its contact pairs."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.checks import (
    check_configuration,
    check_name,
    check_names,
    check_placement,
    check_positive,
    check_type,
    check_vector,
    read_only,
)
from sphshell_pin.contact import Friction, Method, NormalLaw, Sphere
from sphshell_pin.contact.friction import check_friction
from sphshell_pin.contact.laws import check_law
from sphshell_pin.dynamics.models import (
    check_model,
    check_no_mimic,
    find_frame,
    reduced_model,
    unit_warning,
)
from sphshell_pin.dynamics.sources import Find, checked_source
from sphshell_pin.errors import InvalidParameter, NameNotFound, UnitWarning
from sphshell_pin.shell import Shell

if TYPE_CHECKING:
    from sphshell_pin.dynamics.explain import Explanation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactPair:
    """One pair of bodies that may touch; body i carries the sphere, body j the shell.

    `kind` is "sphere-shell" or "source". `frame_i`, `frame` name the frames of body i and j,
    `joint_i`, `joint_j` their joints; `sphere_placement` is the sphere's centre in joint_i,
    `placement` the shell in `frame`, `shell_placement` the shell in joint_j (with a source: the
    two frames in their joints).
    """

    name: str
    kind: str
    frame_i: str
    frame: str
    joint_i: int
    joint_j: int
    sphere_placement: pin.SE3
    placement: pin.SE3
    shell_placement: pin.SE3
    law: NormalLaw
    friction: Friction | None
    method: str
    sphere: Sphere | None = None
    shell: Shell | None = None
    find: Find | None = None

    def to_core(self) -> _core.Pair:
        """Build the C++ twin of this pair."""
        return _core.Pair(
            name=self.name,
            joint_i=self.joint_i,
            placement_i=self.sphere_placement.homogeneous,
            joint_j=self.joint_j,
            placement_j=self.shell_placement.homogeneous,
            radius=0.0 if self.sphere is None else self.sphere.radius,
            shell=None if self.shell is None else self.shell.core_for(self.method),
            source=None if self.find is None else self._source(self.find),
            method=int(Method.from_name(self.method)),
            law=self.law.core,
            friction=None if self.friction is None else self.friction.core,
        )

    def _source(self, find: Find) -> Find:
        stretches = self.friction is not None and self.friction.has_state
        return checked_source(find, self.name, stretches)


@dataclass(frozen=True)
class SceneContacts:
    """Contacts of a scene at one state, as columns; vectors and points in the world.

    With k contacts: `pair` (k,) index into scene.pairs; `point_world`, `normal_world` (k, 3) from
    the shell to the sphere; `depth` (k,) [m]; `normal_force` (k,) [N]; `friction_force_world`
    (k, 3) on the sphere [N]; `slip_velocity_world` (k, 3) of the sphere's surface against the
    shell [m/s]; `element` (k,), `feature` (k,) as in ContactSet; `number` (k,): in a run a contact
    keeps its number, which no other of its pair had or will have, while it moves over elements and
    smooth edges; at a single state it is the place in the list of its pair.

    At a saddle, where contacts merge, `normal_force` is negative: the contacts push less
    than they would one by one.
    """

    pair: NDArray[np.int32]
    point_world: Array
    normal_world: Array
    depth: Array
    normal_force: Array
    friction_force_world: Array
    slip_velocity_world: Array
    element: NDArray[np.int32]
    feature: NDArray[np.uint8]
    number: NDArray[np.int32]

    def __len__(self) -> int:
        """Return the number of contacts."""
        return len(self.depth)

    @property
    def force_world(self) -> Array:
        """Total force on the sphere of each contact, (k, 3) [N]."""
        return self.normal_force[:, None] * self.normal_world + self.friction_force_world

    @classmethod
    def columns_from_rows(cls, rows: Array) -> dict[str, NDArray[Any]]:
        """Split the core's rows (k, 18) into this class's columns."""
        return {
            "pair": rows[:, 0].astype(np.int32),
            "point_world": rows[:, 1:4],
            "normal_world": rows[:, 4:7],
            "depth": rows[:, 7],
            "normal_force": rows[:, 8],
            "friction_force_world": rows[:, 9:12],
            "slip_velocity_world": rows[:, 12:15],
            "element": rows[:, 15].astype(np.int32),
            "feature": rows[:, 16].astype(np.uint8),
            "number": rows[:, 17].astype(np.int32),
        }

    @classmethod
    def from_rows(cls, rows: Array) -> SceneContacts:
        """Build from the core's rows (k, 18)."""
        return cls(**{k: read_only(c) for k, c in cls.columns_from_rows(rows).items()})


class Scene:
    """A copy of a Pinocchio model with the contact pairs that act on it.

    `lock` names joints to hold at their values in `q_lock` (nq of the given model, default
    neutral): they drop out of the scene's model and cost nothing. FrameNotFound and NameNotFound
    list what the model has; InvalidParameter names mimic joints that are left.
    """

    def __init__(self, model: pin.Model, lock: Iterable[str] = (), q_lock: Any = None) -> None:
        if not isinstance(model, pin.Model):
            raise InvalidParameter("model", type(model).__name__, "must be a pinocchio.Model")
        check_model(model)
        self.lock = check_names("lock", lock)
        if q_lock is None:
            q = pin.neutral(model)
        elif self.lock:
            q = check_configuration("q_lock", model, q_lock)
        else:
            raise InvalidParameter(
                "q_lock", q_lock, "must come with lock, the joints to hold there"
            )
        self._model = reduced_model(model, self.lock, q) if self.lock else pin.Model(model)
        check_no_mimic(self._model)
        # What users get, made when they first ask; `_model` is never handed out.
        self._shown: pin.Model | None = None
        self._pairs: tuple[ContactPair, ...] = ()
        self._core: _core.Scene | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the C++ twin, which is made again: what pickle and copy take."""
        return {**self.__dict__, "_core": None}

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

    @property
    def pairs(self) -> tuple[ContactPair, ...]:
        """The contact pairs, in the order in which they were added."""
        return self._pairs

    def add_contact(
        self,
        sphere: Sphere,
        shell: Shell,
        frame: str = "universe",
        placement: pin.SE3 | None = None,
        law: NormalLaw | None = None,
        friction: Friction | None = None,
        method: str | None = None,
        name: str | None = None,
    ) -> ContactPair:
        """Let `sphere` touch `shell`, which is placed at `placement` in `frame`.

        Without `law` the contact has ADAMS's default IMPACT law, without `friction` none; `method`
        is "smooth" (default), "facets" or "elements". Returns the pair. A shell a thousand times
        larger than the sphere or the robot earns a UnitWarning.
        """
        check_type("sphere", sphere, Sphere, "must be a Sphere(radius, frame)")
        check_type("shell", shell, Shell, "must be a Shell (of a file: Shell.from_file)")
        law = _default_law() if law is None else law
        check_law(law)
        check_friction(friction)
        method = "smooth" if method is None else method
        Method.from_name(method)
        joint_i = self.frame_in_joint(sphere.frame)[0]
        placement = check_placement("placement", placement)
        joint_j, in_j = self.frame_in_joint(frame)
        suspicion = unit_warning(self._model, sphere.radius, shell.size)
        if suspicion:
            warnings.warn(f"shell '{shell.name}': {suspicion}", UnitWarning, stacklevel=2)
        return self._add(
            ContactPair(
                name=self._pair_name(name, f"{sphere.frame}-{shell.name}"),
                kind="sphere-shell",
                frame_i=sphere.frame,
                frame=frame,
                joint_i=joint_i,
                joint_j=joint_j,
                sphere_placement=self.place(sphere),
                placement=placement,
                shell_placement=in_j * placement,
                law=law,
                friction=friction,
                method=method,
                sphere=sphere,
                shell=shell,
            )
        )

    def add_contact_source(
        self,
        find: Find,
        frame_i: str,
        frame_j: str,
        law: NormalLaw | None = None,
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
        law = _default_law() if law is None else law
        check_law(law)
        check_friction(friction)
        joint_i, in_i = self.frame_in_joint(frame_i, "frame_i")
        joint_j, in_j = self.frame_in_joint(frame_j, "frame_j")
        return self._add(
            ContactPair(
                name=self._pair_name(name, f"{frame_i}-{frame_j}"),
                kind="source",
                frame_i=frame_i,
                frame=frame_j,
                joint_i=joint_i,
                joint_j=joint_j,
                sphere_placement=in_i,
                placement=pin.SE3.Identity(),
                shell_placement=in_j,
                law=law,
                friction=friction,
                method="facets",
                find=find,
            )
        )

    @classmethod
    def from_geometry(
        cls,
        model: pin.Model,
        geometry_model: pin.GeometryModel,
        law: NormalLaw | None = None,
        friction: Friction | None = None,
    ) -> Scene:
        """Build a scene from the active collision pairs of a geometry model.

        Of each pair one side must be a sphere; the other becomes a shell (meshes as they are,
        primitives tessellated with their exact normals). Pairs of other kinds are left out; a
        geometry model without any sphere pair raises InvalidParameter.
        """
        from sphshell_pin.dynamics.from_geometry import add_pairs

        scene = cls(model)
        add_pairs(scene, geometry_model, law, friction)
        return scene

    def external_forces(self, q: Any, v: Any = None) -> pin.StdVec_Force:
        """Return the contact wrenches for pin.aba(model, data, q, v, tau, fext).

        One pinocchio.Force per joint, in the joint's frame about its origin; q (nq,), v (nv,)
        (default: at rest).
        """
        q, v = self.check_state(q, v)
        return self.core.external_forces(q, v)

    def contact_derivatives(self, q: Any, v: Any = None) -> tuple[Array, Array]:
        """Return the derivatives (nv, nv) of the generalised contact force by q and by v.

        That force is the sum of J^T f over the joints, with f the `external_forces` at q (nq,),
        v (nv,) (default: at rest) and J the joints' Jacobians. The first is taken in the tangent
        space of q, along which pinocchio.integrate moves; units are those of force [N] or torque
        [N m] per [m] or [rad], and per [m/s] or [rad/s]. Where nothing touches both are zero.

        They are analytic and exact where contacts go on; where one comes, goes or changes its
        feature they are those of one side. Approximate: with the method "elements" each normal
        keeps its direction in the shell; contacts of a source, which does not say how they move,
        stay where they are in frame j, and their depth changes by the motion of body i at the
        point along the normal. Bristles are not stretched, as in `external_forces`.
        """
        q, v = self.check_state(q, v)
        return self.core.contact_derivatives(q, v)

    def contacts(self, q: Any, v: Any = None) -> SceneContacts:
        """Return all contacts with their forces at q (nq,), v (nv,) (default: at rest)."""
        q, v = self.check_state(q, v)
        return SceneContacts.from_rows(self.core.contacts(q, v))

    def explain(self, q: Any = None, v: Any = None, dt: float | None = None) -> Explanation:
        """Say what is modelled and what not, time scales, expected depths, and warnings.

        q (nq,) (default neutral), v (nv,) the speed of approach to judge by, `dt` [s] a step to
        judge.
        """
        from sphshell_pin.dynamics.explain import explain_scene

        q = pin.neutral(self._model) if q is None else q
        q, v = self.check_state(q, v)
        return explain_scene(self, q, v, None if dt is None else check_positive("dt", dt, "s"))

    def check_state(self, q: Any, v: Any = None) -> tuple[Array, Array]:
        """Return copies of q (nq,) and v (nv,).

        InvalidParameter for other sizes, no numbers, or a joint whose quaternion or (cos, sin) pair
        is not of unit length.
        """
        self._check_unchanged()
        model = self._model
        what = f": this model has nq = {model.nq}, nv = {model.nv}"
        if self.lock:
            what += f" after locking {', '.join(self.lock)}"
        q = check_configuration("q", model, q, what)
        v = np.zeros(model.nv) if v is None else check_vector("v", v, model.nv, what)
        return q, v

    def pair(self, name: str) -> ContactPair:
        """Return the pair called `name`; NameNotFound lists them."""
        for pair in self._pairs:
            if pair.name == name:
                return pair
        raise NameNotFound("contact", name, "the scene", [p.name for p in self._pairs])

    def replace_pair(self, name: str, **changes: Any) -> None:
        """Change the law, friction or method of the pair called `name`."""
        unknown = set(changes) - {"law", "friction", "method"}
        if unknown:
            raise NameNotFound("setting", unknown.pop(), "a pair", ("law", "friction", "method"))
        if "law" in changes:
            check_law(changes["law"])
        check_friction(changes.get("friction"))
        if "method" in changes:
            Method.from_name(changes["method"])
        old = self.pair(name)
        self._pairs = tuple(replace(p, **changes) if p is old else p for p in self._pairs)
        self._core = None

    @property
    def core(self) -> _core.Scene:
        """The C++ twin, built when first needed."""
        if self._core is None:
            self._core = _core.Scene(self._model, [p.to_core() for p in self._pairs])
        return self._core

    def _check_unchanged(self) -> None:
        """Raise InvalidParameter if somebody has changed the model that they got of this scene."""
        # Some hold numbers that are not equal to themselves (nan); of them no change is noticed.
        if self._shown is None or self._shown == self._model or self._model != self._model:
            return
        raise InvalidParameter(
            "scene.model",
            self._shown,
            "must stay as it is, as the scene has been checked and compiled with it: change the "
            "model first, and make a new Scene of it",
            "was changed, but",
        )

    def _add(self, pair: ContactPair) -> ContactPair:
        self._pairs = (*self._pairs, pair)
        self._core = None
        return pair

    def _pair_name(self, name: str | None, default: str) -> str:
        taken = {p.name for p in self._pairs}
        if name is not None:
            check_name("name", name)
            if name in taken:
                raise InvalidParameter("name", name, "is taken by another contact of this scene")
            return name
        wanted, k = default, 2
        while wanted in taken:
            wanted, k = f"{default}-{k}", k + 1
        return wanted

    def with_pairs(self, pairs: tuple[ContactPair, ...]) -> Scene:
        """Return a scene of the same model, which both share, with other `pairs`."""
        other = copy(self)
        other._shown, other._pairs, other._core = self.model, pairs, None
        return other

    def place(self, sphere: Sphere) -> pin.SE3:
        """Return where the centre of `sphere` is in the joint of its frame."""
        return self.frame_in_joint(sphere.frame)[1] * pin.SE3(np.eye(3), np.array(sphere.offset))

    def frame_in_joint(self, name: str, called: str = "frame") -> tuple[int, pin.SE3]:
        """Return the joint of the frame `name`, and where the frame is in it."""
        frame = self._model.frames[find_frame(self._model, name, called)]
        return int(frame.parentJoint), pin.SE3(frame.placement)


def _default_law() -> NormalLaw:
    from sphshell_pin.contact import ImpactLaw

    return ImpactLaw.from_adams()
