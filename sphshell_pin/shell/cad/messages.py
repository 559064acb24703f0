"""Messages of a CAD child to the process that started it, with a checksum."""

from __future__ import annotations

import hashlib
import pickle

ALIVE = b"alive"
"""What a child sends in the middle of a long job: the time limit begins anew."""

_DIGEST = hashlib.blake2b().digest_size


def pack(value: object) -> bytes:
    """Return a message that holds any value that can be pickled."""
    data = pickle.dumps(value)
    return hashlib.blake2b(data).digest() + data


def unpack(message: bytes) -> object:
    """Return the value of a message.

    Raises
    ------
    ValueError
        If the message is damaged: a child in which OpenCASCADE has failed may send anything.
    """
    data = message[_DIGEST:]
    if hashlib.blake2b(data).digest() != message[:_DIGEST]:
        raise ValueError("a message of the CAD child is damaged")
    return pickle.loads(data)
