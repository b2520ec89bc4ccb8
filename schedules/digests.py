"""Digests of what results depend on: equal studies have equal digests, others do not."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from hashlib import sha256
from typing import Any

import numpy as np

from schedules.study import Controller, Study


def study_digest(study: Study, request: Controller) -> str:
    """Digest of a study as far as the gains and figures of this controller depend on it.

    Its name, its other controllers and the specs of its pack, which only judge, do not count.

    Raises
    ------
    TypeError : as of `digest_of`
    """
    return digest_of(replace(study, name="", controllers=(request,), spec_pack=()))


def digest_of(*values: Any) -> str:
    """SHA-256 of values, in hexadecimal.

    Raises
    ------
    TypeError : something is none of dataclass, array of numbers, number, text, mapping, tuple or list, None
    """
    found = sha256()
    for piece in _pieces(values):
        found.update(len(piece).to_bytes(8, "big"))
        found.update(piece)
    return found.hexdigest()


def _pieces(value: Any) -> Iterator[bytes]:
    """A value as a sequence of bytes that no other value has."""
    if is_dataclass(value) and not isinstance(value, type):
        yield type(value).__qualname__.encode()
        for field in fields(value):
            yield field.name.encode()
            yield from _pieces(getattr(value, field.name))
    elif isinstance(value, Mapping):
        yield f"mapping of {len(value)}".encode()
        for name in sorted(value):
            yield from _pieces(name)
            yield from _pieces(value[name])
    elif isinstance(value, tuple | list):
        yield f"sequence of {len(value)}".encode()
        for one in value:
            yield from _pieces(one)
    elif isinstance(value, np.ndarray) and value.dtype != object:
        yield f"array {value.dtype.str} {value.shape}".encode()
        yield value.tobytes()
    elif isinstance(value, np.bool_ | bool | int | np.integer | str) or value is None:
        yield f"{'text' if isinstance(value, str) else 'value'} {value}".encode()
    elif isinstance(value, float | np.floating):
        yield b"number " + struct.pack(">d", value)
    else:
        raise TypeError(f"what holds a {type(value).__name__} has no digest")
