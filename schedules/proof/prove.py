"""Proof of a designed controller's schedule between its grid points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.perturbations import Uncertainty
from schedules.proof.cell_search import CellSearch
from schedules.proof.cells import Cell, cells
from schedules.proof.family import LoopFamily, family
from schedules.proof.flight_box import Box, Flight
from schedules.proof.flown_with import NotProvable
from schedules.proof.frozen import SlowestPoint, slower_still, slowest_points
from schedules.proof.result import CellProof, CellStatus, ScheduleProof
from schedules.proof.sampled import sampled_points
from schedules.proof.search import lyapunov
from schedules.study import Study


@dataclass(frozen=True)
class ProofRequest:
    """What is to be proved.

    Attributes
    ----------
    fraction : of the slowest pole's rate at the corners of each cell: the rate wanted there, where `decay` is None
    decay : the rate wanted everywhere [1/s]; 0 is stability
    changes : parameters of the plant that may be off, each up to its `change`
    together : all of them at once, or each alone
    most_pieces : into how many pieces a cell may be cut
    largest : prove as much as can be, not only what is wanted

    Raises
    ------
    ValueError : a number out of range
    """

    fraction: float = 0.5
    decay: float | None = None
    changes: Sequence[Uncertainty] = ()
    together: bool = False
    most_pieces: int = 64
    largest: bool = False

    def __post_init__(self) -> None:
        if not 0.0 <= self.fraction < 1.0:
            raise ValueError(f"fraction must be at least 0 and less than 1, is {self.fraction}")
        if self.decay is not None and not 0.0 <= self.decay < np.inf:
            raise ValueError(f"decay must be at least 0 and finite, is {self.decay}")
        if self.most_pieces < 1:
            raise ValueError(f"most_pieces must be at least 1, is {self.most_pieces}")


def prove(
    study: Study, plant: PlantEnvelope, designed: DesignedController, request: ProofRequest | None = None
) -> ScheduleProof:
    """Prove a controller's closed loop between its grid points, cell by cell, or say why not.

    Gains are multilinear between the grid points. Feed-forward has no part in stability. What is proved of a piece
    of the envelope holds for every course of altitude and speed inside it, however fast, in deviations from the
    moving trim.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : any controller
    request : what is wanted; by default half the rate of the slowest pole at the corners, of the model

    Raises
    ------
    ValueError : a parameter named twice
    """
    request = request or ProofRequest()
    grid = study.grid
    flight = Flight(plant.system, grid.speed_axis, grid.temperature_offset)
    whole = cells(plant.grid.axes)
    made = family(study, plant, designed, request.changes, request.together)
    if isinstance(made, NotProvable):
        found = sampled_points(study, plant, designed) if made.known else {}
        looked = tuple(_sampled(cell, designed, request, made.reason, found.get(cell.index)) for cell in whole)
        return ScheduleProof(
            designed.request.name, plant.grid.axes, looked, None, None, flight, "the model", made.reason
        )  # fmt: skip
    missing = {cell.index: _missing(cell, designed, flight) for cell in whole}
    usable = [cell for cell in whole if missing[cell.index] is None]
    proofs, common = _proved(made, flight, usable, designed, request)
    by_index = {proof.index: proof for proof in proofs}
    every = tuple(by_index.get(cell.index) or _unusable(cell, missing[cell.index]) for cell in whole)
    if len(usable) < len(whole):
        common = None
    return ScheduleProof(
        designed.request.name, plant.grid.axes, every, common, made, flight, made.variants.words, None
    )  # fmt: skip


def _proved(
    made: LoopFamily, flight: Flight, usable: list[Cell], designed: DesignedController, request: ProofRequest
) -> tuple[list[CellProof], FloatArray | None]:
    """Proofs of the cells that have gains, and the Lyapunov matrix that proves them all, if there is one."""
    if not usable:
        return [], None
    boxes, gains = [cell.box for cell in usable], np.stack([cell.corners(made.tables) for cell in usable])
    slow = slowest_points(made, flight, boxes, gains)
    rates = -np.max(designed_poles(designed), axis=-1)
    wanted = [_wanted(request, cell.corners(rates)) for cell in usable]
    search = CellSearch(made, flight, most_pieces=request.most_pieces, largest=request.largest)
    common = None
    if all(point.rate > rate for point, rate in zip(slow, wanted, strict=True)):
        common = _common(search, usable, wanted)
    proofs = [_cell(search, cell, point, rate, common) for cell, point, rate in zip(usable, slow, wanted, strict=True)]
    return proofs, common


def _common(search: CellSearch, usable: list[Cell], wanted: list[float]) -> FloatArray | None:
    """One Lyapunov matrix that proves all cells at the rates wanted of them; None where none was found."""
    parts = [search.part(cell, cell.box) for cell in usable]
    P = lyapunov(np.concatenate([part.faster(rate) for part, rate in zip(parts, wanted, strict=True)]))
    if P is None:
        return None
    pieces = [search.piece(part, P) for part in parts]
    proved = all(piece is not None and piece.alpha > rate for piece, rate in zip(pieces, wanted, strict=True))
    return P if proved else None


def designed_poles(designed: DesignedController) -> FloatArray:
    """Real parts (*G, n) of the closed loop's poles at the grid points, nan where there are no gains."""
    closed, ok = designed.loop.closed, designed.outcomes.ok
    poles = np.full(closed.shape[:-1], np.nan)
    poles[ok] = np.linalg.eigvals(closed[ok]).real
    return poles


def _wanted(request: ProofRequest, rates: FloatArray) -> float:
    if request.decay is not None:
        return request.decay
    return max(0.0, request.fraction * float(np.min(rates)))


def _cell(search: CellSearch, cell: Cell, point: SlowestPoint, wanted: float, common: FloatArray | None) -> CellProof:
    nan = float("nan")
    if point.rate > wanted:
        found = search.proved(cell, wanted, common)
        if found.missing is None:
            alpha = min(piece.alpha for piece in found.pieces)
            return CellProof(cell.index, cell.box, CellStatus.PROVED, wanted, alpha, found.pieces, point, None)
        slower = slower_still(search.made, search.flight, found.missing.box, found.missing.gains)
        point = min(point, slower, key=lambda at: at.rate)
        if point.rate > wanted:
            reason = _undecided(found.missing.box, point, wanted, found.tried)
            return CellProof(cell.index, cell.box, CellStatus.UNDECIDED, wanted, nan, (), point, reason)
    return CellProof(cell.index, cell.box, CellStatus.REFUTED, wanted, nan, (), point, _too_slow(point, wanted))


def _too_slow(point: SlowestPoint, wanted: float) -> str:
    off = "".join(f", {name} times {factor:g}" for name, factor in point.factors)
    return (
        f"at {point.altitude:.6g} m and {point.dynamic_pressure:.6g} Pa{off} the eigenvalue {point.eigenvalue:.4g} "
        f"rad/s decays slower than {wanted:.4g} 1/s"
    )


def _undecided(box: Box, point: SlowestPoint, wanted: float, pieces: int) -> str:
    return (
        f"no Lyapunov matrix was found that proves {wanted:.4g} 1/s from {box.altitude[0]:.6g} to "
        f"{box.altitude[1]:.6g} m at speeds from {box.speed[0]:.6g} to {box.speed[1]:.6g}, with the cell "
        f"in {pieces} pieces; the slowest point that was looked at decays at {point.rate:.4g} 1/s"
    )


def _missing(cell: Cell, designed: DesignedController, flight: Flight) -> str | None:
    """Why a cell cannot be looked at, in words; None where it can."""
    failed = cell.failed(designed.outcomes)
    if failed is None and not flight.within_model(cell.box):
        return "Mach 1 is reached inside the cell: the subsonic model does not cover it"
    return failed


def _unusable(cell: Cell, reason: str | None) -> CellProof:
    nan = float("nan")
    return CellProof(cell.index, cell.box, CellStatus.UNDECIDED, nan, nan, (), None, reason)


def _sampled(
    cell: Cell, designed: DesignedController, request: ProofRequest, reason: str, point: SlowestPoint | None
) -> CellProof:
    """A cell of loops that cannot be taken apart: refuted where a point that was looked at is too slow."""
    if failed := cell.failed(designed.outcomes):
        return _unusable(cell, failed)
    nan = float("nan")
    if point is None:
        return CellProof(cell.index, cell.box, CellStatus.SAMPLED, nan, nan, (), None, reason)
    wanted = _wanted(request, cell.corners(-np.max(designed_poles(designed), axis=-1)))
    if point.rate <= wanted:
        return CellProof(
            cell.index, cell.box, CellStatus.REFUTED, wanted, nan, (), point, f"{_too_slow(point, wanted)}; {reason}"
        )
    return CellProof(cell.index, cell.box, CellStatus.SAMPLED, wanted, nan, (), point, reason)
