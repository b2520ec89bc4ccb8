"""Envelopes in memory: few, the last used, each made once however many ask."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from service.envelopes import Envelopes


def test_keeps_the_last_used() -> None:
    made: list[str] = []

    def make(ident: str) -> Any:
        made.append(ident)
        return ident.upper()

    envelopes = Envelopes(2)
    for ident in ("a", "b", "a", "c", "a", "b"):
        assert envelopes.get(ident, lambda ident=ident: make(ident)) == ident.upper()
    assert made == ["a", "b", "c", "b"]
    assert "a" in envelopes
    assert "c" not in envelopes


def test_keeps_no_more_points_than_may_be_but_the_last_design_whatever_its_size() -> None:
    def of(points: int) -> Any:
        plant = SimpleNamespace(outcomes=SimpleNamespace(codes=np.zeros((1, points))))
        return SimpleNamespace(plant=plant, controllers=("nf", "lqr"))

    envelopes = Envelopes(10, 20)
    for ident, points in (("a", 3), ("b", 4), ("c", 3), ("d", 1)):
        envelopes.get(ident, lambda points=points: of(points))
    assert [ident in envelopes for ident in "abcd"] == [False, True, True, True]
    envelopes.get("large", lambda: of(50))
    assert [ident in envelopes for ident in ("b", "c", "d", "large")] == [False, False, False, True]
    envelopes.get("small", lambda: of(1))
    assert "large" not in envelopes
    assert "small" in envelopes


def test_made_once_for_many() -> None:
    envelopes, made, start = Envelopes(2), [], threading.Barrier(8)

    def make() -> Any:
        made.append(1)
        threading.Event().wait(0.05)
        return "envelope"

    def work() -> None:
        start.wait()
        assert envelopes.get("a", make) == "envelope"

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 1


def test_a_failure_is_not_kept() -> None:
    envelopes = Envelopes(2)

    def fail() -> Any:
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        envelopes.get("a", fail)
    assert "a" not in envelopes
    ready: Any = "envelope"
    assert envelopes.get("a", lambda: ready) == "envelope"
