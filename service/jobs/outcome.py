"""What a worker answers to a task: its result or a problem, and which code it runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import orjson


@dataclass(frozen=True)
class Outcome:
    """The end of a task.

    Attributes
    ----------
    version : the code of the worker: results of other code are not mixed with those of this
    problem : the problem document it ended with; None when it has a result
    result : the bytes it was worked out for; none beside a problem
    """

    version: str
    problem: dict[str, Any] | None
    result: bytes

    def to_bytes(self) -> bytes:
        """A line of JSON, and the result."""
        return orjson.dumps({"version": self.version, "problem": self.problem}) + b"\n" + self.result

    @classmethod
    def from_bytes(cls, content: bytes) -> Outcome:
        """The outcome written so.

        Raises
        ------
        ValueError : it is none
        """
        line, end, result = content.partition(b"\n")
        document = orjson.loads(line)
        if not end or not isinstance(document, dict) or set(document) != {"version", "problem"}:
            raise ValueError("not an outcome of a task")
        return cls(document["version"], document["problem"], result)
