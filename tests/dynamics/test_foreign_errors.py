"""Arguments that are far too large, of the wrong kind or masked are named in an own error."""

from dataclasses import replace

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import DataError, InvalidParameter, InvalidShell, ResultError
from sphshell_pin.patches import ShellTaxels
from sphshell_pin.study.fit import Experiment
from sphshell_pin.study.fit.data import read_experiment
from tests.models import LAW, ball, free_q, on_plate

Q = free_q([0.0, 0.0, 0.049])
NAMES = np.array(["a", "b"])


def test_laws_at_the_end_of_the_numbers_run_and_are_explained() -> None:
    scene = on_plate(ball(), sp.HuntCrossleyLaw(1e308, 1e20))
    assert "1 contact pair" in str(scene.explain(Q))
    assert len(sp.Simulation(scene).run(Q, None, 0.001).t)


def test_arguments_are_named(tmp_path) -> None:
    scene = on_plate(ball(), LAW)
    result = sp.Simulation(scene).run(Q, None, 0.001)
    path = tmp_path / "run.mcap"
    for said, use in {
        "scale = .* makes the shell too large": lambda: scene.pairs[0].side_j.shell.transformed(
            1e308
        ),
        "name = .* must be a name": lambda: scene.replace_pair(NAMES, law=LAW),
        "kind = .* must be a name": lambda: result.plot(NAMES),
        "pair = .* must be a name": lambda: ShellTaxels(NAMES),
        "q = .* must hold 7 numbers": lambda: scene.contacts(np.ma.masked_equal(Q, 0.0)),
    }.items():
        with pytest.raises(InvalidParameter, match=said):
            use()
    with pytest.raises(InvalidShell, match="elements must not be masked"):
        sp.Shell(np.eye(3), np.ma.masked_equal([[0, 1, 2]], 2))
    pytest.importorskip("mcap")
    with pytest.raises(InvalidParameter, match="scene = 'wrong' must be a Scene"):
        result.to_mcap(path, scene="wrong")
    with pytest.raises(ResultError, match="are not all from 1970 to 2038"):
        replace(result, t=np.full_like(result.t, -1e308)).to_mcap(path)


def read(force, **more):
    """Return the data of a force at two times; `more` columns by name."""
    data = {"t [s]": [0.0, 1.0], "f [N]": force} | more
    return read_experiment(Experiment(data), 1, {"f": "N"}, 1.0)


def test_data_that_cannot_be_computed_with_are_named() -> None:
    with pytest.raises(DataError, match=r"row 1: 1e\+308 in column 'f \[N\]' is too large"):
        read([1.0, 1e308])
    with pytest.raises(DataError, match=r"'f.sigma' must be positive .*too small to compute with"):
        read([1.0, 2.0], **{"f.sigma [N]": [1e-320] * 2})
    assert read(np.ma.masked_greater([1.0, 2.0], 1.5))[0].measured.tolist() == [1.0]
