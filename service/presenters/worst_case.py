"""Guaranteed peaks over all admissible references on the wire, and the worst of these references."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.delay.characteristic import SHORTEST
from design.loop import Loop
from design.manoeuvre import Manoeuvre, recorded
from design.response.manoeuvre_demand import tracking_errors
from design.response.manoeuvre_response import manoeuvre_response
from design.worst_case.channels import ERROR
from design.worst_case.peaks import GuaranteedPeaks
from model.actuators import Actuator, ActuatorLimits
from model.arrays import BoolArray, FloatArray, ObjectArray
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.wire_names import wire_name
from service.presenters.grid import grid_document, outcome_documents
from service.to_domain.worst_case_of import Admissible, signal_size

_NO_DESIGN = "the controller has no gains there"
_JUMPS = "unlimited: the signal takes the rate of a reference that may jump; a limit of the rate bounds it"
_NOT_STABLE = (
    "not known: the loop is not stable, or next to it, with a damping ratio below 0.004 or a mode that lasts 1e8 times "
    "as long as the fastest"
)
#: Signal inside -> actuator, and the limit of it that the signal has to keep.
_LIMITED = {
    "dt": ("tab", "deflection"),
    "dt_rate": ("tab", "rate"),
    "T_t": ("tab", "torque"),
    "da": ("aileron", "deflection"),
    "da_rate": ("aileron", "rate"),
    "T_a": ("aileron", "torque"),
}
_REFERENCES = {"r_a": "aileron", "r_t": "tab"}
#: Decimals of the times [s]: knots of two references that only rounding keeps apart are one, as a request wants them
#: (`service.schemas.manoeuvres.SHORTEST_GAP`).
_DECIMALS = 9
#: What a recorded manoeuvre of a request may have at most (`service.schemas.manoeuvres.Recorded`).
LONGEST_S, MOST_SAMPLES = 1e3, 10_000
#: How long the response is followed beyond the end of the worst reference, as a part of it.
_BEYOND = 0.02


def worst_case_document(
    envelope: DesignedEnvelope,
    controller: DesignedController,
    limits: Admissible,
    peaks: GuaranteedPeaks,
    stable: BoolArray,
) -> dict[str, Any]:
    """Guaranteed peaks over the grid, and the worst of the envelope.

    Parameters
    ----------
    peaks : (*G, o) nan where there is no design
    stable : (*G,) where peaks are known
    """
    study = envelope.study
    actuators = {"tab": study.tab_actuator, "aileron": study.aileron_actuator}
    flown = {name: actuators[name] for name in controller.loop.inputs}
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        **_head(limits, controller.loop.delay),
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(controller.outcomes),
        "signals": {
            wire_name(name, signal_size(name)[0]): _signal(
                name, peaks.upper[..., o], peaks.lower[..., o], controller.outcomes.ok, stable, flown
            )
            for o, name in enumerate(peaks.names)
        },
    }


def worst_reference_document(
    loop: Loop, signal: str, limits: Admissible, manoeuvre: Manoeuvre, peaks: GuaranteedPeaks
) -> dict[str, Any]:
    """The worst reference of one point as a recorded manoeuvre, the peak that flying it reaches, and the bounds."""
    unit, size = signal_size(signal)
    times, series = _series(manoeuvre, limits)
    o, end = peaks.index(signal), float(times[-1])
    found = {_REFERENCES[name]: series[:, p] for p, name in enumerate(limits.names)}
    return {
        "signal": wire_name(signal, unit),
        "unit": unit,
        **_head(limits, loop.delay),
        "manoeuvre": {
            "kind": "recorded",
            "times_s": times,
            "aileron_deg": found["aileron"],
            "tab_deg": found.get("tab"),
        },
        "reason": _why_not_flown(end, len(times)),
        "reached": _reached(loop, signal, recorded(times, np.deg2rad(series)), end) * size,
        "reached_at_s": end,
        "upper": float(peaks.upper[o]) * size,
        "lower": float(peaks.lower[o]) * size,
    }


def _head(limits: Admissible, delay: tuple[float, ...]) -> dict[str, Any]:
    """The references that are admissible, and how delays are in the answer."""
    references = {
        _REFERENCES[name]: {
            "amplitude_deg": float(np.rad2deg(size)),
            "rate_limit_deg_s": None if np.isinf(rate) else float(np.rad2deg(rate)),
        }
        for name, size, rate in zip(limits.names, limits.amplitude, limits.rate, strict=True)
    }
    return {
        "references": {"aileron": references["aileron"], "tab": references.get("tab")},
        "delays": "approximants" if max(delay) > SHORTEST else "none",
    }


def _signal(
    name: str, upper: FloatArray, lower: FloatArray, ok: BoolArray, stable: BoolArray, flown: dict[str, Actuator]
) -> dict[str, Any]:
    unit, size = signal_size(name)
    limit = _limit(name, flown)
    worst = int(np.argmax(np.where(ok, upper, -np.inf))) if np.any(ok) else None
    reasons = _reasons(upper, ok, stable)
    return {
        "unit": unit,
        "upper": upper * size,
        "lower": lower * size,
        "reasons": reasons,
        "envelope": {
            "upper": None if worst is None else upper.flat[worst] * size,
            "lower": None if worst is None else lower.flat[worst] * size,
            "point": worst,
            "reason": "no point carries a design" if worst is None else reasons.flat[worst],
        },
        "limit": None if limit is None else limit * size,
        "limit_outcome": None if limit is None else _outcome(upper[ok], lower[ok], limit),
    }


def _reasons(upper: FloatArray, ok: BoolArray, stable: BoolArray) -> ObjectArray:
    """Why a bound does not exist, over the grid; None where it does."""
    found = np.full(upper.shape, None, dtype=object)
    missing = ~np.isfinite(upper)
    found[missing] = _NOT_STABLE
    found[missing & stable] = _JUMPS
    found[~ok] = _NO_DESIGN
    return found


def _limit(name: str, flown: dict[str, Actuator]) -> float | None:
    """The limit that the signal has to keep, of an actuator that the controller has; None without one."""
    actuator, what = _LIMITED.get(name, ("", ""))
    if actuator not in flown:
        return None
    limits: ActuatorLimits = flown[actuator].limits
    return {"deflection": limits.deflection, "rate": limits.rate, "torque": limits.torque}[what]


def _outcome(upper: FloatArray, lower: FloatArray, limit: float) -> str | None:
    """Whether a limit is kept whatever the reference does, at all points (N,); None without any."""
    if upper.size == 0:
        return None
    if np.any(lower > limit):
        return "exceeded"
    return "kept" if np.all(upper <= limit) else "undecided"


def _series(manoeuvre: Manoeuvre, limits: Admissible) -> tuple[FloatArray, FloatArray]:
    """Times (k,) [s] and values (k, p) [deg] between which straight lines are flown; a jump is at two equal times."""
    jumps = np.any(np.abs(manoeuvre.jumps) > 1e-9 * limits.amplitude, axis=-1)
    jumps[0] = False  # a recorded series jumps to its first value by itself
    times = np.repeat(manoeuvre.times, 1 + jumps)
    values = np.repeat(manoeuvre.values, 1 + jumps, axis=0)
    before = np.flatnonzero(jumps) + np.arange(int(jumps.sum()))
    values[before] = manoeuvre.ends[np.flatnonzero(jumps) - 1]
    times = np.round(times, _DECIMALS)
    same = np.diff(times) == 0.0
    ends = ~(np.append(False, same) & np.append(same, False))  # of several knots at one time
    times, values = times[ends], values[ends]
    largest = np.rad2deg(limits.amplitude)
    return times, np.clip(np.rad2deg(values), -largest, largest)


def _why_not_flown(end: float, samples: int) -> str | None:
    if end > LONGEST_S:
        return f"it lasts {end:.6g} s; a recorded manoeuvre lasts at most {LONGEST_S:g} s"
    if samples > MOST_SAMPLES:
        return f"it has {samples} samples; a recorded manoeuvre has at most {MOST_SAMPLES}"
    return None


def _reached(loop: Loop, signal: str, manoeuvre: Manoeuvre, end: float) -> float:
    """Largest magnitude of the signal when the manoeuvre is flown, and a little longer."""
    response = manoeuvre_response(loop, manoeuvre, (1.0 + _BEYOND) * end if end > 0.0 else 1.0, 2)
    if signal in loop.outputs:
        return float(response.peaks[response.index(signal)])
    place = loop.references.index("r_" + signal.removesuffix(ERROR).removeprefix("d"))
    return float(tracking_errors(loop, response).peak[place])
