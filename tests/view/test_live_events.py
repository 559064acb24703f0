"""Whatever a browser says is an event or one sentence, never anything else."""

import contextlib
import json

from hypothesis import given
from hypothesis import strategies as st

from sphshell_pin.view.live.events import FIELDS, LARGEST_MESSAGE, BadMessage, read_event
from tests.tables import cases_of

PUSH = {"type": "push", "body": "tip", "direction": [0, 3, 4], "newtons": 2, "seconds": 0.1}
BAD = cases_of("bad_events")["texts"] | {
    "bytes": b"\x00\x01",
    "beyond floats": '{"type": "parameter", "key": "k", "value": 1' + 400 * "0" + "}",
    "a long name": json.dumps({"type": "parameter", "key": 300 * "k", "value": 1.0}),
    "a direction of no length": json.dumps({**PUSH, "direction": [0, 0, 0]}),
    "a direction of two": json.dumps({**PUSH, "direction": [0, 1]}),
    "huge": json.dumps({"type": "parameter", "key": LARGEST_MESSAGE * "k", "value": 1.0}),
    "deep": 8_000 * "[",
}


def test_a_direction_has_unit_length():
    assert read_event(json.dumps(PUSH))["direction"] == [0.0, 0.6, 0.8]


values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=20),
    lambda one: st.lists(one, max_size=4) | st.dictionaries(st.text(max_size=5), one, max_size=4),
    max_leaves=6,
)


@given(st.sampled_from([*FIELDS, "other"]), st.data())
def test_no_message_is_more_than_an_event_or_a_sentence(kind, data):
    names = [*FIELDS.get(kind, {}), "extra"]
    message = {"type": kind} | {name: data.draw(values) for name in names}
    try:
        event = read_event(json.dumps(message))
    except BadMessage:
        return
    assert set(event) == {"type", *FIELDS[kind]}


@given(st.text())
def test_no_text_is_more_than_a_sentence(text):
    with contextlib.suppress(BadMessage):
        read_event(text)
