"""What is said of a loop that is flown away from its design: stability, damping, the step, and margins if asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from design.delay.characteristic import SHORTEST
from design.delay.damping import least_damping_ratio_delayed
from design.delay.delayed_poles import delayed_poles
from design.frequency.margins import margins
from design.frequency.poles import largest_real_part, least_damping_ratio, poles
from design.loop import Loop
from design.specs import Spec
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray
from schedules.step_quality import step_quality

STEP_QUANTITIES = ("settling_time", "overshoot")
MARGIN_QUANTITIES = ("gain_margin", "phase_margin", "delay_margin", "disk_margin")
#: Loops that are put together at once.
AT_ONCE = 4096
_FIGURES = 2 + len(STEP_QUANTITIES) + len(MARGIN_QUANTITIES)
#: Loops of one study: two or three minutes of work with steps, with delays five; some hundred bytes each.
MOST_LOOPS, MOST_DELAYED_LOOPS = 1 << 21, 1 << 17


@dataclass(frozen=True)
class Flight:
    """What a loop is asked for.

    Attributes
    ----------
    reference : step of the aileron [rad]
    duration : how long it is followed [s], longer than any delay
    steps : whether settling time and overshoot are wanted
    margins : whether margins are
    """

    reference: float
    duration: float
    steps: bool = True
    margins: bool = False

    def judging(self, specs: Sequence[Spec]) -> Flight:
        """The same, and what these specs are judged on.

        Raises
        ------
        ValueError : a spec on something that is not known of such a loop
        """
        asked = {spec.quantity for spec in specs}
        unknown = asked - {"damping_ratio", *STEP_QUANTITIES, *MARGIN_QUANTITIES}
        if unknown:
            raise ValueError(
                f"specs on {', '.join(sorted(unknown))} are not judged away from the design: only damping_ratio, "
                f"{', '.join((*STEP_QUANTITIES, *MARGIN_QUANTITIES))}"
            )
        return replace(
            self,
            steps=self.steps or not asked.isdisjoint(STEP_QUANTITIES),
            margins=self.margins or not asked.isdisjoint(MARGIN_QUANTITIES),
        )


@dataclass(frozen=True, eq=False)
class FlownFigures(GridArrays):
    """Figures of loops, (*S,) each; nan, and not stable, where no loop is flown.

    Attributes
    ----------
    stable : every closed-loop pole is in the left half plane; with a delay, proved to be
    damping_ratio : least of all closed-loop poles [-], negative for an unstable one; with a delay as in
        `design.delay.damping`
    largest_real_part : of all closed-loop poles [1/s]; nan where a delay leaves it unproved
    settling_time : of the aileron's step [s]; nan where it is not wanted, the loop not stable or not settled in time
    overshoot : of that step, as a part of it [-]; nan where it is not wanted or the loop not stable
    gain_margin : smaller of the two, raising and lowering, of the worst input [dB]; margins are nan where they are not
        wanted or the loop not stable
    phase_margin : of the worst input [rad]
    delay_margin : of the worst input [s]
    disk_margin : of the worst input [-]
    """

    stable: BoolArray
    damping_ratio: FloatArray
    largest_real_part: FloatArray
    settling_time: FloatArray
    overshoot: FloatArray
    gain_margin: FloatArray
    phase_margin: FloatArray
    delay_margin: FloatArray
    disk_margin: FloatArray


def figures_of(loop: Loop, flight: Flight) -> FlownFigures:
    """Figures (N,) of loops (N,); a loop whose matrices are not finite, or that LAPACK gives up on, has none."""
    known = np.asarray(np.isfinite(loop.closed).all(axis=(-2, -1)))
    if not np.any(known):
        return _none(known.shape)
    if not np.all(known):
        return figures_of(loop.take(known), flight).spread(known)
    try:
        return _figures_of(loop, flight)
    except np.linalg.LinAlgError:
        if known.size == 1:
            return _none(known.shape)
        half = known.size // 2
        return _joined([figures_of(loop.take(part), flight) for part in (slice(half), slice(half, None))])


def _figures_of(loop: Loop, flight: Flight) -> FlownFigures:
    """Figures (N,) of loops (N,) whose matrices are finite."""
    growth, damping = _growth_and_damping(loop)
    stable = np.asarray(growth < 0.0)
    inside = loop if np.all(stable) else loop.take(stable)
    found = np.full((_FIGURES - 2, len(growth)), np.nan)
    if flight.steps and np.any(stable):
        step = step_quality(inside, flight.reference, flight.duration)
        found[:2, stable] = step.settling_time, step.overshoot
    if flight.margins and np.any(stable):
        found[2:, stable] = _worst_margins(inside)
    return FlownFigures(stable, damping, growth, *found)


def fly(flown: BoolArray, loop_of: Callable[[IntArray], Loop], flight: Flight) -> FlownFigures:
    """Figures (*S,) of the loops that a mask (*S,) picks.

    Parameters
    ----------
    flown : (*S,) which loops there are
    loop_of : makes loops (N,) from their flat indices (N,) in the mask; asked for `AT_ONCE` at most
    flight : what is wanted of them

    Raises
    ------
    ValueError : more than `MOST_LOOPS`, or with delays `MOST_DELAYED_LOOPS`
    """
    index = np.flatnonzero(flown)
    if not index.size:
        return _none(flown.shape)
    refuse_too_many(index.size, delayed=False)
    parts = []
    for first in range(0, index.size, AT_ONCE):
        loop = loop_of(index[first : first + AT_ONCE])
        refuse_too_many(index.size, max(loop.delay) > SHORTEST)
        parts.append(figures_of(loop, flight))
    return _joined(parts).spread(flown)


def holds(figures: FlownFigures, specs: Sequence[Spec], axes_after_grid: int = 0) -> BoolArray:
    """Where a loop is stable and meets every spec (*S,); a figure that does not exist meets none.

    Parameters
    ----------
    axes_after_grid : how many axes the figures have behind those that the specs' limits may vary over
    """
    held = np.array(figures.stable)
    for spec in specs:
        limit = spec.limit
        if isinstance(limit, np.ndarray) and limit.ndim:
            spec = replace(spec, limit=limit.reshape(*limit.shape, *(1,) * axes_after_grid))
        held &= spec.met(getattr(figures, spec.quantity))
    return held


def _none(shape: tuple[int, ...]) -> FlownFigures:
    """Figures (*S,) of loops that have none."""
    return FlownFigures(np.zeros(shape, dtype=bool), *np.full((_FIGURES, *shape), np.nan))


def _joined(parts: Sequence[FlownFigures]) -> FlownFigures:
    """Figures (N,), one part after the other."""
    names = [field.name for field in fields(FlownFigures)]
    return FlownFigures(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def refuse_too_many(loops: int, delayed: bool) -> None:
    """Refuse more loops than one request may fly; fewer may have delays.

    Raises
    ------
    ValueError : more than `MOST_LOOPS`, or with delays `MOST_DELAYED_LOOPS`
    """
    most = MOST_DELAYED_LOOPS if delayed else MOST_LOOPS
    if loops > most:
        raise ValueError(f"{loops} loops are too many to fly at once: at most {most}")


def _growth_and_damping(loop: Loop) -> tuple[FloatArray, FloatArray]:
    """Largest real part [1/s] and least damping ratio (N,), with delays as `design.assess` judges them."""
    if max(loop.delay) <= SHORTEST:
        found = poles(loop.closed)
        return largest_real_part(found), least_damping_ratio(found)
    delayed = delayed_poles(loop)
    growth = np.max(np.where(np.isnan(delayed.poles), -np.inf, delayed.poles.real), axis=-1)
    return np.where(delayed.complete_beyond < 0.0, growth, np.nan), least_damping_ratio_delayed(loop)


def _worst_margins(loop: Loop) -> FloatArray:
    """`MARGIN_QUANTITIES` (4, N) of the worst cut of each loop."""
    each = [margins(loop.cut(name)) for name in loop.inputs]
    gain = [np.minimum(m.gain_margin_up_db, -m.gain_margin_down_db) for m in each]
    others = [[getattr(m, name) for m in each] for name in MARGIN_QUANTITIES[1:]]
    return np.array([np.min(cuts, axis=0) for cuts in (gain, *others)])
