"""Results as bytes and back, to the last bit: numbers as numpy archives hold them, words as JSON, no pickle.

The same result always gives the same bytes. They begin with their own SHA-256, so that damage is seen; then comes a
numpy archive (``.npz``, not compressed) of the arrays ``0``, ``1``, .. and of ``words``, a JSON document of everything
else. Arrays that are equal are written once.
"""

from __future__ import annotations

import io
import json
import tokenize
import zipfile
from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from hashlib import sha256
from typing import Any

import numpy as np

from design.outcome import Outcome

#: Said by the bytes about themselves: what they hold is laid out as this version of the layout says.
LAYOUT = "gainfield 1"
#: Time of every member of the archive: the earliest that the format knows. The usual one would be that of writing.
_TIME = (1980, 1, 1, 0, 0, 0)
_DIGEST = sha256().digest_size
#: What numpy and its parts raise of archives that are not what they should be, and what wrong words lead to.
_NOT_READ = (
    ValueError, TypeError, KeyError, IndexError, AttributeError, OSError, EOFError, NotImplementedError, SyntaxError,
    RecursionError, zipfile.BadZipFile, tokenize.TokenError,
)  # fmt: skip


def written(value: Any) -> bytes:
    """A result as bytes.

    Parameters
    ----------
    value : dataclass of arrays of numbers, arrays of objects, numbers, text, None, outcomes, tuples and dataclasses

    Raises
    ------
    TypeError : something else is in it
    """
    writer = _Writer()
    words = json.dumps({"layout": LAYOUT, "value": writer.said(value)})
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_STORED) as archive:
        for name, array in {**writer.members(), "words": np.array(words)}.items():
            member = zipfile.ZipInfo(f"{name}.npy", _TIME)
            member.create_system = 3
            member.external_attr = 0o644 << 16
            data = io.BytesIO()
            np.lib.format.write_array(data, array, allow_pickle=False)
            archive.writestr(member, data.getvalue())
    return sha256(content.getvalue()).digest() + content.getvalue()


def read(content: bytes, kinds: Iterable[type]) -> Any:
    """The result that `written` wrote.

    Parameters
    ----------
    content : the bytes
    kinds : the dataclasses that may be in it; no other is made, whatever the bytes say

    Raises
    ------
    ValueError : damaged bytes, another layout, or no such result
    """
    digest, archived = content[:_DIGEST], content[_DIGEST:]
    if sha256(archived).digest() != digest:
        raise ValueError("not a kept result, or a damaged one: it is not what its digest says")
    try:
        with np.load(io.BytesIO(archived), allow_pickle=False) as archive:
            arrays = {name: np.asarray(archive[name]) for name in archive.files}
        document = json.loads(str(arrays["words"]))
        if document["layout"] != LAYOUT:
            raise ValueError(f"its layout is {document['layout']!r}, not {LAYOUT!r}")
        return _made(document["value"], arrays, {kind.__name__: kind for kind in kinds})
    except _NOT_READ as error:
        raise ValueError(f"not a kept result: {error}") from error


class _Writer:
    """Says values in words, and keeps the arrays that they refer to by number."""

    def __init__(self) -> None:
        self._arrays: dict[tuple[str, tuple[int, ...], bytes], int] = {}

    def members(self) -> dict[str, Any]:
        """The arrays by their numbers."""
        return {
            str(number): np.frombuffer(content, dtype).reshape(shape)
            for (dtype, shape, content), number in self._arrays.items()
        }

    def said(self, value: Any) -> Any:
        """What JSON can hold."""
        if isinstance(value, Outcome):
            return {"outcome": value.value}
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, complex):
            return {"complex": [value.real, value.imag]}
        if isinstance(value, tuple):
            return {"tuple": [self.said(one) for one in value]}
        if isinstance(value, np.ndarray):
            return self._array(value)
        if is_dataclass(value) and not isinstance(value, type):
            of = {field.name: self.said(getattr(value, field.name)) for field in fields(value)}
            return {"kind": type(value).__name__, "of": of}
        raise TypeError(f"a {type(value).__name__} cannot be kept")

    def _array(self, array: np.ndarray[Any, Any]) -> dict[str, Any]:
        if array.dtype == object:
            return {"objects": [self.said(one) for one in array.ravel()], "shape": list(array.shape)}
        key = array.dtype.str, array.shape, array.tobytes()
        return {"array": self._arrays.setdefault(key, len(self._arrays))}


def _made(said: Any, arrays: dict[str, Any], kinds: dict[str, type]) -> Any:
    """The value that was said; KeyError and its like where it cannot be made."""
    if not isinstance(said, dict):
        return said
    if "outcome" in said:
        return Outcome(said["outcome"])
    if "complex" in said:
        return complex(*said["complex"])
    if "tuple" in said:
        return tuple(_made(one, arrays, kinds) for one in said["tuple"])
    if "array" in said:
        return arrays[str(said["array"])]
    if "objects" in said:
        objects = np.empty(len(said["objects"]), dtype=object)
        for index, one in enumerate(said["objects"]):
            objects[index] = _made(one, arrays, kinds)
        return objects.reshape(said["shape"])
    return kinds[said["kind"]](**{name: _made(of, arrays, kinds) for name, of in said["of"].items()})
