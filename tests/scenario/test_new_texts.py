"""Drafts are as they were: every word, and numbers but for their last digits.

Where a change of drafts is meant, `python -m tests.scenario.test_new_texts` writes them anew.
"""

import re
from pathlib import Path

import pytest

from sphshell_pin.scenario.drafting.new import new_scenario

FOLDER = Path(__file__).parents[1] / "data" / "drafts"
DRAFTS = {
    "so100_on_box": (("so100", "box"), {}),
    "hand_around_cylinder": (("allegro_right_hand", "cylinder"), {"tips": "all"}),
    "ball_in_bowl": (("ball", "bowl"), {}),
    "a1_on_plane": (("a1", "plane"), {}),
    "ur5_on_box": (("ur5", "box"), {}),
}
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")


@pytest.mark.parametrize("name", DRAFTS)
def test_a_draft_is_as_it_was(name, tmp_path):
    arguments, options = DRAFTS[name]
    made = new_scenario(*arguments, out=tmp_path / f"{name}.toml", **options).path
    text, before = made.read_text("utf-8"), (FOLDER / made.name).read_text("utf-8")
    assert NUMBER.sub("N", text) == NUMBER.sub("N", before)
    numbers, as_before = ([float(one) for one in NUMBER.findall(of)] for of in (text, before))
    # Two digits are written where a third would tell nothing.
    assert numbers == pytest.approx(as_before, rel=0.03, abs=1e-4)


if __name__ == "__main__":
    for name, (arguments, options) in DRAFTS.items():
        new_scenario(*arguments, out=FOLDER / f"{name}.toml", force=True, **options)
