"""Proofs between the grid points on the wire."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from model.flight import FlightGrid
from schedules.proof.frozen import SlowestPoint
from schedules.proof.reading_error import LARGEST_ERROR, ReadingMargin, ReadingMargins
from schedules.proof.result import CellProof, CellStatus, ScheduleProof
from schedules.proof.scheduling_rates import SchedulingRates
from schedules.proof.table_proof import rate_bound
from schedules.rules import INTERPOLATIONS, OUTS_OF_RANGE
from service.presenters.grid import grid_document

NOT_ASKED = "not asked for"


@dataclass(frozen=True, eq=False)
class Verified:
    """What is known of a controller between its grid points.

    Attributes
    ----------
    kind : of the controller
    proof : cell by cell
    margins, rates : or why there are none, in words
    """

    kind: str
    proof: ScheduleProof
    margins: ReadingMargins | str = NOT_ASKED
    rates: SchedulingRates | str = NOT_ASKED


def verification_document(grid: FlightGrid, found: Mapping[str, Verified]) -> dict[str, Any]:
    """Proofs by controller."""
    return {
        "grid": grid_document(grid),
        "interpolation": INTERPOLATIONS["multilinear"],
        "out_of_range": OUTS_OF_RANGE["clip"],
        "controllers": {name: _controller(one) for name, one in found.items()},
    }


def _controller(found: Verified) -> dict[str, Any]:
    proof = found.proof
    return {
        "kind": found.kind,
        "covers": proof.covers,
        "reason": proof.reason,
        "cells": [_cell(cell) for cell in proof.cells],
        "summary": _summary(found),
    }


def _cell(cell: CellProof) -> dict[str, Any]:
    slowest = None if cell.slowest is None else _slow_point(cell.slowest)
    return {
        "index": list(cell.index),
        "status": str(cell.status),
        "decay_rate_1_s": cell.alpha,
        "wanted_1_s": cell.wanted,
        "pieces": len(cell.pieces),
        "reason": cell.reason,
        "counterexample": slowest if cell.status is CellStatus.REFUTED else None,
        "slowest": slowest,
    }


def _slow_point(point: SlowestPoint) -> dict[str, Any]:
    return {
        "altitude_m": point.altitude,
        "dynamic_pressure_pa": point.dynamic_pressure,
        "largest_real_part": point.eigenvalue.real,
        "factors": dict(point.factors),
    }


def _summary(found: Verified) -> dict[str, Any]:
    said, margins, rates = found.proof.summary, found.margins, found.rates
    return {
        "proved": said.proved,
        "refuted": said.refuted,
        "undecided": said.undecided,
        "sampled": said.sampled,
        "decay_rate_1_s": said.alpha,
        "pieces": said.pieces,
        "common": said.common,
        "words": said.words,
        "rate_bound": None if isinstance(rates, str) else asdict(rate_bound(found.proof, rates)),
        "rate_bound_reason": rates if isinstance(rates, str) else None,
        "signal_error": None if isinstance(margins, str) else _signal_error(margins),
        "signal_error_reason": margins if isinstance(margins, str) else None,
    }


def _signal_error(margins: ReadingMargins) -> dict[str, Any]:
    return {
        **_reading_error(margins.envelope),
        "searched_percent": 100.0 * LARGEST_ERROR,
        "cells": [_reading_error(cell) for cell in margins.cells],
    }


def _reading_error(margin: ReadingMargin) -> dict[str, Any]:
    return {
        "index": None if margin.index is None else list(margin.index),
        "proved_percent": 100.0 * margin.proved,
        "stable_down_percent": 100.0 * margin.low,
        "stable_up_percent": 100.0 * margin.high,
    }
