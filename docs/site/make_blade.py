"""Make scenarios/surfaces/blade.step: the upper side of a propeller's blade, 0.41 m long.

    python docs/site/make_blade.py

BladeX's model propeller has a face of 526 x 13 poles that runs round the blade's edges. Here a
B-spline surface goes through a grid of its points between the edges, in 3.2 times the size; the
largest distance of the face from it is printed.
"""

from pathlib import Path

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.collections import Array2_gp_Pnt
from OCP.GeomAbs import GeomAbs_C2
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface, GeomAPI_ProjectPointOnSurf
from OCP.gp import gp_Pnt
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

from sphshell_pin.shell.cad.reading import read_model

ROOT = Path(__file__).parents[2]
MODEL = ROOT / "tests" / "data" / "corpus" / "bladex_upper.iges"
STEP = ROOT / "scenarios" / "surfaces" / "blade.step"
SIZE = 3.2  # of the propeller, against its model
GRID = 25, 9  # points along the chord and the span
EDGES = 0.05  # of the chord left out at each


def model():
    """Return BladeX's surface; its parameters are in [0, 1]."""
    return BRep_Tool.Surface_s(read_model(MODEL).faces[0].shape)


def places(surface, m, n):
    """Return points (m, n, 3) [mm] of the surface in the propeller's size, on a grid."""
    us = np.linspace(EDGES, 1 - EDGES, m)
    vs = np.linspace(0, 1, n)
    points = [[surface.Value(float(u), float(v)) for v in vs] for u in us]
    return SIZE * np.array([[[p.X(), p.Y(), p.Z()] for p in row] for row in points])


def through(points):
    """Return a B-spline surface through the grid."""
    m, n, _ = points.shape
    grid = Array2_gp_Pnt(1, m, 1, n)
    for i in range(m):
        for j in range(n):
            grid.SetValue(i + 1, j + 1, gp_Pnt(*points[i, j]))
    fit = GeomAPI_PointsToBSplineSurface(grid, 3, 5, GeomAbs_C2, 1e-3)
    assert fit.IsDone()
    return fit.Surface()


def main():
    """Write the file."""
    exact = model()
    smooth = through(places(exact, *GRID))
    face = BRepBuilderAPI_MakeFace(smooth, 1e-6).Face()
    off = max(
        GeomAPI_ProjectPointOnSurf(gp_Pnt(*point), smooth).LowerDistance()
        for point in places(exact, 101, 31).reshape(-1, 3)
    )
    print(
        f"{smooth.NbUPoles()} x {smooth.NbVPoles()} poles, at most {off:.3g} mm from BladeX's face"
    )
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer = STEPControl_Writer()
    writer.Transfer(face, STEPControl_AsIs)
    assert writer.Write(str(STEP)) == IFSelect_RetDone


if __name__ == "__main__":
    main()
