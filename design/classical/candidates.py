"""Many candidate gains judged at once, in the normal form: fast and close, not exact.

The figures steer the search; the gains that it chooses are judged again, exactly and on the loop in state space,
before they leave the product. Costs are kept down by judging in stages: poles first, then the frequency response of
those that are damped enough, then the step of those whose margins are near enough.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from design.classical.normal_form import NormalForm
from design.specs import Spec
from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray

#: A candidate that misses a spec by more than this part of it is not judged any further.
NEAR = 0.5
FREQUENCIES = 140
TIMES = 160
#: A step is followed until its slowest mode has gone through this many time constants, or to the horizon.
DECAYED = 10.0
#: Oscillatory modes whose damping is followed, least damped first.
MODES = 3
#: How many candidates are expanded over frequency or time at once; bounds the memory.
CHUNK = 2048
#: Decibels of a margin that does not exist, so that comparisons stay finite.
NO_LIMIT_DB = 200.0


@dataclass(frozen=True, eq=False)
class Judged:
    """Figures of K candidates; nan where not judged.

    Attributes
    ----------
    values : (K,) by quantity, in the units of `design.specs.QUANTITIES`
    bandwidth : (K,) of r_a -> da, where |T| first falls below -3 dB [rad/s]
    """

    values: dict[str, FloatArray]
    bandwidth: FloatArray

    def miss(self, spec: Spec) -> FloatArray:
        """How far each candidate misses a spec, as a part of the limit; <= 0 is met, inf where not judged."""
        scale = abs(spec.limit) if spec.limit else 1.0
        miss = -spec.distance(self.values[spec.quantity]) / scale
        return np.where(np.isnan(miss), np.inf, miss)

    def take(self, index: IntArray | BoolArray) -> Judged:
        """These figures at some candidates."""
        return Judged({name: v[index] for name, v in self.values.items()}, self.bandwidth[index])

    def put(self, index: IntArray, other: Judged) -> None:
        """Overwrite the figures of some candidates."""
        for name, v in self.values.items():
            v[index] = other.values[name]
        self.bandwidth[index] = other.bandwidth

    def where(self, keep: BoolArray, other: Judged) -> Judged:
        """These figures where `keep`, those of `other` elsewhere."""
        values = {name: np.where(keep, v, other.values[name]) for name, v in self.values.items()}
        return Judged(values, np.where(keep, self.bandwidth, other.bandwidth))


class _FrequencyResponse:
    """Loop transfers of K candidates, each at its own point: sampled, and exact wherever a crossing is refined."""

    def __init__(self, form: NormalForm, x: FloatArray, terms: ComplexArray, at: IntArray, kappa: FloatArray) -> None:
        self.form, self.at, self.kappa = form, at, kappa
        self.x = x[at]
        self.L = np.einsum("kj,kjw->kw", kappa, terms[at])
        self.T = kappa[:, -1:] * terms[at, -1, :] / (1.0 + self.L)

    def _exact(self, x: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """L and T of every candidate at its own frequency x (K,)."""
        powers = (1j * x)[:, None] ** np.arange(self.form.denominator.shape[-1] - 1, -1, -1)
        d = np.einsum("kn,kn->k", powers, self.form.denominator[self.at])
        terms = np.einsum("kn,kjn->kj", powers, self.form.numerators[self.at]) / d[:, None]
        L = np.einsum("kj,kj->k", self.kappa, terms)
        return L, self.kappa[:, -1] * terms[:, -1] / (1.0 + L)

    def _refined(
        self, f: Callable[[ComplexArray, ComplexArray], FloatArray], k: IntArray
    ) -> tuple[FloatArray, ComplexArray]:
        """Root of f(L, T) between samples k and k + 1, by false position in log x: the frequency, and L there."""
        row = np.arange(k.size)
        low, high = np.log(self.x[row, k]), np.log(self.x[row, k + 1])
        f_low, f_high = (f(self.L[row, i], self.T[row, i]) for i in (k, k + 1))
        held = np.zeros(k.size)  # which end stayed where it was the last time: -1 the low one, +1 the high one
        for _ in range(4):
            u = low - f_low * (high - low) / np.where(f_high == f_low, np.inf, f_high - f_low)
            L, T = self._exact(np.exp(u))
            f_u = f(L, T)
            left = f_u * f_low > 0
            # Illinois: an end held twice counts half, or the other one would creep.
            f_high = np.where(left, np.where(held > 0, 0.5 * f_high, f_high), f_u)
            f_low = np.where(left, f_u, np.where(held < 0, 0.5 * f_low, f_low))
            low, high = np.where(left, u, low), np.where(left, high, u)
            held = np.where(left, 1.0, -1.0)
        return np.exp(u), L

    def gain_margin_db(self) -> FloatArray:
        """Smallest change of gain, up or down [dB], that puts the locus through -1."""
        re, im = self.L.real, self.L.imag
        crosses = im[:, 1:] * im[:, :-1] < 0
        part = im[:, :-1] / np.where(crosses, im[:, :-1] - im[:, 1:], 1.0)
        at = re[:, :-1] + part * (re[:, 1:] - re[:, :-1])
        crosses &= at < 0
        change = np.where(crosses, np.abs(np.log(np.where(crosses, -at, 1.0))), np.inf)
        _, L = self._refined(lambda L, T: L.imag, np.argmin(change, axis=-1))
        refined = np.abs(20.0 * np.log10(np.maximum(-L.real, 1e-10)))
        return np.where(crosses.any(axis=-1), refined, NO_LIMIT_DB)

    def phase_margin(self) -> FloatArray:
        """Smallest angle [rad] between -1 and the locus where |L| = 1."""
        m = np.log(np.abs(self.L))
        crosses = m[:, 1:] * m[:, :-1] < 0
        part = m[:, :-1] / np.where(crosses, m[:, :-1] - m[:, 1:], 1.0)
        at = self.L[:, :-1] + part * (self.L[:, 1:] - self.L[:, :-1])
        worst = np.argmin(np.where(crosses, np.abs(np.angle(-at)), np.inf), axis=-1)
        _, L = self._refined(lambda L, T: np.log(np.abs(L)), worst)
        return np.where(crosses.any(axis=-1), np.abs(np.angle(-L)), np.pi)

    def bandwidth(self) -> FloatArray:
        """First frequency [rad/s] at which |T| falls below -3 dB."""
        below = np.abs(self.T) < np.sqrt(0.5)
        k = np.clip(np.argmax(below, axis=-1) - 1, 0, None)
        x, _ = self._refined(lambda L, T: np.log(np.abs(T) * np.sqrt(2.0)), k)
        return np.where(below.any(axis=-1), x * self.form.frequency[self.at], np.nan)


class CandidateJudge:
    """Judges candidates of a normal form over a flat grid of P points.

    Parameters
    ----------
    form : normal form, G = (P,)
    horizon : how long step responses are followed [s]
    fineness : how many times as many samples, in frequency and in time
    """

    def __init__(self, form: NormalForm, horizon: float, fineness: int = 1) -> None:
        self.form = form
        self.fineness = fineness
        self.horizon = horizon * form.frequency  # in units of 1 / omega_n
        top = 30.0 * np.maximum(form.servo_ratio, 1.0)
        self.x = np.exp(np.linspace(np.log(0.01), np.log(top), FREQUENCIES * fineness, axis=-1))  # (P, W)
        powers = (1j * self.x)[..., None] ** np.arange(form.denominator.shape[-1] - 1, -1, -1)
        d = np.einsum("pwk,pk->pw", powers, form.denominator)
        self.terms: ComplexArray = np.einsum("pwk,pjk->pjw", powers, form.numerators) / d[:, None, :]

    def judge(self, at: IntArray, kappa: FloatArray, specs: tuple[Spec, ...]) -> Judged:
        """Judge candidates `kappa` (K, J), each at its own point `at` (K,).

        `specs` decide only which candidates are worth judging further.
        """
        names = ("damping_ratio", "gain_margin", "phase_margin", "settling_time", "overshoot")
        values = {name: np.full(at.shape, np.nan) for name in names}
        judged = Judged(values, np.full(at.shape, np.nan))
        chunk = CHUNK // self.fineness
        for start in range(0, at.size, chunk):
            part = slice(start, start + chunk)
            self._judge_part(judged, np.arange(at.size)[part], at[part], kappa[part], specs)
        return judged

    def mode_damping(self, at: IntArray, kappa: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Damping ratio of the least damped modes (K, MODES) and its exact gradient in the gains (K, MODES, J).

        A pole moves by ``ds/dkappa_j = -n_j(s) / p'(s)``. Real poles have a ratio of 1 or -1 and do not change it.
        """
        polynomial = self.form.denominator[at] + np.einsum("kj,kjn->kn", kappa, self.form.numerators[at])
        roots = _roots(polynomial)
        n = polynomial.shape[-1]
        powers = roots[..., None] ** np.arange(n - 1, -1, -1)
        slope = np.einsum("kn,krn->kr", polynomial[:, :-1] * np.arange(n - 1, 0, -1), powers[..., 1:])
        moved = -np.einsum("kjn,krn->krj", self.form.numerators[at], powers)
        moved = moved / np.where(slope == 0, np.inf, slope)[..., None]
        size = np.maximum(np.abs(roots), 1e-300)
        ratio = -roots.real / size
        along = np.real(np.conj(roots)[..., None] * moved)
        gradient = -moved.real / size[..., None] + roots.real[..., None] * along / size[..., None] ** 3
        least = np.argsort(np.where(roots.imag > 0, ratio, 2.0), axis=-1)[:, :MODES]
        chosen = np.take_along_axis(np.where(roots.imag > 0, ratio, 2.0), least, axis=-1)
        gradient = np.where((roots.imag > 0)[..., None], gradient, 0.0)
        return chosen, np.take_along_axis(gradient, least[..., None], axis=1)

    def _judge_part(
        self, judged: Judged, rows: IntArray, at: IntArray, kappa: FloatArray, specs: tuple[Spec, ...]
    ) -> None:
        values = judged.values
        polynomial = self.form.denominator[at] + np.einsum("kj,kjn->kn", kappa, self.form.numerators[at])
        roots = _roots(polynomial)
        values["damping_ratio"][rows] = np.min(-roots.real / np.maximum(np.abs(roots), 1e-300), axis=-1)
        keep = np.max(roots.real, axis=-1) < 0
        keep &= _near(judged, rows, specs, ("damping_ratio",))
        rows, at, kappa, polynomial, roots = rows[keep], at[keep], kappa[keep], polynomial[keep], roots[keep]
        frequency = _FrequencyResponse(self.form, self.x, self.terms, at, kappa)
        values["gain_margin"][rows] = frequency.gain_margin_db()
        values["phase_margin"][rows] = frequency.phase_margin()
        judged.bandwidth[rows] = frequency.bandwidth()
        keep = _near(judged, rows, specs, ("gain_margin", "phase_margin"))
        if not {"settling_time", "overshoot"} & {s.quantity for s in specs}:
            return
        rows, at, kappa, polynomial, roots = rows[keep], at[keep], kappa[keep], polynomial[keep], roots[keep]
        values["overshoot"][rows], values["settling_time"][rows] = self._step(at, kappa, polynomial, roots)

    def _step(
        self, at: IntArray, kappa: FloatArray, polynomial: FloatArray, roots: ComplexArray
    ) -> tuple[FloatArray, FloatArray]:
        """Overshoot (part of the step) and 2 % settling time [s] from the partial fractions of T / s."""
        n = polynomial.shape[-1]
        powers = roots[..., None] ** np.arange(n - 1, -1, -1)
        numerator = kappa[:, -1:] * self.form.numerators[at, -1, :]
        slope = np.einsum("kn,krn->kr", polynomial[:, :-1] * np.arange(n - 1, 0, -1), powers[..., 1:])
        slope *= roots
        residues = np.einsum("kn,krn->kr", numerator, powers) / np.where(slope == 0, np.inf, slope)
        slowest = np.min(-roots.real, axis=-1)
        length = np.minimum(self.horizon[at], DECAYED / slowest)
        error = _Error(roots, residues, length, TIMES * self.fineness)
        return error.peak(), error.settling() / self.form.frequency[at]


def _near(judged: Judged, rows: IntArray, specs: tuple[Spec, ...], quantities: tuple[str, ...]) -> BoolArray:
    near = np.ones(rows.size, dtype=bool)
    for spec in specs:
        if spec.quantity in quantities:
            near &= judged.miss(spec)[rows] < NEAR
    return near


def _roots(polynomial: FloatArray) -> ComplexArray:
    """Roots of polynomials (K, n + 1) with leading coefficient not zero, as eigenvalues of companions."""
    n = polynomial.shape[-1] - 1
    companion = np.zeros((*polynomial.shape[:-1], n, n))
    companion[..., 0, :] = -polynomial[..., 1:] / polynomial[..., :1]
    companion[..., np.arange(1, n), np.arange(n - 1)] = 1.0
    return np.asarray(np.linalg.eigvals(companion), dtype=complex)


class _Error:
    """``y - 1`` of K unit steps, a sum of modes: sampled, and exact wherever an event is refined."""

    def __init__(self, roots: ComplexArray, residues: ComplexArray, length: FloatArray, times: int) -> None:
        self.roots, self.residues, self.dt = roots, residues, length / times
        dt = self.dt
        ratio = np.exp(roots * dt[:, None])
        modes = np.cumprod(np.broadcast_to(ratio[..., None], (*ratio.shape, times)), axis=-1)
        later = np.einsum("kr,krt->kt", residues, modes).real
        self.samples = np.concatenate([np.full((dt.size, 1), -1.0), later], axis=-1)

    def at(self, t: FloatArray) -> ComplexArray:
        """(K, n) modes at time t (K,)."""
        return np.asarray(self.residues * np.exp(self.roots * t[:, None]))

    def peak(self) -> FloatArray:
        """Largest value (K,) above the final one: Newton on the slope from the largest sample; at least 0."""
        k = np.argmax(self.samples, axis=-1)
        t = k * self.dt
        for _ in range(3):
            modes = self.at(t)
            slope, bend = (np.sum(modes * self.roots**p, axis=-1).real for p in (1, 2))
            step = np.where(bend < 0, -slope / np.where(bend < 0, bend, -1.0), 0.0)
            t = np.clip(t + np.clip(step, -self.dt, self.dt), 0.0, None)
        refined = np.sum(self.at(t), axis=-1).real
        return np.asarray(np.maximum(np.maximum(self.samples[np.arange(k.size), k], refined), 0.0))

    def settling(self, band: float = 0.02) -> FloatArray:
        """Time (K,) after which the error stays within the band; nan when it does not within the samples."""
        outside = np.abs(self.samples) > band
        last = self.samples.shape[-1] - 1 - np.argmax(outside[:, ::-1], axis=-1)
        settled = last < self.samples.shape[-1] - 1
        k = np.minimum(last, self.samples.shape[-1] - 2)
        low, high = k * self.dt, (k + 1) * self.dt
        f_low, f_high = (np.abs(self.samples[np.arange(k.size), i]) - band for i in (k, k + 1))
        for _ in range(3):
            t = low + f_low * (high - low) / np.where(f_low > f_high, f_low - f_high, np.inf)
            f = np.abs(np.sum(self.at(t), axis=-1).real) - band
            low, f_low = np.where(f > 0, t, low), np.where(f > 0, f, f_low)
            high, f_high = np.where(f > 0, high, t), np.where(f > 0, f_high, f)
        return np.where(settled, t, np.nan)
