"""Contacts of spheres with shells in MuJoCo's own steps.

    contacts = attach(model, shell, ["fingertip"], law=HertzLaw.of("steel", "rubber"))
    mujoco.mj_step(model, data)

Chosen sphere geoms or sites touch a shell on any body. MuJoCo calls the compiled core in each
evaluation of its passive forces: no Python is run in a step.
"""

from __future__ import annotations

import ctypes
import hashlib
import math
import warnings
import weakref
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import NoReturn

import numpy as np
import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.adapters import imports_of
from sphshell_pin.adapters.mujoco_memory import layout, memory_of, reserve
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_names, check_placement, check_type
from sphshell_pin.contact.friction import Friction
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.contact.sphere import Sphere
from sphshell_pin.dynamics import Scene
from sphshell_pin.dynamics.result.result_parts import ContactLog
from sphshell_pin.dynamics.scene.scene_contacts import SceneContacts, columns
from sphshell_pin.errors import InvalidParameter, NotPicklable, SetupWarning, SphshellError
from sphshell_pin.shell import Shell

with imports_of("mujoco"):
    import mujoco

__all__ = ["MujocoContacts", "attach", "reserve"]


# Stands for a mass that does not move: of bodies that only their partner's mobility counts for.
_FIXED = 1e9
_SPHERE, _SHELL = 1, 2  # MujocoRole in adapters/mujoco.hpp


_REPLACED = {
    "passive": (
        "they do not act, as another passive callback has taken the place of attach's: call "
        "contacts.apply(data) in it, or attach again after mujoco.set_mjcb_passive(None)"
    ),
    "contactfilter": (
        "MuJoCo's own contact between the same geoms acts beside them, as another contact filter "
        "has taken the place of attach's: attach again after mujoco.set_mjcb_contactfilter(None)"
    ),
}


@dataclass(frozen=True)
class _End:
    """A sphere of MuJoCo: of a geom or site `name`, at `center` (3,) [m] in the body `body`."""

    name: str
    geom: int
    body: int
    center: Array
    radius: float


class MujocoContacts:
    """Spheres of a MuJoCo model that touch a shell, until `detach`; `attach` makes one.

    `scene` is a Scene with one free body for each of MuJoCo's that takes part; its pairs have law,
    friction and method, and its bodies the mass that MuJoCo's joints let a push at the sphere feel
    where the model begins (qpos0). `recommended_dt` [s] is a step for that stiffness, and
    `substeps` into how many MuJoCo's timestep must be divided for it.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        scene: Scene,
        shell: Shell,
        bodies: list[int],
        ends: list[_End],
        log: bool,
    ) -> None:
        self.model = model
        self.scene = scene
        begin = mujoco.MjData(model)
        mujoco.mj_kinematics(model, begin)
        q = np.hstack((begin.xpos[bodies], np.roll(begin.xquat[bodies], -1, axis=1))).ravel()
        self.recommended_dt = scene.explain(q).recommended_dt
        roots = [int(model.body_rootid[one]) for one in bodies]
        dofs = [_dofs_of(model, one) for one in bodies]
        home = scene.pairs[0].joint_j
        roles = _roles(model, ends, bodies[home - 1] if home else 0)
        self._core = _core.MujocoContacts(
            scene.state()._core,
            layout(),
            memory_of(model, scene),
            bodies,
            roots,
            dofs,
            roles,
            _touches(scene, shell),
            log,
        )
        self._applied_by: object = None
        again = self._core.attach(model._address)
        if again:
            said = "must not touch the same shell already, by an earlier attach"
            raise InvalidParameter("spheres", again.split(" on ")[0], said)
        weakref.finalize(model, _core.mujoco_end, model._address)
        self._attached = True

    @property
    def substeps(self) -> int:
        """How many steps of at most `recommended_dt` are in MuJoCo's timestep as it is now."""
        whole = float(self.model.opt.timestep)
        return max(1, math.ceil(whole / self.recommended_dt * (1 - 1e-9)))

    def step(self, data: mujoco.MjData) -> None:
        """Move `data` on by MuJoCo's timestep, in `substeps` steps."""
        model = self._model_of(data)
        whole, parts = model.opt.timestep, self.substeps
        model.opt.timestep = whole / parts
        try:
            for _ in range(parts):
                mujoco.mj_step(model, data)
        finally:
            model.opt.timestep = whole
        self.check()

    def _model_of(self, data: mujoco.MjData) -> mujoco.MjModel:
        """Return the model of `data`: this one, or a copy of it, which has the contacts, too."""
        check_type("data", data, mujoco.MjData, "must be a mujoco.MjData")
        model = data.model
        if model is not self.model and not self._core.acts_on(model._address):
            must = "must be of the model that the spheres were attached in, or of a copy of it"
            raise InvalidParameter("data", data, f"{must}: attach them to the other model")
        return model

    def apply(self, data: mujoco.MjData) -> None:
        """Add the forces to data.qfrc_passive: for a passive callback of your own."""
        self._applied_by = _set_now("passive")
        self._core.apply(self._model_of(data)._address, data._address)
        self.check()

    def contacts(self, data: mujoco.MjData) -> SceneContacts:
        """Return the contacts at the state of `data`, after mj_forward or mj_step1."""
        model = self._model_of(data)
        self.check()
        return SceneContacts.from_rows(self._core.contacts(model._address, data._address))

    def log(self, data: mujoco.MjData) -> ContactLog:
        """Return the contacts of all steps of `data`, for attach(log=True).

        They begin anew where its time goes back, or other data are copied onto it.
        """
        self._model_of(data)
        self.check()
        t, rows = self._core.log(data._address)
        row = np.unique(t, return_inverse=True)[1].astype(np.int64)
        return ContactLog(**columns(rows), t=t, row=row)

    def reset(self, data: mujoco.MjData) -> None:
        """Forget the log of `data`."""
        self._model_of(data)
        self._core.forget(data._address)

    def check(self) -> None:
        """Raise SphshellError where a step since the last check had a fault, or had no contacts.

        A callback of MuJoCo's cannot raise. Python reports the first fault at once, as one that was
        ignored (sys.unraisablehook).
        """
        fault = self._core.take_fault()
        if not fault and self._attached:
            for slot, own in _callbacks().items():
                now = _set_now(slot)
                by_hand = slot == "passive" and now is not None and now is self._applied_by
                if now is not own and not by_hand:
                    fault = _REPLACED[slot]
        if fault:
            raise SphshellError(f"contacts in MuJoCo: {fault}")

    def detach(self) -> None:
        """End the contacts; MuJoCo's own between these geoms are as they were before."""
        self._attached = False
        self._core.detach()

    def __reduce__(self) -> NoReturn:
        """Refuse to be copied or pickled: the contacts are those of a model of this process."""
        raise NotPicklable(
            "MujocoContacts cannot be copied or pickled; a copy of the model has them, too: "
            "attach them again in another process"
        )

    def __enter__(self) -> MujocoContacts:
        """Return itself: `with attach(...) as contacts:` detaches at the end."""
        return self

    def __exit__(self, *_: object) -> None:
        """Detach."""
        self.detach()


def attach(
    model: mujoco.MjModel,
    shell: Shell,
    spheres: Iterable[str],
    *,
    law: NormalLaw,
    friction: Friction | None = None,
    body: str | None = None,
    placement: pin.SE3 | None = None,
    method: str | None = None,
    log: bool = False,
) -> MujocoContacts:
    """Let `spheres`, names of sphere geoms or sites of `model`, touch `shell` on `body`.

    The shell is at `placement` in the frame of the MuJoCo body (default: the world). Forces act on
    both bodies, equal and opposite, in each evaluation of mj_step and mj_forward, for all MjData of
    the model and in any thread. Friction with a memory (BristleFriction, MindlinFriction) keeps it
    in MuJoCo's state: `reserve` makes room for it before the model is compiled. MuJoCo's own
    contact between these geoms and those of `body` is left out by its contact filter; all other
    pairs collide as before. Copies of the model have the contacts, too; they end with the model.
    `law`, `friction` and `method` are as of Scene.add_contact; `log` keeps the contacts of all
    steps.

    MuJoCo's implicit integrators do not know the derivatives of passive forces: the step must
    resolve the contact as an explicit one. SetupWarning where MuJoCo's timestep is longer than
    `recommended_dt`: `MujocoContacts.step` then divides it.

    Raises InvalidParameter for a name that is none, no room for the friction's memory, a geom or
    site that is no sphere, an explicit <pair> between the geoms, a sphere that touches the shell
    already, or a passive callback or contact filter that is set already.
    """
    check_type("model", model, mujoco.MjModel, "must be a mujoco.MjModel")
    check_type("shell", shell, Shell, "must be a Shell")
    names = check_names("spheres", spheres)
    if not names:
        raise InvalidParameter("spheres", spheres, "must name at least one sphere geom or site")
    ends = [_end(model, name) for name in names]
    home = 0 if body is None else _id(model, "body", body)
    if home < 0:
        raise InvalidParameter("body", body, "must be the name of a body of the model")
    bodies = sorted(({end.body for end in ends} | {home}) - {0})
    if not model.nv:
        raise InvalidParameter("model", model, "must have a joint: no force can move it")
    if any(end.body == home for end in ends):
        raise InvalidParameter("body", body, "must be another body than that of the spheres")
    scene = _scene(model, bodies, ends, home)
    frame = f"body {home}" if home else "universe"
    balls = [Sphere(end.radius, f"sphere {end.name}") for end in ends]
    pose = check_placement("placement", placement)
    settings = {"law": law, "friction": friction, "method": method}
    for ball, end in zip(balls, ends, strict=True):
        scene.add_contact(ball, shell, frame, pose, name=end.name, **settings)  # type: ignore[arg-type]
    _check_callbacks()
    made = MujocoContacts(model, scene, shell, bodies, ends, log)
    for slot, own in _callbacks().items():
        getattr(mujoco, f"set_mjcb_{slot}")(own)
    if made.substeps > 1:
        said = (
            f"MuJoCo's timestep of {model.opt.timestep:.3g} s is too long for this law: the "
            f"contact wants {made.recommended_dt:.3g} s; set model.opt.timestep, or call "
            f"contacts.step(data), which makes {made.substeps} steps of one"
        )
        warnings.warn(said, SetupWarning, stacklevel=2)
    return made


def _id(model: mujoco.MjModel, kind: str, name: str) -> int:
    """Return the number of a body, geom or site; -1 where there is none of that name."""
    return int(mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name))


def _end(model: mujoco.MjModel, name: str) -> _End:
    for kind in ("geom", "site"):
        k = _id(model, kind, name)
        if k < 0:
            continue
        if getattr(model, f"{kind}_type")[k] != mujoco.mjtGeom.mjGEOM_SPHERE:
            must = f"must be a sphere: the {kind} has another type; put a sphere site on its body"
            raise InvalidParameter("spheres", name, must)
        body = int(getattr(model, f"{kind}_bodyid")[k])
        center = np.array(getattr(model, f"{kind}_pos")[k])
        radius = float(getattr(model, f"{kind}_size")[k, 0])
        return _End(name, k if kind == "geom" else -1, body, center, radius)
    raise InvalidParameter("spheres", name, "must be the name of a geom or site of the model")


def _scene(model: mujoco.MjModel, bodies: list[int], ends: list[_End], home: int) -> Scene:
    """Return a scene of free bodies, with a frame for each sphere and for the shell's body."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    free = pin.Model()
    free.gravity.linear = np.array(model.opt.gravity)
    own = {0: 0}
    for one in bodies:
        joint = free.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), f"free {one}")
        own[one] = joint
        free.addBodyFrame(f"body {one}", joint, pin.SE3.Identity(), 0)
        here = [end for end in ends if end.body == one]
        masses = [_mass_at(model, data, end, home) for end in here]
        mass = min(masses, default=_FIXED)
        at = here[masses.index(mass)].center if here else np.zeros(3)
        free.appendBodyToJoint(joint, pin.Inertia(mass, at, mass * np.eye(3)), pin.SE3.Identity())
    for end in ends:
        place = pin.SE3(np.eye(3), end.center)
        frame = pin.Frame(f"sphere {end.name}", own[end.body], 0, place, pin.FrameType.OP_FRAME)
        free.addFrame(frame)
    return Scene(free)


def _mass_at(model: mujoco.MjModel, data: mujoco.MjData, end: _End, home: int) -> float:
    """Return the least mass [kg] that a push between a sphere and the shell's body feels."""
    rows = np.zeros((2, 3, model.nv))
    center = data.xpos[end.body] + data.xmat[end.body].reshape(3, 3) @ end.center
    for jacobian, body in zip(rows, (end.body, home), strict=True):
        mujoco.mj_jac(model, data, jacobian, None, center, body)
    apart = rows[0] - rows[1]
    solved = np.zeros_like(apart)
    mujoco.mj_solveM(model, data, solved, apart)
    mobility = float(np.linalg.eigvalsh(apart @ solved.T)[-1])
    return 1.0 / mobility if mobility > 1.0 / _FIXED else _FIXED


def _dofs_of(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the degrees of freedom that move a body."""
    out: list[int] = []
    while body:
        first = int(model.body_dofadr[body])
        out += range(first, first + int(model.body_dofnum[body]))
        body = int(model.body_parentid[body])
    return out


def _roles(model: mujoco.MjModel, ends: list[_End], home: int) -> list[int]:
    """Return the part of each geom: 1, a sphere; 2, of the shell's body `home`; 0, neither."""
    roles = np.zeros(model.ngeom, int)
    roles[model.geom_bodyid == home] = _SHELL
    roles[[end.geom for end in ends if end.geom >= 0]] = _SPHERE
    for one, other in zip(model.pair_geom1, model.pair_geom2, strict=True):
        if {int(roles[one]), int(roles[other])} == {_SPHERE, _SHELL}:
            told = "must not have a <pair> with the geoms of the shell's body: remove it"
            name = model.geom(one if roles[one] == _SPHERE else other).name
            raise InvalidParameter("spheres", name, told)
    return [int(role) for role in roles]


@cache
def _callbacks() -> dict[str, object]:
    """Return the core's functions for MuJoCo, which calls them without Python, by their slot."""
    pointer, number = ctypes.c_void_p, ctypes.c_int
    passive = ctypes.CFUNCTYPE(None, pointer, pointer)
    contactfilter = ctypes.CFUNCTYPE(number, pointer, pointer, number, number)
    return {
        "passive": passive(_core.mujoco_passive()),
        "contactfilter": contactfilter(_core.mujoco_filter()),
    }


def _set_now(slot: str) -> object:
    return getattr(mujoco, f"get_mjcb_{slot}")()


def _check_callbacks() -> None:
    for slot, own in _callbacks().items():
        now = _set_now(slot)
        if now is not None and now is not own:
            after = (
                "passive callback of yours: set it after attach, and call contacts.apply(data) in "
                if slot == "passive"
                else "contact filter of yours, as attach sets its own: leave out pairs of geoms by "
                "contype and conaffinity in place of "
            )
            raise InvalidParameter("model", now, f"must have no {after}it")


def _touches(scene: Scene, shell: Shell) -> list[str]:
    """Return a text for each pair, the same for the same sphere at the same place of a shell."""
    out = []
    for pair in scene.pairs:
        surface = (shell.vertices, shell.elements, pair.placement_j.homogeneous)
        digest = hashlib.sha256(b"".join(np.asarray(one).tobytes() for one in surface))
        out.append(f"{pair.name} on {pair.joint_j} {digest.hexdigest()}")
    return out
