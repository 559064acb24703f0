"""A cross-section of the study of new scenarios: each works in its own run, or is refused."""

import pytest

from tests.new_study import DATA, ask, read_once, sections

ROBOTS = ("three_link_finger", "arm_with_probe", "ball")


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parts")
    return [read_once(DATA / name, folder) for name in ("bladex_upper.stl", "trimesh_wallhole.obj")]


def test_a_scenario_works_in_its_own_run(parts):
    case = ask("ball", parts[0], "-")
    assert not case.failed
    assert not case.refused


@pytest.mark.study
def test_new_scenarios_work_or_are_refused_for_a_reason(parts):
    cases = [
        ask(robot, part, place)
        for robot in ROBOTS
        for part in parts
        for place in (("-",) if robot == "ball" else ("below", "+y"))
    ]
    assert [case for case in cases if case.failed] == []
    refused = {(case.robot, case.part, case.place): case.refused for case in cases if case.refused}
    # It moves in the plane of x and z; nothing else is refused.
    assert set(refused) == {("three_link_finger", part.stem, "+y") for part in parts}
    assert all("cannot move along +y" in said for said in refused.values())
    works, because = sections(cases)
    assert ["arm_with_probe", "slides 2", "presses 2"] in works.table
    assert ["the joints cannot move the tip that way", "2"] in because.table
