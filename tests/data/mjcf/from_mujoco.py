"""Write mujoco.json: what MuJoCo (4.0.0) makes of the models in this folder.

Run with a Python that has MuJoCo: python tests/data/mjcf/from_mujoco.py
"""

import json
from pathlib import Path

import mujoco
import numpy as np

FOLDER = Path(__file__).parent


def told(path):
    """Return joints, a state, and mass matrix and bias forces in it."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(7)
    data.qpos[:] = model.qpos0 + 0.3 * rng.normal(size=model.nq)
    mujoco.mj_normalizeQuat(model, data.qpos)
    data.qvel[:] = rng.normal(size=model.nv)
    model.opt.gravity[:] = 0, 0, -9.81
    model.body_gravcomp[:] = 0
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    joints = [
        {
            "name": model.joint(j).name,
            "type": int(model.jnt_type[j]),
            "qpos0": float(model.qpos0[model.jnt_qposadr[j]]),
            "range": model.jnt_range[j].tolist() if model.jnt_limited[j] else None,
            "damping": float(np.ravel(model.dof_damping[model.jnt_dofadr[j]])[0]),
            "friction": float(model.dof_frictionloss[model.jnt_dofadr[j]]),
            "armature": float(model.dof_armature[model.jnt_dofadr[j]]),
        }
        for j in range(model.njnt)
    ]
    spheres = {
        model.geom(g).name: [*data.geom_xpos[g].tolist(), float(model.geom_size[g][0])]
        for g in range(model.ngeom)
        if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_SPHERE and model.geom(g).name
    }
    sites = {model.site(s).name: data.site_xpos[s].tolist() for s in range(model.nsite)}
    return {
        "joints": joints,
        "qpos": data.qpos.tolist(),
        "qvel": data.qvel.tolist(),
        "mass": mass.tolist(),
        "bias": data.qfrc_bias.tolist(),
        "spheres": spheres,
        "sites": sites,
    }


if __name__ == "__main__":
    every = {path.name: told(path) for path in sorted(FOLDER.glob("*.xml"))}
    (FOLDER / "mujoco.json").write_text(json.dumps(every) + "\n")
