"""What a tab alone can do with the aileron: the range of aileron angles it reaches within its limits (seed 2.5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from model.actuators import ActuatorLimits
from model.arrays import BoolArray, FloatArray, Floats, GridArrays, IntArray, ObjectArray
from model.flight import FlightCondition
from model.hinge_moments.expansion import HingeMomentSource
from model.solve_angle import newton_angle, solve_angle
from model.system import TabAileron
from model.trim_angles import torque_equation
from model.trim_request import LARGEST_TRIM_ANGLE

#: Tab angles at which the floating aileron is sampled over the tab's range; an odd number, so that neutral is one.
SAMPLES = 129
UNLIMITED: Final = ActuatorLimits()
#: What may end the range.
LIMITS: Final = ("tab torque", "aileron deflection", "no floating angle of the aileron")
TAB_DEFLECTION: Final = "tab deflection"
_BISECTIONS = 55
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
_GOLDEN_STEPS = 80


@dataclass(frozen=True, eq=False)
class RangeEnd(GridArrays):
    """One end of the range, each (*G,).

    Attributes
    ----------
    aileron, tab : the angles there [rad]; nan where nothing is reachable
    torque : the tab's torque there [N m]
    limit : object, what ends the range, in words: `TAB_DEFLECTION` or one of `LIMITS`; None where nothing is reachable
    """

    aileron: FloatArray
    tab: FloatArray
    torque: FloatArray
    limit: ObjectArray


@dataclass(frozen=True, eq=False)
class ReachableAileron(GridArrays):
    """Aileron angles that the tab alone reaches within its limits.

    Attributes
    ----------
    lower, upper : ends of the range, ``lower.aileron <= upper.aileron``
    reached : (*G,) whether any aileron angle is reachable
    reason : (*G,) object, words where none is
    """

    lower: RangeEnd
    upper: RangeEnd
    reached: BoolArray
    reason: ObjectArray


@dataclass(frozen=True, eq=False)
class _Floating(GridArrays):
    """The floating aileron at some tab angles, shapes (*G, ...).

    `excess` (..., 3), in the order of `LIMITS`, is above zero where the limit is exceeded, in units of the limit.
    """

    tab: FloatArray
    aileron: FloatArray
    torque: FloatArray
    excess: FloatArray

    @property
    def worst(self) -> FloatArray:
        return np.asarray(np.max(self.excess, axis=-1))


@dataclass(frozen=True)
class _TabOnly:
    """The section with a free aileron: source, incidence (*G,), torque of a unit coefficient (*G,), limits."""

    source: HingeMomentSource
    alpha: FloatArray
    load: FloatArray
    tab_torque: float | None
    aileron_angle: float | None

    def everywhere(self, tab: FloatArray) -> _Floating:
        """At tab angles (n,) for every point (*G, n); the aileron's angle is sought in the whole range."""
        alpha, load = self.alpha[..., None], self.load[..., None]
        equation = torque_equation(self.source, alpha, "aileron", tab, "aileron", 0.0)
        shape = np.broadcast_shapes(alpha.shape, tab.shape)
        solved = solve_angle(equation, shape, LARGEST_TRIM_ANGLE)
        return self._held(alpha, load, tab, solved.angle, solved.found)

    def near(self, tab: FloatArray, aileron: FloatArray) -> _Floating:
        """At one tab angle a point (*G,), the aileron near a given angle."""
        equation = torque_equation(self.source, self.alpha, "aileron", tab, "aileron", 0.0)
        solved = newton_angle(equation, np.broadcast_to(aileron, tab.shape))
        upright = np.abs(solved.angle) <= LARGEST_TRIM_ANGLE
        found = solved.found & upright & self.source.covers(self.alpha, tab, solved.angle)
        return self._held(self.alpha, self.load, tab, solved.angle, found)

    def _held(
        self, alpha: FloatArray, load: FloatArray, tab: FloatArray, aileron: FloatArray, found: BoolArray
    ) -> _Floating:
        torque = load * self.source.at(alpha, tab, aileron).value[..., 0]
        inside = np.full(torque.shape, -1.0)
        by_torque = inside if self.tab_torque is None else np.abs(torque) / self.tab_torque - 1.0
        by_angle = inside if self.aileron_angle is None else np.abs(aileron) / self.aileron_angle - 1.0
        lost = np.where(found, -1.0, np.inf)
        excess = np.stack(np.broadcast_arrays(by_torque, by_angle, lost), axis=-1)
        shape = excess.shape[:-1]
        return _Floating(np.broadcast_to(tab, shape), np.broadcast_to(aileron, shape), torque, excess)


def reachable_aileron(
    system: TabAileron,
    condition: FlightCondition,
    alpha: Floats,
    tab: ActuatorLimits = UNLIMITED,
    aileron: ActuatorLimits = UNLIMITED,
) -> ReachableAileron:
    """Range of aileron angles that the tab holds alone, at every point of the grid (*G).

    The aileron floats; the tab moves from the angle nearest to neutral that the limits allow, both ways until a
    limit ends it (README, decision 17). For a linear source the range is every reachable angle; for another one it
    is the connected part seen at `SAMPLES` tab angles, its ends refined to rounding.

    Parameters
    ----------
    system, condition : one section, and its flight condition (*G)
    alpha : incidence (*G,) [rad]
    tab : deflection [rad] and torque limits [N m]; without a deflection limit the tab goes to a right angle
    aileron : deflection limit [rad]; its torque is zero throughout

    Raises
    ------
    ValueError : a limit that is not positive, or Mach one and more with the Prandtl-Glauert correction
    """
    for limit in (tab.deflection, tab.torque, aileron.deflection):
        if limit is not None and not limit > 0.0:
            raise ValueError("deflection [rad] and torque [N m] limits must be positive, or None")
    load = np.asarray(system.hinge_load(condition) * system.aerodynamics.amplification(condition.mach))
    shape = np.broadcast_shapes(load.shape, np.shape(alpha))
    source = system.aerodynamics.source
    problem = _TabOnly(
        source, np.broadcast_to(np.asarray(alpha, float), shape), np.broadcast_to(load, shape),
        tab.torque, aileron.deflection,
    )  # fmt: skip
    angles = np.linspace(-search_limit(tab), search_limit(tab), SAMPLES)
    once = _TabOnly(source, np.asarray(alpha, float), problem.load, tab.torque, aileron.deflection)
    return _range(problem, once.everywhere(angles))


def search_limit(limits: ActuatorLimits) -> float:
    """Largest angle that a surface may be sought at [rad]: its deflection limit, a right angle at most."""
    return LARGEST_TRIM_ANGLE if limits.deflection is None else min(limits.deflection, LARGEST_TRIM_ANGLE)


def _range(problem: _TabOnly, nodes: _Floating) -> ReachableAileron:
    """The connected range through the allowed tab angle nearest to neutral."""
    allowed = nodes.worst <= 0.0
    distance = np.where(allowed, np.abs(nodes.tab), np.inf)
    start = np.where(np.any(allowed, axis=-1), np.argmin(distance, axis=-1), np.argmin(nodes.worst, axis=-1))
    rest = _node(nodes, start)
    if np.any(rest.worst > 0.0):
        rest = _least_excess(problem, nodes, start, rest)
    reached = np.asarray(rest.worst <= 0.0)
    reason = _reasons(rest, reached)
    down, up = _end(problem, nodes, start, rest, -1), _end(problem, nodes, start, rest, +1)
    swap = down.aileron > up.aileron
    return ReachableAileron(_end_of(reached, swap, up, down), _end_of(reached, swap, down, up), reached, reason)


def _least_excess(problem: _TabOnly, nodes: _Floating, start: IntArray, rest: _Floating) -> _Floating:
    """Where no sampled tab angle is allowed: the one between samples that exceeds the limits least (golden section)."""
    low, high = _node(nodes, np.maximum(start - 1, 0)).tab, _node(nodes, np.minimum(start + 1, SAMPLES - 1)).tab
    best = rest
    for _ in range(_GOLDEN_STEPS):
        width = _GOLDEN * (high - low)
        left, right = problem.near(high - width, rest.aileron), problem.near(low + width, rest.aileron)
        nearer = left.worst <= right.worst
        low, high = np.where(nearer, low, left.tab), np.where(nearer, right.tab, high)
        best = _choose(left.worst < best.worst, left, best)
        best = _choose(right.worst < best.worst, right, best)
    return _choose(rest.worst <= 0.0, rest, best)


def _end(problem: _TabOnly, nodes: _Floating, start: IntArray, rest: _Floating, way: int) -> RangeEnd:
    """The end of the range (*G,) in one direction of the tab."""
    inner, outer = rest, _node(nodes, np.clip(start + way, 0, SAMPLES - 1))
    for step in range(1, SAMPLES):
        going = (outer.worst <= 0.0) & (start + way * step >= 0) & (start + way * step < SAMPLES)
        if not np.any(going):
            break
        inner = _choose(going, outer, inner)
        outer = _choose(going, _node(nodes, np.clip(start + way * (step + 1), 0, SAMPLES - 1)), outer)
    at_stop = np.asarray((outer.worst <= 0.0) | (way * (outer.tab - inner.tab) <= 0.0))
    for _ in range(_BISECTIONS):
        middle = problem.near(0.5 * (inner.tab + outer.tab), inner.aileron)
        inside = ~at_stop & (middle.worst <= 0.0)
        inner, outer = _choose(inside, middle, inner), _choose(~at_stop & ~inside, middle, outer)
    names = np.array([*LIMITS, TAB_DEFLECTION], dtype=object)
    limit = names[np.where(at_stop, len(LIMITS), np.argmax(outer.excess, axis=-1))]
    return RangeEnd(inner.aileron, inner.tab, inner.torque, np.asarray(limit, dtype=object))


def _end_of(reached: BoolArray, mask: BoolArray, yes: RangeEnd, no: RangeEnd) -> RangeEnd:
    """`yes` where the mask is True, `no` elsewhere, nothing where nothing is reached."""

    def pick(a: FloatArray, b: FloatArray) -> FloatArray:
        return np.where(reached, np.where(mask, a, b), np.nan)

    limit = np.where(mask, yes.limit, no.limit)
    limit[~reached] = None
    return RangeEnd(
        pick(yes.aileron, no.aileron), pick(yes.tab, no.tab), pick(yes.torque, no.torque), np.asarray(limit)
    )


def _node(nodes: _Floating, k: IntArray) -> _Floating:
    """The sample of number k (*G,) at each point."""
    index = np.asarray(k)[..., None]

    def pick(values: FloatArray) -> FloatArray:
        return np.take_along_axis(values, index, axis=-1)[..., 0]

    excess = np.take_along_axis(nodes.excess, index[..., None], axis=-2)[..., 0, :]
    return _Floating(pick(nodes.tab), pick(nodes.aileron), pick(nodes.torque), excess)


def _choose(mask: BoolArray, yes: _Floating, no: _Floating) -> _Floating:
    return _Floating(
        np.where(mask, yes.tab, no.tab),
        np.where(mask, yes.aileron, no.aileron),
        np.where(mask, yes.torque, no.torque),
        np.where(mask[..., None], yes.excess, no.excess),
    )


def _reasons(rest: _Floating, reached: BoolArray) -> ObjectArray:
    reasons = np.full(reached.shape, None, dtype=object)
    for row in np.argwhere(~reached):
        index = tuple(int(i) for i in row)
        which = int(np.argmax(rest.excess[index]))
        over = rest.excess[index][which]
        beyond = "" if not np.isfinite(over) else f": {100.0 * over:.4g} per cent above it at the best tab angle"
        words = LIMITS[which] if not np.isfinite(over) else f"the limit of {LIMITS[which]} is exceeded"
        reasons[index] = f"the tab alone holds no aileron angle: {words}{beyond}"
    return reasons
