"""A circle with 5 N on Crocoddyl's own rigid contact: needs Crocoddyl, and not this package.

Run by `python -m benchmarks.circle`, with an interpreter that has crocoddyl 3.2.1 beside pin 4.0.0,
for which its wheels are built.

python benchmarks/circle_rigid.py PROBLEM.npz SOLUTION.npz
"""

import sys
import time
from typing import Any

import crocoddyl
import example_robot_data
import numpy as np
import pinocchio as pin

BAUMGARTE = np.array([1e4, 200.0])  # [1/s^2], [1/s]


def main(problem_file: str, solution_file: str) -> None:
    p = dict(np.load(problem_file))
    whole = example_robot_data.load("panda").model
    locked = [whole.getJointId(f"panda_finger_joint{k}") for k in (1, 2)]
    q_whole = np.concatenate((p["guess"][0, :7], p["fingers"]))
    model = pin.buildReducedModel(whole, locked, q_whole)
    q0 = p["guess"][0, :7]
    np.testing.assert_allclose(pin.crba(model, model.createData(), q0), p["mass"], atol=1e-9)
    hand = model.getFrameId("panda_hand_tcp")
    state = crocoddyl.StateMultibody(model)
    actuation = crocoddyl.ActuationModelFull(state)
    smooth = crocoddyl.ActivationModelWeightedQuad(np.repeat([1e-3, 1.0], 7))
    steps, dt = len(p["weights"]), float(p["dt"])

    def node(k: int) -> crocoddyl.ActionModelAbstract:
        costs = crocoddyl.CostModelSum(state)

        def add(name: str, weight: float, residual: Any, activation: Any = None) -> None:
            parts = (state, residual) if activation is None else (state, activation, residual)
            costs.addCost(name, crocoddyl.CostModelResidual(*parts), weight)

        normal, center = p["normals"][k], p["centers"][k]
        # The half turn that swaps the world's z and the normal.
        between = normal + np.array([0.0, 0.0, 1.0])
        between /= np.linalg.norm(between)
        half_turn = 2.0 * np.outer(between, between) - np.eye(3)
        plane = crocoddyl.ContactModel1D(
            state,
            hand,
            float(normal @ center),
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
            half_turn,
            7,
            BAUMGARTE,
        )
        contacts = crocoddyl.ContactModelMultiple(state, 7)
        contacts.addContact("blade", plane)
        if k < steps:
            wanted = pin.Force(np.array([0.0, 0.0, float(p["force"])]), np.zeros(3))
            reference = crocoddyl.ResidualModelContactForce(state, hand, wanted, 1, 7)
            add("force", 1e2, reference)
            add("torques", 1e-3, crocoddyl.ResidualModelControl(state, p["weights"][k]))
        placement = pin.SE3(p["hand"], center)
        add("hand", 1e5, crocoddyl.ResidualModelFramePlacement(state, hand, placement, 7))
        add("state", 1.0, crocoddyl.ResidualModelState(state, p["guess"][k], 7), smooth)
        dynamics = crocoddyl.DifferentialActionModelContactFwdDynamics(
            state, actuation, contacts, costs, 0.0, True
        )
        if k == steps:
            return crocoddyl.IntegratedActionModelEuler(dynamics, 0.0)
        return crocoddyl.IntegratedActionModelRK(dynamics, crocoddyl.RKType.four, dt)

    problem = crocoddyl.ShootingProblem(p["guess"][0], [node(k) for k in range(steps)], node(steps))
    problem.nthreads = 1
    solver = crocoddyl.SolverFDDP(problem)
    solver.th_stop = float(p["th_stop"])
    begun = time.process_time()
    solver.solve(list(p["guess"]), list(p["weights"]), 100)
    seconds = time.process_time() - begun
    np.savez(
        solution_file,
        xs=np.array(solver.xs),
        us=np.array(solver.us),
        gains=np.array(solver.K),
        iterations=solver.iter,
        seconds=seconds,
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
