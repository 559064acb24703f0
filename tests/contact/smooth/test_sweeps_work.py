"""Along sweeps over joints the work of the force is what the potential loses."""

import numpy as np
import pytest

from sphshell_pin import Shell
from tests.contact.smooth.surfaces import shell_of
from tests.contact.smooth.sweeps import work_error
from tests.contact.smooth.test_sweeps_edges import along_edges, edged, over_vertex, star
from tests.contact.smooth.test_sweeps_folds import KINDS, fold, fold_paths
from tests.contact.smooth.test_sweeps_smooth import SMOOTH, rolled
from tests.studies import mostly_studies


def work_case(name: str):
    """A shell, and paths of a depth of 0.04 to 0.06 over its joints."""
    kind, *size = name.split(" ") if name[-1].isdigit() else (name,)
    if kind in SMOOTH:
        return shell_of(kind, 0.3, kind != "dome"), rolled(kind, 0.04, 4, 0.5, 9, seed=3)
    if kind in KINDS:
        angle = float(size[0])
        paths = [p for where in ("across", "end") for p in fold_paths(kind, angle, 0.04, where)]
        return fold(kind, angle, 0.5), paths
    if size:
        shell = Shell(*star(kind, int(size[0]), float(size[1])), crease_angle=np.radians(0.3))
        return shell, over_vertex(shell, 0.04)
    return edged(kind), along_edges(edged(kind), 0.04, 4)


WORKS = """bowl;dome;torus inside;wavy below;groove 2;groove 20;groove 60;ridge 10;ridge 120;
can;cup;lens;tube;gutter;l plate;box;tip 6 10;pit 4 10;pit 12 40;saddle 6 40"""


SOME = {"bowl", "torus inside", "groove 60", "ridge 10", "can", "lens", "l plate", "pit 4 10"}


@pytest.mark.parametrize(
    "name", mostly_studies(WORKS.replace("\n", "").split(";"), SOME.__contains__)
)
def test_work_is_what_the_potential_loses(name: str) -> None:
    shell, paths = work_case(name)
    assert max(work_error(shell, path) for path in paths) <= 3e-6
