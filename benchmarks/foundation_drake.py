"""FoundationLaw against Drake's hydroelastic contact: force, area and time on the same scenes.

    python -m benchmarks.foundation_drake --drake PYTHON

PYTHON is an interpreter that has Drake (`pip install drake`); it runs this file as a script. A
compliant ball touches a rigid box: its face, its edge, its corner. Drake's pressure is E (1 -
rho/R)
on a tetrahedral mesh of the ball, ours kappa (R^2 - rho^2) / (2 rho): they agree to first order in
the depth with E = kappa R.
"""

import argparse
import json
import subprocess
import sys
import time
from typing import Any

import numpy as np

RADIUS, KAPPA, SIDE = 0.05, 2e8, 0.2  # [m], [Pa/m], [m]
HINTS = (0.5, 0.1, 0.05)  # edges of the tetrahedra, in radii
# Over the face at (0.3, 0.2) of its half side; over the edge and the corner on their bisectors.
DIRECTIONS = {"face": (0, 0, 1), "edge": (1, 0, 1), "corner": (1, 1, 1)}
STARTS = {"face": (0.3, 0.2, 1), "edge": (1, 0.2, 1), "corner": (1, 1, 1)}
DEPTHS = (0.01, 0.1, 0.3)  # of the closest point, in radii


def centers() -> dict[str, list[list[float]]]:
    """Return the ball's center for each place, at each depth."""
    out = {}
    for place, direction in DIRECTIONS.items():
        along = np.array(direction) / np.linalg.norm(direction)
        start = np.array(STARTS[place]) * SIDE / 2
        out[place] = [list(start + (1 - depth) * RADIUS * along) for depth in DEPTHS]
    return out


def drake_side(hint: float) -> list[Any]:
    """Return force [N], area [m^2] and time of a query [s] of every place and depth, by Drake."""
    from pydrake.geometry import (
        AddCompliantHydroelasticProperties,
        AddRigidHydroelasticProperties,
        Box,
        ProximityProperties,
        Sphere,
    )
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, CoulombFriction
    from pydrake.multibody.tree import SpatialInertia
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    plant.set_contact_model(ContactModel.kHydroelastic)
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, RADIUS))
    soft, hard = ProximityProperties(), ProximityProperties()
    AddCompliantHydroelasticProperties(hint * RADIUS, KAPPA * RADIUS, soft)
    AddRigidHydroelasticProperties(SIDE, hard)
    for properties in (soft, hard):
        properties.AddProperty("material", "coulomb_friction", CoulombFriction(0.0, 0.0))
        properties.AddProperty("material", "hunt_crossley_dissipation", 0.0)
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(RADIUS), "ball", soft)
    box = Box(SIDE, SIDE, SIDE)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), box, "box", hard)
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    port = plant.get_contact_results_output_port()
    out = []
    for place, points in centers().items():
        for depth, center in zip(DEPTHS, points, strict=True):
            times = []
            for turn in range(30):
                # A new state each time: results are kept.
                moved = np.array(center) + [1e-12 * turn, 0, 0]
                plant.SetFreeBodyPose(context, ball, RigidTransform(moved))
                start = time.perf_counter()
                port.Eval(context)
                times.append(time.perf_counter() - start)
            results = port.Eval(context)
            force, area = np.zeros(3), 0.0
            for k in range(results.num_hydroelastic_contacts()):
                info = results.hydroelastic_contact_info(k)
                force += info.F_Ac_W().translational()
                area += info.contact_surface().total_area()
            out.append([place, depth, list(np.abs(force)), area, float(np.median(times))])
    return out


def our_side() -> list[Any]:
    """Return the same of FoundationLaw; the time is that of one query and force in C++."""
    import sphshell_pin as sp
    from benchmarks import foundation as benchmark

    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * SIDE / 2
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    shell = sp.Shell(corners, quads, side="outside")
    law = sp.FoundationLaw(KAPPA, 1.0)
    out = []
    for place, points in centers().items():
        for depth, center in zip(DEPTHS, points, strict=True):
            _, forces, _, areas = sp.foundation_pressure(shell, center, RADIUS, law)
            benchmark.RADIUS = RADIUS
            near = benchmark.runner(shell, np.array(center), law, False)
            far = benchmark.runner(shell, np.array(center) + [0, 0, 1.0], law, False)
            taken = float(np.median([near() - far() for _ in range(5)]))
            force = [float(x) for x in forces.sum(axis=0)]
            out.append([place, depth, force, float(areas.sum()), taken])
    return out


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drake", help="a Python interpreter that has Drake")
    parser.add_argument("--hint", type=float, help="print what Drake finds, and nothing else")
    given = parser.parse_args()
    if given.hint:
        print(json.dumps(drake_side(given.hint)))
        return
    theirs = []
    for hint in HINTS:
        call = [given.drake, __file__, "--hint", str(hint)]
        done = subprocess.run(call, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{given.drake} could not run Drake: {done.stderr.strip().splitlines()[-1]}")
        theirs.append(json.loads(done.stdout))
    head = "| place | depth / R | force [N] | area [mm^2] | time [us] |"
    print(head + "".join(f" Drake {hint:g} R: force | area | time |" for hint in HINTS))
    print("|---" * (5 + 3 * len(HINTS)) + "|")
    for k, (place, depth, force, area, taken) in enumerate(our_side()):
        size = np.linalg.norm(force)
        row = f"| {place} | {depth:g} | {size:.4g} | {area * 1e6:.4g} | {taken * 1e6:.3g} |"
        for found in theirs:
            push, there, cost = found[k][2:]
            row += (
                f" {np.linalg.norm(push) / size:.4f} x | {there / area:.4f} x | {cost * 1e6:.3g} |"
            )
        print(row)


if __name__ == "__main__":
    main()
