"""The messages of a browser: one JSON object each, checked before it is used."""

import asyncio
import json
import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from sphshell_pin.errors import SphshellError

LARGEST_MESSAGE = 16_384  # bytes
LONGEST_TEXT = 200
LARGEST_NUMBER = 1e12
MOST_CURVES = 64  # that one browser may ask for

Event = dict[str, Any]


class Client(Protocol):
    """A browser."""

    wake: asyncio.Event

    def send(self, data: Mapping[str, object]) -> None:
        """Send one text, without waiting."""

    def close(self, code: int, reason: str) -> None:
        """End the connection."""


class BadMessage(SphshellError, ValueError):
    """A message that is no event; its text goes back to the browser that sent it."""


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadMessage("must be a number")
    if not abs(value) <= LARGEST_NUMBER:
        raise BadMessage(f"must be a number of at most {LARGEST_NUMBER:g} in size")
    return float(value)


def _not_negative(value: object) -> float:
    if (number := _number(value)) < 0.0:
        raise BadMessage("must not be negative")
    return number


def _text(value: object) -> str:
    if not isinstance(value, str) or len(value) > LONGEST_TEXT:
        raise BadMessage(f"must be a text of at most {LONGEST_TEXT} characters")
    return value


def _switch(value: object) -> bool:
    if not isinstance(value, bool):
        raise BadMessage("must be true or false")
    return value


def _number_or_word(value: object) -> float | str:
    return _text(value) if isinstance(value, str) else _number(value)


def _positive(value: object) -> float:
    if not (number := _number(value)) > 0.0:
        raise BadMessage("must be positive")
    return number


def _point(value: object) -> list[float]:
    if not isinstance(value, list) or len(value) != 3:
        raise BadMessage("must be a list of three numbers")
    return [_number(one) for one in value]


def _direction(value: object) -> list[float]:
    numbers = _point(value)
    length = math.hypot(*numbers)
    if not length > 1e-9:
        raise BadMessage("must have a length")
    return [one / length for one in numbers]


def _keys(value: object) -> list[str]:
    if not isinstance(value, list) or len(value) > MOST_CURVES:
        raise BadMessage(f"must be a list of at most {MOST_CURVES} texts")
    return [_text(one) for one in value]


_Fields = dict[str, Callable[[object], object]]
FIELDS: dict[str, _Fields] = {
    "run": {"on": _switch},
    "step": {"seconds": _not_negative},
    "reset": {},
    "speed": {"value": _not_negative},
    "parameter": {"key": _text, "value": _number_or_word},
    "push": {"body": _text, "direction": _direction, "newtons": _number, "seconds": _not_negative},
    "drag": {"node": _text, "point": _point, "target": _point, "stiffness": _positive},
    "release": {},
    "target": {"joint": _text, "value": _number},
    "show": {"part": _text, "on": _switch},
    "arrows": {"value": _not_negative},
    "charts": {"keys": _keys},
    "seen": {"frame": _number},
}
"""The fields of each kind of event, and the check of each value."""


def read_event(message: str | bytes) -> Event:
    """Return the event that `message` is: {"type": kind, field: value, ...}.

    Raises BadMessage, whose text is one sentence.
    """
    if not isinstance(message, str):
        raise BadMessage("a message must be text, not bytes")
    if len(message) > LARGEST_MESSAGE:
        raise BadMessage(f"a message must not be longer than {LARGEST_MESSAGE} characters")
    try:
        data = json.loads(message)
    except (ValueError, RecursionError):
        raise BadMessage("a message must be JSON") from None
    if not isinstance(data, dict):
        raise BadMessage("a message must be a JSON object")
    kind = data.get("type")
    fields = FIELDS.get(kind) if isinstance(kind, str) else None
    if fields is None:
        raise BadMessage(f"type must be one of {', '.join(FIELDS)}")
    event: Event = {"type": kind}
    for name, check in fields.items():
        if name not in data:
            raise BadMessage(f"'{kind}' needs '{name}'")
        try:
            event[name] = check(data[name])
        except BadMessage as fault:
            raise BadMessage(f"the {name} {fault}") from None
    return event


def newest(events: list[tuple[Client, Event]]) -> list[tuple[Client, Event]]:
    """Keep of a slider's many values only the last, where the last one came; join steps.

    Else, where physics is slow, a key that was held down would act long after its release.
    """
    kept: list[tuple[Client, Event]] = []
    seen: set[tuple[object, ...]] = set()
    for client, event in reversed(events):
        if event["type"] in ("parameter", "speed", "arrows", "target", "drag"):
            key = (event["type"], event.get("key", event.get("joint")))
            if key in seen:
                continue
            seen.add(key)
        elif event["type"] == "step" and kept and kept[-1][1]["type"] == "step":
            kept[-1] = client, event | {"seconds": event["seconds"] + kept[-1][1]["seconds"]}
            continue
        kept.append((client, event))
    return kept[::-1]
