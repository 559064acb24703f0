"""Contacts of spheres with shells in MuJoCo's own steps.

    contacts = attach(model, shell, ["fingertip"], law=HertzLaw("steel", "rubber"))
    mujoco.mj_step(model, data)

Chosen sphere geoms or sites touch a shell on any body. MuJoCo calls the compiled core in each
evaluation of its passive forces: no Python is run in a step.
"""

from __future__ import annotations

import ctypes
import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.adapters import imports_of
from sphshell_pin.arrays import Array
from sphshell_pin.checks import check_names, check_placement, check_type
from sphshell_pin.contact.friction import Friction
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.contact.sphere import Sphere
from sphshell_pin.dynamics import Scene
from sphshell_pin.dynamics.result.result_parts import ContactLog
from sphshell_pin.dynamics.scene.scene_contacts import SceneContacts, columns
from sphshell_pin.errors import InvalidParameter, SetupWarning, SphshellError
from sphshell_pin.shell import Shell

with imports_of("mujoco"):
    import mujoco

__all__ = ["MujocoContacts", "attach"]


# Stands for a mass that does not move: of bodies that only their partner's mobility counts for.
_FIXED = 1e9
_BITS = 32  # of contype and conaffinity


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
        self, model: mujoco.MjModel, scene: Scene, bodies: list[int], ends: list[_End], log: bool
    ) -> None:
        self.model = model
        self.scene = scene
        begin = mujoco.MjData(model)
        mujoco.mj_kinematics(model, begin)
        q = np.hstack((begin.xpos[bodies], np.roll(begin.xquat[bodies], -1, axis=1))).ravel()
        self.recommended_dt = scene.explain(q).recommended_dt
        roots = [int(model.body_rootid[one]) for one in bodies]
        dofs = [_dofs_of(model, one) for one in bodies]
        state = scene.state()._core
        self._core = _core.MujocoContacts(state, _layout(model), bodies, roots, dofs, log)
        self._bits = _separate(model, ends, self._body_of_shell(bodies))
        self._attached = True
        self._core.attach(model._address)

    def _body_of_shell(self, bodies: list[int]) -> int:
        joint = self.scene.pairs[0].joint_j
        return bodies[joint - 1] if joint else 0

    @property
    def substeps(self) -> int:
        """How many steps of at most `recommended_dt` are in MuJoCo's timestep as it is now."""
        whole = float(self.model.opt.timestep)
        return max(1, math.ceil(whole / self.recommended_dt * (1 - 1e-9)))

    def step(self, data: mujoco.MjData) -> None:
        """Move `data` on by MuJoCo's timestep, in `substeps` steps."""
        whole, parts = self.model.opt.timestep, self.substeps
        self.model.opt.timestep = whole / parts
        try:
            for _ in range(parts):
                mujoco.mj_step(self.model, data)
        finally:
            self.model.opt.timestep = whole
        self.check()

    def apply(self, data: mujoco.MjData) -> None:
        """Add the forces to data.qfrc_passive: for a passive callback of your own."""
        self._core.apply(self.model._address, data._address)
        self.check()

    def contacts(self, data: mujoco.MjData) -> SceneContacts:
        """Return the contacts at the state of `data`, after mj_forward or mj_step1."""
        self.check()
        return SceneContacts.from_rows(self._core.contacts(data._address))

    def log(self, data: mujoco.MjData) -> ContactLog:
        """Return the contacts of all steps of `data` since its time began, for attach(log=True)."""
        self.check()
        t, rows = self._core.log(data._address)
        row = np.unique(t, return_inverse=True)[1].astype(np.int64)
        return ContactLog(**columns(rows), t=t, row=row)

    def reset(self, data: mujoco.MjData) -> None:
        """Forget friction's memory and the log of `data`; mj_resetData alone does it, too.

        To be called before `data` is deleted where many are made one after the other: another one
        may come to the same place in memory.
        """
        self._core.forget(data._address)

    def check(self) -> None:
        """Raise SphshellError where a step since the last check had a fault."""
        fault = self._core.take_fault()
        if fault:
            raise SphshellError(f"contacts in MuJoCo: {fault}")

    def detach(self) -> None:
        """End the contacts, and let MuJoCo's own between these geoms be as they were."""
        if not self._attached:
            return
        self._attached = False
        self._core.detach(self.model._address)
        contype, conaffinity, changed = self._bits
        self.model.geom_contype[changed] = contype[changed]
        self.model.geom_conaffinity[changed] = conaffinity[changed]

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
    the model and in any thread; friction remembers across the steps of each MjData. MuJoCo's own
    contact between these geoms and those of `body` is switched off by a free bit of contype and
    conaffinity; all other pairs collide as before. `law`, `friction` and `method` are as of
    Scene.add_contact; `log` keeps the contacts of all steps.

    MuJoCo's implicit integrators do not know the derivatives of passive forces: the step must
    resolve the contact as an explicit one. SetupWarning where MuJoCo's timestep is longer than
    `recommended_dt`: `MujocoContacts.step` then divides it.

    Raises InvalidParameter for a name that is none, a geom or site that is no sphere, an explicit
    <pair> between the geoms, no free bit, or a passive callback that is set already.
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
    _claim_callback()
    made = MujocoContacts(model, scene, bodies, ends, log)
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


def _separate(
    model: mujoco.MjModel, ends: list[_End], home: int
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Switch off collisions of the spheres' geoms with those of the body `home`, and no others.

    Returns contype and conaffinity as they were, and which geoms have others now. Geoms a and b
    collide where contype of one has a bit of conaffinity of the other. A sphere gets one bit that
    nobody else has, as its contype, and those that it is to meet get that bit in conaffinity.
    """
    geoms = [end.geom for end in ends if end.geom >= 0]
    of_body = np.flatnonzero(model.geom_bodyid == home)
    for one, other in zip(model.pair_geom1, model.pair_geom2, strict=True):
        if (one in geoms and other in of_body) or (other in geoms and one in of_body):
            told = "must not have a <pair> with the geoms of the shell's body: remove it"
            raise InvalidParameter("spheres", model.geom(one).name, told)
    contype, conaffinity = model.geom_contype.copy(), model.geom_conaffinity.copy()
    was = contype.copy(), conaffinity.copy()
    for geom in geoms:
        meets = (contype[geom] & conaffinity) | (contype & conaffinity[geom]) != 0
        meets[geom] = False
        if not meets[of_body].any():
            continue
        meets[of_body] = False
        used = int(np.bitwise_or.reduce(contype | conaffinity)) & (1 << _BITS) - 1
        free = [bit for bit in range(_BITS - 1) if not used >> bit & 1]
        if meets.any() and not free:
            told = "cannot be kept from MuJoCo's own contact: all bits of contype are in use"
            raise InvalidParameter("spheres", model.geom(geom).name, told)
        contype[geom] = conaffinity[geom] = 0
        if meets.any():
            contype[geom] = 1 << free[0]
            conaffinity[meets] |= 1 << free[0]
    changed = np.flatnonzero((contype != was[0]) | (conaffinity != was[1]))
    model.geom_contype[:], model.geom_conaffinity[:] = contype, conaffinity
    return *was, changed


@cache
def _passive() -> object:
    """Return the core's function for MuJoCo, which calls it without Python."""
    kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
    return kind(_core.mujoco_passive())


def _claim_callback() -> None:
    set_already = mujoco.get_mjcb_passive()
    if set_already is None:
        mujoco.set_mjcb_passive(_passive())
    elif set_already is not _passive():
        raise InvalidParameter(
            "model",
            set_already,
            "must have no passive callback of yours: set it after attach, and call "
            "contacts.apply(data) in it",
        )


def _layout(model: mujoco.MjModel) -> list[int]:
    """Return where MuJoCo keeps what the core reads: see MujocoLayout in adapters/mujoco.hpp.

    The arrays' pointers, and two numbers that are changed for a moment, are looked for in the
    structs themselves, as they differ between versions.
    """
    data = mujoco.MjData(model)
    data.time = time = 1.2345678901234567e-77
    arrays = ("xpos", "xquat", "cvel", "subtree_com", "cdof", "qfrc_passive")
    out = [_find(data._address, time, ctypes.c_double)]
    out += [
        _find(data._address, getattr(data, name).ctypes.data, ctypes.c_uint64) for name in arrays
    ]
    kept = model.opt.timestep, model.opt.integrator
    try:
        model.opt.timestep = time
        out.append(_find(model._address, time, ctypes.c_double))
        model.opt.integrator = 0x5EED5EED
        out.append(_find(model._address, 0x5EED5EED, ctypes.c_int))
    finally:
        model.opt.timestep, model.opt.integrator = kept
    return out


def _find(
    address: int, value: float, kind: type[ctypes.c_double | ctypes.c_uint64 | ctypes.c_int]
) -> int:
    """Return how far behind `address` a number is [bytes]."""
    size = ctypes.sizeof(kind)
    offsets = range(0, 1 << 21, size)
    return next(at for at in offsets if kind.from_address(address + at).value == value)
