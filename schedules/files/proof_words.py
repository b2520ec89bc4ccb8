"""What files say of the proof of their table: the summary as a JSON object, or null and how to get it."""

from __future__ import annotations

from dataclasses import asdict, fields
from math import isfinite
from typing import Any

from schedules.proof.table_proof import ProvedSchedule, RateBound, TableProof
from schedules.schedule import GainSchedule

#: Said where a file holds no proof.
HOW_TO_GET_IT = (
    "none was asked for; with ?certificate=summary the service writes one into the file, and "
    "/v1/designs/{id}/controllers/{name}/certificate is the proof itself"
)
_COUNTS = ("proved", "refuted", "undecided", "sampled")
_TEXTS = ("covers", "words", "table_sha256")


def proof_members(schedule: GainSchedule) -> dict[str, Any]:
    """Members ``proof`` and ``proof_reason``: one of the two is None."""
    if not isinstance(schedule, ProvedSchedule):
        return {"proof": None, "proof_reason": HOW_TO_GET_IT}
    return {"proof": asdict(schedule.proof) | {"gains": list(schedule.proof.gains)}, "proof_reason": None}


def proof_in_words(schedule: GainSchedule) -> str:
    """The same in one line, for files that are tables of a program."""
    if not isinstance(schedule, ProvedSchedule):
        return HOW_TO_GET_IT
    proof = schedule.proof
    counts = ", ".join(f"{name} {getattr(proof, name)}" for name in _COUNTS)
    return (
        f"{proof.words}; cells: {counts}; {_rates_in_words(proof)}; table sha256 {proof.table_sha256}, certificate "
        f"sha256 {proof.certificate_sha256 or 'none'}"
    )


def _rates_in_words(proof: TableProof) -> str:
    bound = proof.rate_bound
    if bound is None:
        return f"rates of flight: {proof.rate_bound_reason}"
    if bound.speed_rate is None:
        return "proved at any rate of altitude and speed"
    return (
        f"proved at rates up to {bound.altitude_rate_m_s!r} m/s of altitude and {bound.speed_rate!r} {bound.unit} "
        f"of {bound.axis}, decay at {bound.decay_rate_1_s!r} 1/s"
    )


def proof_from(found: Any) -> TableProof | None:
    """The summary that a file holds; None where it holds none.

    Raises
    ------
    ValueError : not such a summary
    """
    if found is None:
        return None
    members = _members(found, TableProof, "proof")
    if any(type(members[name]) is not int or members[name] < 0 for name in _COUNTS):
        raise ValueError(f"proof: {', '.join(_COUNTS)} must be numbers of cells")
    if any(not isinstance(members[name], str) for name in _TEXTS):
        raise ValueError(f"proof: {', '.join(_TEXTS)} must be text")
    if any(not isinstance(members[name], str | None) for name in ("rate_bound_reason", "certificate_sha256")):
        raise ValueError("proof: rate_bound_reason and certificate_sha256 must be text or null")
    gains = members["gains"]
    if not isinstance(gains, list) or any(not isinstance(name, str) for name in gains):
        raise ValueError("proof: gains must be a list of names")
    decay, bound = _number(members["decay_rate_1_s"], "decay_rate_1_s"), members["rate_bound"]
    return TableProof(
        **members
        | {"gains": tuple(gains), "decay_rate_1_s": decay, "rate_bound": None if bound is None else _bound(bound)}
    )


def _bound(found: Any) -> RateBound:
    members = _members(found, RateBound, "proof: rate_bound")
    if any(not isinstance(members[name], str) for name in ("axis", "unit")) or type(members["unlimited"]) is not bool:
        raise ValueError("proof: rate_bound: axis and unit must be text, unlimited true or false")
    rates = {name: _number(members[name], name) for name in ("altitude_rate_m_s", "speed_rate", "decay_rate_1_s")}
    if rates["altitude_rate_m_s"] is None or rates["decay_rate_1_s"] is None:
        raise ValueError("proof: rate_bound: altitude_rate_m_s and decay_rate_1_s must be numbers")
    return RateBound(**members | rates)


def _members(found: Any, of: type, what: str) -> dict[str, Any]:
    names = [field.name for field in fields(of)]
    if not isinstance(found, dict) or set(found) != set(names):
        raise ValueError(f"{what} must be an object of {', '.join(names)}, or null")
    return dict(found)


def _number(value: Any, name: str) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise ValueError(f"proof: {name} must be a number or null")
    return float(value)
