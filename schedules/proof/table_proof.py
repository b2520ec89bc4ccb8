"""What a schedule carries of its proof: the summary, and the digest of the table that it is of."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from model.arrays import FloatArray
from model.flight import GridAxis
from schedules.designed import DesignedController
from schedules.proof.flown_with import feedback_gains
from schedules.proof.result import ScheduleProof
from schedules.proof.scheduling_rates import SchedulingRates
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name


@dataclass(frozen=True)
class RateBound:
    """Rates of flight that the whole envelope is proved for, both at once and either way.

    Attributes
    ----------
    altitude_rate_m_s : largest rate of altitude
    axis : name of the speed axis
    speed_rate : largest rate along it, in `unit`; None where any is proved
    unit : of `speed_rate`
    unlimited : whether one Lyapunov matrix proves the envelope
    decay_rate_1_s : that is kept meanwhile
    """

    altitude_rate_m_s: float
    axis: str
    speed_rate: float | None
    unit: str
    unlimited: bool
    decay_rate_1_s: float


@dataclass(frozen=True)
class TableProof:
    """The proof of a table in a few words and numbers, as files carry it.

    Attributes
    ----------
    proved, refuted, undecided, sampled : numbers of cells
    decay_rate_1_s : least proved rate of all cells; None unless all are proved
    covers : which plants
    words : one sentence
    rate_bound, rate_bound_reason : rates of flight, or why none are known, in words
    gains : names of those that close the loop, which the proof is of
    table_sha256 : `table_digest` of the axes and these gains
    certificate_sha256 : digest of the certificate; None where no cell is proved
    """

    proved: int
    refuted: int
    undecided: int
    sampled: int
    decay_rate_1_s: float | None
    covers: str
    words: str
    rate_bound: RateBound | None
    rate_bound_reason: str | None
    gains: tuple[str, ...]
    table_sha256: str
    certificate_sha256: str | None

    def differs(self, schedule: GainSchedule) -> str | None:
        """Where a schedule is not the one that was proved, in words; None where it is, to the last bit."""
        rules = schedule.rules
        if rules.interpolation != "multilinear" or rules.integrator_placement != "before_gain":
            return "the proof is of a table that is multilinear, with integrators before their gains"
        tables = {gain.name: gain.values for gain in schedule.gains}
        if missing := [name for name in self.gains if name not in tables]:
            return f"the table has no gain {missing[0]}, which the proof is of"
        if table_digest(schedule.axes, {name: tables[name] for name in self.gains}) != self.table_sha256:
            return "the proof is of another table: its digest is not that of these axes and gains"
        return None


@dataclass(frozen=True, eq=False, kw_only=True)
class ProvedSchedule(GainSchedule):
    """A gain schedule that carries the summary of its proof.

    Attributes
    ----------
    proof : of this table

    Raises
    ------
    ValueError : the proof is of another table
    """

    proof: TableProof

    def __post_init__(self) -> None:
        differs = self.proof.differs(self)
        if differs is not None:
            raise ValueError(differs)


def table_digest(axes: Sequence[GridAxis], gains: Mapping[str, FloatArray]) -> str:
    """`digest` of `table_members`, of every number to the last bit; `schedules.verify` works it out in the same way."""
    return digest(table_members(axes, gains))


def digest(content: Any) -> str:
    """SHA-256 of what JSON can hold: as Python's `json` writes it, names sorted."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()


def table_members(axes: Sequence[GridAxis], gains: Mapping[str, FloatArray]) -> tuple[list[Any], list[Any]]:
    """Axes, and gains (*G,) by name in their order, as a certificate writes them; null where a point has no gain."""
    return (
        [{"name": axis.name, "unit": axis.unit, "values": [float(x) for x in axis.values]} for axis in axes],
        [
            {"name": name, "values": np.where(np.isnan(values), np.array(None), values).tolist()}
            for name, values in gains.items()
        ],
    )


def table_proof(
    proof: ScheduleProof, designed: DesignedController, rates: SchedulingRates | str, certificate_sha256: str | None
) -> TableProof:
    """The summary of a proof.

    Parameters
    ----------
    proof : of the controller
    designed : the controller
    rates : rates of flight, or why none are known, in words
    certificate_sha256 : digest of the certificate; None where no cell is proved
    """
    said, table = proof.summary, feedback_gains(designed)
    return TableProof(
        proved=said.proved,
        refuted=said.refuted,
        undecided=said.undecided,
        sampled=said.sampled,
        decay_rate_1_s=said.alpha if proof.proved else None,
        covers=proof.covers,
        words=said.words,
        rate_bound=None if isinstance(rates, str) else rate_bound(proof, rates),
        rate_bound_reason=rates if isinstance(rates, str) else None,
        gains=tuple(table),
        table_sha256=table_digest(proof.axes, table),
        certificate_sha256=certificate_sha256,
    )


def rate_bound(proof: ScheduleProof, rates: SchedulingRates) -> RateBound:
    """Rates of flight in the units of the grid's axes."""
    axis, unlimited = proof.axes[1], rates.speed_rate == float("inf")
    return RateBound(
        altitude_rate_m_s=rates.altitude_rate,
        axis=axis_name(axis),
        speed_rate=None if unlimited else rates.speed_rate,
        unit="1/s" if axis.unit == "1" else f"{axis.unit}/s",
        unlimited=unlimited,
        decay_rate_1_s=rates.alpha,
    )


def proved_schedule(schedule: GainSchedule, proof: TableProof) -> ProvedSchedule:
    """The schedule with the summary of its proof.

    Raises
    ------
    ValueError : the proof is of another table
    """
    return ProvedSchedule(**vars(without_proof(schedule)), proof=proof)


def without_proof(schedule: GainSchedule) -> GainSchedule:
    """The schedule alone."""
    if not isinstance(schedule, ProvedSchedule):
        return schedule
    return GainSchedule(**{field.name: getattr(schedule, field.name) for field in fields(GainSchedule)})
