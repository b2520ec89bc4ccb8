"""Margins, peaks and bandwidth of candidates, with their derivatives in the gains.

Each is an event on the frequency axis: a crossing of the loop transfer, a summit of a sensitivity, the frequency at
which the tracking is lost. Events are located on the samples of the point, sharpened on the exact responses, and
differentiated where they are; the worst few of each kind are followed, since the gains may make another one the worst.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass
from functools import cache

import numpy as np

from design.classical.figure import Crossing, Figure, at_crossing, at_summit, outer
from design.classical.frequency_samples import SUMMITS, FrequencySamples
from design.classical.log_response import Factors, LogResponse, log_response
from design.classical.open_gains import OpenGains
from model.arrays import ComplexArray, FloatArray, GridArrays

DECIBELS = 20.0 / np.log(10.0)
#: What each figure is read off: the ratio of two factors.
_RATIOS = {
    "gain_margin": ("q", "d"),
    "phase_margin": ("q", "d"),
    "delay_margin": ("q", "d"),
    "bandwidth": ("t", "p"),
    "disk_margin": ("m", "p"),
    "sensitivity_peak": ("d", "p"),
    "noise_gain": ("c", "p"),
}


@dataclass(frozen=True, eq=False)
class FrequencyFigures(GridArrays):
    """What the figures of P points are worked out from.

    Attributes
    ----------
    factors, samples : of each point
    frequency : (P,) omega_n [rad/s]
    noise_unit : (P,) ``1 / |K_ss|``
    kinds : which figures are asked for, besides the bandwidth
    rate_command : whether the tab is commanded by rate
    """

    factors: Factors
    samples: FrequencySamples
    frequency: FloatArray
    noise_unit: FloatArray
    kinds: frozenset[str]
    rate_command: bool

    @classmethod
    def of(
        cls, family: OpenGains, kinds: Set[str], fineness: int = 1, modes: ComplexArray | None = None
    ) -> FrequencyFigures:
        """Of each point of a family, `fineness` times as many samples and some about the `modes` (P, m)."""
        names = {name for kind in (*kinds, "bandwidth") for name in _RATIOS.get(kind, ())}
        if "noise_gain" in kinds and family.form.rate_command:
            names |= {"g", "k"}
        form = family.form
        return cls(
            Factors.of(family, tuple(sorted(names))),
            FrequencySamples.of(family, fineness, modes),
            form.frequency,
            1.0 / np.abs(form.dc_gain),
            frozenset(kinds),
            form.rate_command,
        )

    def judge(self, z: FloatArray, passes: int = 1) -> dict[str, Figure]:
        """Figures of K = P candidates z (K, J) by quantity, each in its own unit; of the bandwidth its logarithm.

        Each of the `passes` halves the digits that the events are away from where they should be, at least.
        """
        found = self.samples.events(z, self.kinds, self.rate_command)
        x, exists = (np.concatenate([getattr(event, name) for event in found]) for name in ("x", "exists"))
        ends = np.concatenate([event.ends for event in found], axis=1)
        plan = _plan(tuple(event.kind for event in found for _ in range(event.x.shape[0])))
        first = plan.turn.shape[0]
        for _ in range(passes):
            F = self._responses(plan.kinds, x, z)
            value = F.value[:first] + plan.shift
            value.imag -= 2.0 * np.pi * np.round(value.imag / (2.0 * np.pi))
            crossings = at_crossing(
                _part(F, slice(first), value), x[:first], plan.turn, plan.level, ends[:, :first], exists[:first]
            )
            if first == x.shape[0]:
                x = crossings.x
                continue
            summits, top = at_summit(_part(F, slice(first, None)), x[first:], ends[:, first:], exists[first:])
            x = np.concatenate([crossings.x, top])
        margins = self._margins(crossings, plan)
        figures, start = {}, 0
        for event in found:
            part = slice(start, start + event.x.shape[0])
            start = part.stop
            if event.kind in SUMMITS:
                figures[event.kind] = self._height(
                    event.kind, summits.take(slice(part.start - first, part.stop - first))
                )
            elif event.kind == "bandwidth":
                figures[event.kind] = self._bandwidth(crossings, part)
            elif event.kind == "delay_margin":
                figures[event.kind] = self._delay_margin(crossings, part)
            else:
                figures[event.kind] = margins.take(part)
        return figures

    def _responses(self, kinds: tuple[str, ...], x: FloatArray, z: FloatArray) -> LogResponse:
        F = log_response(self.factors, tuple(_RATIOS[kind] for kind in kinds), x.T, z)
        if not (self.rate_command and "noise_gain" in kinds):
            return F
        inner = log_response(
            self.factors, tuple(("g", "k") if kind == "noise_gain" else ("p", "p") for kind in kinds), x.T, z
        )
        return F.times(inner)

    def _margins(self, crossings: Crossing, plan: _Plan) -> Figure:
        """Gain and phase margins in their own units, whichever way they are."""
        margin = crossings.figure
        size = np.where(margin.value < 0.0, -plan.unit, plan.unit)
        return margin.mapped(size * margin.value, size)

    def _bandwidth(self, crossings: Crossing, part: slice) -> Figure:
        """The logarithm of the bandwidth."""
        x = crossings.x[part]
        dx, dxx = crossings.dx[part] / x[..., None], crossings.dxx[part] / x[..., None, None]
        return Figure(np.log(x * self.frequency), dx, dxx - outer(dx), crossings.figure.exists[part])

    def _delay_margin(self, crossings: Crossing, part: slice) -> Figure:
        """The lag at a crossing over its frequency."""
        margin, x = crossings.figure.take(part), crossings.x[part]
        dx, dxx = crossings.dx[part] / x[..., None], crossings.dxx[part] / x[..., None, None]
        delay = (margin.value % (2.0 * np.pi)) / x
        gradient = margin.gradient / x[..., None] - delay[..., None] * dx
        mixed = gradient[..., :, None] * dx[..., None, :]
        curvature = margin.curvature / x[..., None, None] - delay[..., None, None] * dxx - mixed
        found = Figure(delay, gradient, curvature - mixed.swapaxes(-1, -2), margin.exists)
        return found.mapped(delay / self.frequency, 1.0 / self.frequency)

    def _height(self, kind: str, summit: Figure) -> Figure:
        """The figure of a summit in its quantity's own unit."""
        size = np.exp(summit.value)
        if kind == "disk_margin":
            return summit.mapped(2.0 / size, -2.0 / size, 2.0 / size)
        if kind == "noise_gain":
            size = size * self.noise_unit
        return summit.mapped(size, size, size)


@dataclass(frozen=True, eq=False)
class _Plan:
    """What is asked of the events of some kinds, crossings first.

    Attributes
    ----------
    kinds : (E,)
    turn, level : (C, 1) of the crossings: where ``Im(turn F) = level``
    shift : (C, 1) what is added to F: it is log(-L) for those of the loop transfer
    unit : (C, 1) what a margin is worth in its own unit
    """

    kinds: tuple[str, ...]
    turn: ComplexArray
    level: FloatArray
    shift: ComplexArray
    unit: FloatArray


@cache
def _plan(kinds: tuple[str, ...]) -> _Plan:
    crossings = [kind for kind in kinds if kind not in SUMMITS]
    tracking = np.array([[kind == "bandwidth"] for kind in crossings])
    turn = np.where([[kind == "gain_margin"] for kind in crossings], 1.0, -1j)
    unit = np.where([[kind == "gain_margin"] for kind in crossings], DECIBELS, 1.0)
    return _Plan(kinds, turn, np.where(tracking, 0.5 * np.log(2.0), 0.0), np.where(tracking, 0.0, 1j * np.pi), unit)


def _part(F: LogResponse, part: slice, value: ComplexArray | None = None) -> LogResponse:
    parts = (F.dx, F.dxx, F.dz, F.dxz, F.dzz)
    here: ComplexArray = F.value[part] if value is None else value
    return LogResponse(here, *(v[part] for v in parts))
