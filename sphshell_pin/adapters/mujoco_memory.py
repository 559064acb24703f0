"""Room for friction's memory in the states of a MuJoCo model, and where its structs have what."""

import ctypes
from functools import cache
from pathlib import Path

import numpy as np

from sphshell_pin import _core
from sphshell_pin.adapters import imports_of
from sphshell_pin.base.checks import check_type
from sphshell_pin.dynamics import Scene
from sphshell_pin.dynamics.scene.explain import has_state
from sphshell_pin.errors import InvalidParameter, SphshellError

with imports_of("mujoco"):
    import mujoco

_PLUGIN = "sphshell_pin.memory"
# Numbers that a scene remembers of a pair, and of a contact with the most rings of a bristle: see
# dynamics/scene/scene_rows.cpp.
_OF_PAIR, _OF_CONTACT = 6, 9 + 3 * 8


def reserve(spec: mujoco.MjSpec, spheres: int = 1, contacts: int | None = None) -> None:
    """Make room in the states of the model of `spec` for what the contacts of one attach remember.

    For so many spheres, and so many contacts at once (default: 4 for each sphere), as state of a
    plugin of MuJoCo: it is part of mjSTATE_FULLPHYSICS, so that mj_copyData, mj_getState,
    mj_setState, mj_resetData and rollouts carry it. To be called before spec.compile(), once for
    each attach whose friction has a memory; the first attach takes the first room.
    """
    check_type("spec", spec, mujoco.MjSpec, "must be a mujoco.MjSpec")
    contacts = 4 * spheres if contacts is None else contacts
    for name, count in (("spheres", spheres), ("contacts", contacts)):
        if not isinstance(count, int) or not 0 < count < 100_000:
            raise InvalidParameter(name, count, "must be a whole number from 1 to 99999")
    _slot()
    spec.activate_plugin(_PLUGIN)
    taken = {plugin.name for plugin in spec.plugins}
    name = next(one for k in range(len(taken) + 1) if (one := f"{_PLUGIN} {k}") not in taken)
    made = spec.add_plugin(name=name, plugin_name=_PLUGIN, active=1)
    made.config = {"size": str(1 + _OF_PAIR * spheres + _OF_CONTACT * contacts)}


def memory_of(model: mujoco.MjModel, scene: Scene) -> tuple[int, int, int]:
    """Return the instance of the plugin to remember in, its address and size; -1 for none."""
    rooms = np.flatnonzero(model.plugin == _slot()) if model.nplugin else np.zeros(0, int)
    for room in rooms:
        size = int(model.plugin_statenum[room])
        if size > _OF_PAIR * len(scene.pairs) and not _core.mujoco_taken(model._address, int(room)):
            return int(room), int(model.plugin_stateadr[room]), size
    if has_state(scene):
        count = len(scene.pairs)
        must = (
            "must be compiled with room for this friction's memory: "
            f"spec = mujoco.MjSpec.from_file(...); reserve(spec, spheres={count}); "
            "model = spec.compile(), with reserve of sphshell_pin.adapters.mujoco"
        )
        raise InvalidParameter("model", model, must)
    return -1, 0, 0


@cache
def _slot() -> int:
    """Register the plugin with MuJoCo, and return its slot."""
    folder = Path(mujoco.__file__).parent
    for path in sorted(folder.glob("*mujoco*.*")):
        if path.suffix in {".dll", ".dylib"} or ".so" in path.suffixes:
            library = ctypes.CDLL(str(path))
            made, asked = library.mjp_registerPlugin, library.mj_getPluginConfig
            address = [ctypes.cast(one, ctypes.c_void_p).value or 0 for one in (made, asked)]
            return _core.mujoco_register(*address)
    raise SphshellError(f"MuJoCo's library is not in its package's folder {folder}")


@cache
def layout() -> list[int]:
    """Return where MuJoCo keeps what the core reads: see MujocoLayout in adapters/mujoco.hpp.

    The arrays' pointers, and numbers with a value of their own, are looked for in the structs of a
    small model, as they differ between versions.
    """
    spec = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>"
    )
    reserve(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.time = model.opt.timestep = 1.2345678901234567e-77
    model.opt.integrator, model.opt.enableflags = 0x5EED5EED, 0x6EED6EED
    unused = data.warning[mujoco.mjtWarning.mjWARN_BADQPOS]
    unused.lastinfo = 0x7EED7EED
    in_data = (
        "qvel",
        "plugin_state",
        "xpos",
        "xquat",
        "cvel",
        "subtree_com",
        "cdof",
        "qfrc_passive",
    )
    numbers, in_model = ("integrator", "enableflags"), ("geom_contype", "geom_conaffinity")
    return [
        _find(data._address, data.time, ctypes.c_double),
        *(_find(data._address, _pointer(data, name), ctypes.c_uint64) for name in in_data),
        _find(data._address, unused.lastinfo, ctypes.c_int),
        _find(model._address, model.opt.timestep, ctypes.c_double),
        *(_find(model._address, getattr(model.opt, n), ctypes.c_int) for n in numbers),
        *(_find(model._address, _pointer(model, name), ctypes.c_uint64) for name in in_model),
    ]


def _pointer(struct: object, name: str) -> int:
    return int(getattr(struct, name).ctypes.data)


def _find(
    address: int, value: float, kind: type[ctypes.c_double | ctypes.c_uint64 | ctypes.c_int]
) -> int:
    """Return how far behind `address` a number is [bytes].

    Arrays without elements have the address of the one that follows them: of equal addresses one
    behind the other the last is that of the array.
    """
    size = ctypes.sizeof(kind)

    def is_at(at: int) -> bool:
        return bool(kind.from_address(address + at).value == value)

    first = next(at for at in range(0, 1 << 21, size) if is_at(at))
    return next(at for at in range(first, 1 << 21, size) if not is_at(at + size))
