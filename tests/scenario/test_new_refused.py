"""What no scenario can be drafted of is refused in one sentence, and leaves no file."""

import tomllib

import pytest
import trimesh

from sphshell_pin import errors
from sphshell_pin.scenario import shipped_scenarios
from tests.studies import mostly_studies
from tests.texts import DATA, text_of

FILES = {
    "BLADE": next(iter(shipped_scenarios().values())).parent / "surfaces" / "bladex_upper.stl",
    "PROBE": DATA / "robots" / "arm_with_probe.urdf",
    "GRIPPER": DATA / "robots" / "three_fingers.urdf",
}
TABLES = tomllib.loads(text_of("scenarios/refused_drafts.toml"))
EVERY = [tuple(row) for rows in TABLES.values() for row in rows]


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """A folder with a part that is too large for a hand, and one that is open."""
    folder = tmp_path_factory.mktemp("parts")
    trimesh.creation.box((0.4, 0.4, 0.4)).export(folder / "large.stl")
    (folder / "sheet.obj").write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n")
    return folder


@pytest.mark.parametrize(
    ("asked", "error", "said"), mostly_studies(EVERY, lambda row: list(row) in TABLES["quick"])
)
def test_what_cannot_be_drafted_is_refused(
    asked, error, said, draft, arm, plate, parts, tmp_path, monkeypatch
):
    monkeypatch.chdir(parts)
    usual = {"surface": "plane"} if "robot" in asked else {"surface": plate, "radius": 0.01}
    options = {"robot": arm, **usual, **asked}
    ends = [FILES.get(one, one) for one in (options.pop("robot"), options.pop("surface"))]
    with pytest.raises(getattr(errors, error), match=said) as caught:
        draft(*ends, **options)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []
