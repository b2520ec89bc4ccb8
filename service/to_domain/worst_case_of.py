"""What worst-case studies have in common: which references are admissible, which signals there are, how much work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.with_pade import without_delay
from design.frequency.poles import poles
from design.loop import Loop
from design.worst_case.channels import ERROR, LEAST_DAMPING
from design.worst_case.kernel import TIME_CONSTANTS
from model.arrays import FloatArray
from schedules.designed import DesignedController
from schedules.study import Reference
from schedules.wire_names import wire_name
from service.designs import continuous_loop
from service.limits import check_size
from service.settings import Settings
from service.wire.refusals import FieldRefusal, InvalidRequest, StudyNotPossible
from service.wire.signal_units import signal_unit

#: Swings of a step response at which a row takes twice the time of one without: of references that may jump, and of
#: others, whose programmes then grow with the square of the swings.
_TWICE_JUMPING, _TWICE_MOVING = 12.0, 14.0


@dataclass(frozen=True, eq=False)
class Admissible:
    """References ``|r| <= amplitude``, ``|r'| <= rate``, each (p,) in the order of the loop's references.

    Attributes
    ----------
    amplitude : [rad]
    rate : [rad/s]; inf where a reference may jump
    names : of the references
    """

    amplitude: FloatArray
    rate: FloatArray
    names: tuple[str, ...]


def followed_loop(controller: DesignedController) -> Loop:
    """The loop in continuous time of a controller that follows a reference.

    Raises
    ------
    StudyNotPossible : a sampled state feedback, or a regulator
    """
    loop = continuous_loop(controller)
    if not loop.references:
        raise StudyNotPossible(f"the controller {controller.request.name} follows no reference: none is the worst")
    return loop


def admissible(
    loop: Loop,
    reference: Reference,
    aileron_deg: float | None,
    rate_deg_s: float | None,
    tab_deg: float | None,
    tab_rate_deg_s: float | None,
) -> Admissible:
    """The limits that are asked for; amplitudes of the design's reference, and no limit of the rate, where none are.

    Raises
    ------
    InvalidRequest : limits of the tab's reference, of a loop that has none
    """
    if "r_t" not in loop.references:
        for pointer, given, unit in (("/tab_deg", tab_deg, "deg"), ("/tab_rate_deg_s", tab_rate_deg_s, "deg/s")):
            if given is not None:
                detail = "the controller has no reference of the tab"
                allowed = "nothing, unless the controller has the reference aileron_and_tab"
                raise InvalidRequest(f"{pointer}: {detail}", FieldRefusal(pointer, detail, unit, allowed))
    rates = {"r_a": rate_deg_s, "r_t": rate_deg_s if tab_rate_deg_s is None else tab_rate_deg_s}
    sizes = {"r_a": aileron_deg, "r_t": tab_deg}
    usual = np.abs(reference.sizes(loop.references))
    amplitude = [_radians(sizes[name], float(size)) for name, size in zip(loop.references, usual, strict=True)]
    rate = [_radians(rates[name], np.inf) for name in loop.references]
    return Admissible(np.array(amplitude), np.array(rate), loop.references)


def _radians(degrees: float | None, otherwise: float) -> float:
    return otherwise if degrees is None else float(np.deg2rad(degrees))


def signals(loop: Loop) -> dict[str, str]:
    """Name on the wire -> name inside, of every output and of the error of every angle that has a reference."""
    errors = tuple(f"d{name.removeprefix('r_')}{ERROR}" for name in loop.references)
    return {wire_name(name, signal_size(name)[0]): name for name in (*loop.outputs, *errors)}


def signal_size(name: str) -> tuple[str, float]:
    """Unit of a signal or of an error on the wire, and how many of it make one inside."""
    return signal_unit(name.removesuffix(ERROR), {})


def chosen(loop: Loop, wanted: list[str]) -> tuple[str, ...]:
    """Names inside of the signals of these names on the wire.

    Raises
    ------
    InvalidRequest : the loop has no such signal
    """
    known = signals(loop)
    unknown = [name for name in wanted if name not in known]
    if unknown:
        detail = f"the controller has no signal {unknown[0][:80]!a}"
        raise InvalidRequest(f"/signal: {detail}", FieldRefusal("/signal", detail, None, ", ".join(known)))
    return tuple(known[name] for name in dict.fromkeys(wanted))


def check_rows(loop: Loop, limits: Admissible, count: int, settings: Settings) -> None:
    """Refuse `count` signals of loops over any grid whose peaks would take too long.

    Raises
    ------
    LimitExceeded
    """
    swings = _swings(loop).reshape(-1, 1)
    moving, jumping = 1.0 + (swings / _TWICE_MOVING) ** 2, 1.0 + swings / _TWICE_JUMPING
    each = np.where(np.isfinite(limits.rate), moving, jumping)
    rows = int(np.ceil(count * each[:, limits.amplitude > 0.0].sum()))
    what = "rows: grid points times signals times references, lightly damped ones many times"
    check_size("/signal", what, rows, "max_worst_case_rows", settings)


def _swings(loop: Loop) -> FloatArray:
    """(*G,) how often the mode that swings longest does so within the horizon; 0 where no peaks are sought."""
    found = poles(without_delay(loop).closed)
    decay = np.maximum(-found.real, LEAST_DAMPING * np.abs(found))
    with np.errstate(invalid="ignore"):
        most = np.max(np.where(found != 0.0, np.abs(found.imag) / decay, 0.0), axis=-1)
    stable = np.all(found.real < 0.0, axis=-1)
    return np.asarray(np.where(stable, TIME_CONSTANTS / np.pi * most, 0.0))
