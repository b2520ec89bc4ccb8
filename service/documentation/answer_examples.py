"""Answers that the documentation shows: what the service answered to the examples, trimmed, kept as files.

The files name the designs and the job that they are about by marks, since ids change with the code;
``make examples`` writes them anew.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

ANSWERS = Path(__file__).parent.parent / "examples" / "answers"
#: How many entries of a list are kept: of numbers and words, and of anything larger.
_KEPT, _KEPT_LARGE = 4, 2
_MARK = "<{}>"


def file_name(method: str, path: str) -> str:
    """Name of the file of an operation: ``get_v1_designs_id.json``."""
    words = path.strip("/").replace("{", "").replace("}", "").replace(".", "_").split("/")
    return "_".join([method, *words]) + ".json"


def trimmed(answer: Any) -> Any:
    """The answer with its lists cut to their first entries, all of its fields kept."""
    if isinstance(answer, dict):
        return {name: trimmed(value) for name, value in answer.items()}
    if isinstance(answer, list):
        large = any(isinstance(entry, dict | list) for entry in answer)
        return [trimmed(entry) for entry in answer[: _KEPT_LARGE if large else _KEPT]]
    return answer


def marked(answer: Any, ids: Mapping[str, str]) -> str:
    """Text of a file: `ids` by the names that stand in for them."""
    text = json.dumps(answer, indent=1, ensure_ascii=False)
    for name, ident in ids.items():
        text = text.replace(ident, _MARK.format(name))
    return text + "\n"


def example_answer(method: str, path: str, ids: Mapping[str, Callable[[], str]]) -> Any | None:
    """The answer that an operation is shown with; None where there is no file, as of answers that are not JSON."""
    text = _texts().get(file_name(method, path))
    if text is None:
        return None
    for name, ident in ids.items():
        mark = _MARK.format(name)
        if mark in text:
            text = text.replace(mark, ident())
    return json.loads(text)


@cache
def _texts() -> dict[str, str]:
    return {file.name: file.read_text(encoding="utf-8") for file in sorted(ANSWERS.glob("*.json"))}
