"""Ways to damage bytes, texts and trees of tables; each change is drawn from the `rng` alone."""

import copy
import random
import re
import struct
from collections.abc import Callable, Sequence
from typing import Any

Way = Callable[[random.Random, bytes, Sequence[bytes]], bytes]

LARGEST = 200_000  # [B] of a damaged file

NUMBERS = (
    *("0", "-0.0", "1", "-1", "2", "3", "4", "255", "256", "65536", "2147483647", "2147483648"),
    *("-2147483649", "4294967295", "9223372036854775808", "1" + "0" * 30, "1" + "0" * 5000),
    *("nan", "-nan", "inf", "-inf", "Infinity", "1e308", "1e309", "-1e300", "1e39", "1e-320"),
    *("1e-30", "1e15", "1e6", "0.1", "1.5", "1_0", "0x10", "1d3", "1e", "\u0663", "", "--1"),
)
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2, 3, 255, 2**31, 2**63, 10**30, 10**400, -(2**63) - 1),
    *(0.0, -0.0, 0.5, -1.5, 1e300, -1e300, 1e-320, 1e-30, 1e15, float("nan"), float("inf")),
    *("", "x", "name", "universe", "nan", "../..", "/", "file.py:f", "a\x00b", "\U0001f600"),
    *("[bold]x[/]", "<b>", "%s{0}", "line\nline", "x" * 3000),
    *([], [1], [1, 2, 3], [[]], {}, {"x": 1}),
)
_INTEGERS = (0, 1, 2, 127, 128, 255, 256, 32767, 65535, 2**31 - 1, 2**31, 2**32 - 1)


def damage(rng: random.Random, data: bytes, others: Sequence[bytes] = ()) -> bytes:
    """Return `data` with some of its bytes, lines or numbers changed; `others` are spliced in."""
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 5, 8))):
        data = rng.choice(_WAYS)(rng, data, others)[:LARGEST]
    return data


def _place(rng: random.Random, data: bytes, longest: int = 200) -> tuple[int, int]:
    """Return a random span of `data`; most are short."""
    start = rng.randrange(len(data) + 1)
    return start, min(len(data), start + rng.choice((1, 1, 2, 4, 8, rng.randrange(longest) + 1)))


def _flip(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    if not data:
        return data
    changed = bytearray(data)
    changed[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _overwrite(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    start, stop = _place(rng, data, 16)
    return data[:start] + rng.randbytes(stop - start) + data[stop:]


def _put(rng: random.Random, data: bytes, piece: bytes) -> bytes:
    """Return `data` with `piece` over some of its bytes."""
    start = rng.randrange(max(1, len(data) - len(piece)))
    return data[:start] + piece + data[start + len(piece) :]


def _integer(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    form = rng.choice(("<B", "<H", "<I", ">I", "<Q"))
    largest = 2 ** (8 * struct.calcsize(form))
    return _put(rng, data, struct.pack(form, rng.choice(_INTEGERS) % largest))


def _real(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    value = rng.choice((float("nan"), float("inf"), -1.0, 0.0, 1e38, 1e-40, 1e300, 1e-310))
    piece = struct.pack(rng.choice("<>") + "d", value)
    if abs(value) < 3e38 and rng.random() < 0.7:
        piece = struct.pack(rng.choice("<>") + "f", value)
    return _put(rng, data, piece)


def _insert(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    at, some = rng.randrange(len(data) + 1), rng.randbytes(rng.randrange(1, 9))
    return data[:at] + rng.choice((some, b"\n", b" ", b"\0", b"\xff", b"#", b'"')) + data[at:]


def _delete(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    start, stop = _place(rng, data)
    return data[:start] + data[stop:]


def _repeat(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    start, stop = _place(rng, data)
    return data[:start] + data[start:stop] * rng.choice((1, 1, 2, 10, 1000)) + data[start:]


def _truncate(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _splice(rng: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    other = rng.choice(others) if others else data
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


def _other(pattern: bytes, draw: Callable[[random.Random], bytes]) -> Way:
    """Return what puts another text in the place of one that matches `pattern`."""

    def change(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
        found = list(re.finditer(pattern, data))
        if not found:
            return data
        one = rng.choice(found)
        return data[: one.start()] + draw(rng) + data[one.end() :]

    return change


_number = _other(
    rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?", lambda rng: rng.choice(NUMBERS).encode()
)
_digit = _other(rb"\d", lambda rng: b"%d" % rng.randrange(10))


def _lines(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    at, to, way = rng.randrange(len(lines)), rng.randrange(len(lines)), rng.randrange(4)
    if way == 1:
        lines.insert(to, lines[at])
    elif way == 2:
        lines[at], lines[to] = lines[to], lines[at]
    else:
        lines[at] = lines[at].rstrip(b"\r\n") if way == 3 else b""
    return b"".join(lines)


def repeated(rng: random.Random, data: bytes, _: Sequence[bytes] = ()) -> bytes:
    """Return `data` with a word of it 100 000 times: what takes the square of its length shows."""
    words = data.split(None, 200)[:200]
    word = rng.choice(words)[:12] if words else b"a"
    at = rng.randrange(len(data) + 1)
    return data[:at] + (word + rng.choice((b" ", b"\n", b""))) * 100_000 + data[at:]


def _nest(rng: random.Random, data: bytes, _: Sequence[bytes]) -> bytes:
    at = rng.randrange(len(data) + 1)
    piece = rng.choice((b"[", b"{", b'{"a":', b"[[", b"(", b"a.", b"<a>", b"x={", b"[a."))
    return data[:at] + piece * rng.choice((1, 2, 50, 3000, 20_000)) + data[at:]


_WAYS = (
    *(_flip, _flip, _overwrite, _integer, _real, _insert, _delete, _repeat, _truncate, _splice),
    *(_number, _number, _number, _digit, _lines, _lines, _nest, repeated),
)


def alter(rng: random.Random, tree: Any, values: Sequence[Any] = ()) -> Any:
    """Return a copy of `tree`, dicts and lists of plain values, with some of its nodes changed.

    Most of what is put in is one of `values`, if there are any, as a reader takes them.
    """
    tree = copy.deepcopy(tree)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = list(_places(tree)) if isinstance(tree, dict | list) else []
        if not places:
            return odd_value(rng, values)
        node, key = rng.choice(places)
        _change(rng, node, key, places, values)
    return tree


def word(value: Any) -> str:
    """Return `value` as a word of a text; of one that holds others, an empty list."""
    text = str(value) if not isinstance(value, list | dict) else "[]"
    return "".join(c for c in text if c >= " ")


def odd_value(rng: random.Random, values: Sequence[Any] = ()) -> Any:
    """Return a value that most places do not expect."""
    if values and rng.random() < 0.8:
        return copy.deepcopy(rng.choice(values))
    if rng.random() < 0.05:
        value: Any = 1
        for _ in range(rng.choice((3, 40, 3000))):
            value = [value] if rng.random() < 0.5 else {"a": value}
        return value
    if rng.random() < 0.2:
        return rng.choice((rng.uniform(-2, 2), rng.randrange(-5, 40), 10.0 ** rng.uniform(-25, 25)))
    return copy.deepcopy(rng.choice(VALUES))


def _places(tree: Any) -> Any:
    """Yield (container, key) of every node of `tree`."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        for key, value in list(node.items() if isinstance(node, dict) else enumerate(node)):
            yield node, key
            if isinstance(value, dict | list):
                waiting.append(value)


def _change(rng, node, key, places, values):
    way = rng.randrange(8)
    other, other_key = rng.choice(places)
    try:
        if way == 0:
            del node[key]
        elif way == 1:
            node[key] = copy.deepcopy(other[other_key])
        elif way == 2 and isinstance(node, dict):
            node[rng.choice((f"{key}x", str(other_key), "", "\u00e9", "a.b"))] = node.pop(key)
        elif way == 3 and isinstance(node[key], list):
            node[key] = node[key] * rng.choice((0, 2, 3))
            node[key] += [odd_value(rng, values)] * rng.randrange(2)
        elif way == 4 and isinstance(node[key], int | float):
            node[key] *= rng.choice((-1, 0, 10, 1e-3, 1e3, 1e9, 1e-9, 1e100))
        else:
            node[key] = odd_value(rng, values)
    except (LookupError, OverflowError, RecursionError):
        return  # an earlier change took the place away, or made a number or a tree too large
