"""Make propeller.stl: twisted blades on a shaft with a cone, as a CAD system exports them [mm].

python -m tests.data.make_propeller    # needs the extra `cad`
"""

from pathlib import Path

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.StlAPI import StlAPI_Writer

from tests.parts import occ

OUT = Path(__file__).with_name("propeller.stl")
# Radius and height along the axis: a long shaft, a cone of 15 degrees, the hub, a blunt cap.
PROFILE = ((0, -120), (8, -120), (8, -40), (14, -17.6), (14, 18), (10, 24), (0, 26))
BLADES, ROOT, TIP = 3, 8.0, 70.0


def blade(turn: float):
    """Sections of a lens, turned more and more against the axis, lofted."""
    sections = []
    for along in np.linspace(0, 1, 5):
        radius, pitch = ROOT + along * (TIP - ROOT), np.radians(60 - 40 * along)
        chord, thick = 24 * (1 - 0.5 * along**2), 3.5 * (1 - 0.7 * along)
        arc = np.linspace(0, 1, 7)
        upper = np.stack([chord * (arc - 0.5), thick * 4 * arc * (1 - arc)], 1)
        lower = np.stack([chord * (arc - 0.5), -0.3 * thick * 4 * arc * (1 - arc)], 1)[-2:0:-1]
        s, t = np.concatenate([upper, lower]).T
        across, axial = s * np.cos(pitch) - t * np.sin(pitch), s * np.sin(pitch) + t * np.cos(pitch)
        x, y = (
            radius * np.cos(turn) - across * np.sin(turn),
            radius * np.sin(turn) + across * np.cos(turn),
        )
        sections.append(np.stack([x, y, axial], 1))
    return occ.lofted(sections, ruled=False)


def main() -> None:
    whole = occ.turned(PROFILE)
    for i in range(BLADES):
        whole = BRepAlgoAPI_Fuse(whole, blade(2 * np.pi * i / BLADES)).Shape()
    BRepMesh_IncrementalMesh(whole, 0.4, False, 0.5, False)
    writer = StlAPI_Writer()
    writer.ASCIIMode = False
    writer.Write(whole, str(OUT))


if __name__ == "__main__":
    main()
