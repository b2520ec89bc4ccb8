"""Servo-tab reduction: the tab's motion is imposed, the aileron follows (seed 2.3.21 to 2.3.31)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import ComplexArray, FloatArray, GridArrays
from model.linear_model import LinearModel
from model.polynomial_product import times


@dataclass(frozen=True, eq=False)
class ServoTab(GridArrays):
    """Aileron driven by the tab alone: ``x' = F x + G [dt, dt']``, x = [da, da'], then lag states, over the grid.

    The transfer function from tab to aileron deflection is

        da/dt = (beta1 s + beta0) / (s^2 + 2 zeta omega s + omega^2),

    and with the two lag states of unsteady damping a cubic over a quartic.

    Attributes
    ----------
    F : (*G, n, n), G : (*G, n, 2) columns [dt, dt'] (seed 2.3.22); n is 2, or 4 with lag states
    numerator : (*G, n) ``[beta1, beta0]`` (seed 2.3.29), from the highest power down
    denominator : (*G, n + 1) ``[1, 2 zeta omega, omega^2]``, or with lags ``[1, ...]`` down to the constant
    dc_gain : (*G,) steady da over dt (seed 2.3.30 with its sign: negative); nan without stiffness
    zero : (*G,) ``-beta0 / beta1`` [rad/s]; of three zeros the largest, nan should that be one of a complex pair; nan
        where the numerator's first coefficient is zero
    natural_frequency : (*G,) omega [rad/s]; nan where the aileron's own stiffness does not restore. With lags:
        ``|s|`` of the least damped pair of poles, nan where there is none
    damping_ratio : (*G,) zeta [-], of the same poles; nan there too
    states : names, ``da, da_rate`` and those of the lags
    """

    F: FloatArray
    G: FloatArray
    numerator: FloatArray
    denominator: FloatArray
    dc_gain: FloatArray
    zero: FloatArray
    natural_frequency: FloatArray
    damping_ratio: FloatArray
    states: tuple[str, ...] = ("da", "da_rate")

    @property
    def static_stiffness(self) -> FloatArray:
        """What drives the resting aileron back, a radian off (*G,) [1/s^2]; ``omega^2`` without lags."""
        return np.asarray(-_settled(self.F, self.F[..., 0]))

    @property
    def static_tab_effect(self) -> FloatArray:
        """Acceleration of the resting aileron by a radian of resting tab (*G,) [1/s^2]; ``beta0`` without lags."""
        return _settled(self.F, self.G[..., 0])


def servo_tab(model: LinearModel) -> ServoTab:
    """Reduce a linear model to its aileron, the tab's angle and rate being inputs.

    As in seed 2.3.21 the inertial reaction of the tab's acceleration is left out, and the inertia is
    ``I_at = J[a, a]``, virtual inertia included when the model has it. Lag states are driven by both surfaces.
    """
    row = model.air_torque[..., 1, :] / model.inertia[..., 1, 1, None]
    grid, lags = row.shape[:-1], model.lag_torque.shape[-1]
    F, G = np.zeros((*grid, 2 + lags, 2 + lags)), np.zeros((*grid, 2 + lags, 2))
    F[..., 0, 1] = 1.0
    F[..., 1, :] = row[..., 2:]
    F[..., 2:, :] = model.A[..., 4:, 2:]
    G[..., 1, :], G[..., 2:, :] = row[..., :2], model.A[..., 4:, :2]
    return _plain(F, G) if lags == 0 else _lagging(F, G, ("da", "da_rate", *model.states[4:]))


def _plain(F: FloatArray, G: FloatArray) -> ServoTab:
    """Without lag states: the second order of seed 2.3.29."""
    beta1, beta0 = G[..., 1, 1], G[..., 1, 0]
    restoring, drag = -F[..., 1, 0], -F[..., 1, 1]
    omega = np.sqrt(np.where(restoring > 0.0, restoring, np.nan))
    return ServoTab(
        F=F,
        G=G,
        numerator=np.stack([beta1, beta0], axis=-1),
        denominator=np.stack([np.ones_like(drag), drag, restoring], axis=-1),
        dc_gain=_ratio(beta0, restoring),
        zero=_ratio(-beta0, beta1),
        natural_frequency=np.asarray(omega),
        damping_ratio=np.asarray(drag / (2.0 * omega)),
    )


def _lagging(F: FloatArray, G: FloatArray, states: tuple[str, ...]) -> ServoTab:
    """With two lag states: ``P_1 P_2`` times the aileron's equation of motion, ``P_i = s - F_ii``."""
    first, second = (np.stack([np.ones_like(p), -p], axis=-1) for p in (F[..., 2, 2], F[..., 3, 3]))
    both = times(first, second)
    by_aileron, by_tab = F[..., [1, 2, 3], :2][..., ::-1], G[..., 1:, ::-1]  # coefficients of s, then of 1
    motion = np.stack([np.ones(F.shape[:-2]), -by_aileron[..., 0, 0], -by_aileron[..., 0, 1]], axis=-1)
    denominator, numerator = times(motion, both), times(by_tab[..., 0, :], both)
    for i, other in enumerate((second, first), start=1):
        torque = F[..., 1, 1 + i, None]
        denominator[..., 2:] -= torque * times(by_aileron[..., i, :], other)
        numerator[..., 1:] += torque * times(by_tab[..., i, :], other)
    frequency, ratio = _least_damped(F)
    return ServoTab(
        F=F,
        G=G,
        numerator=numerator,
        denominator=denominator,
        dc_gain=_ratio(numerator[..., -1], denominator[..., -1]),
        zero=_largest_zero(numerator),
        natural_frequency=frequency,
        damping_ratio=ratio,
        states=states,
    )


def _settled(F: FloatArray, column: FloatArray) -> FloatArray:
    """Acceleration of the aileron at rest by one column of F or G (*G, n), when the lags, if any, have settled."""
    lags = -column[..., 2:] / np.diagonal(F, axis1=-2, axis2=-1)[..., 2:]
    return np.asarray(column[..., 1] + np.sum(F[..., 1, 2:] * lags, axis=-1))


def _least_damped(F: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Natural frequency [rad/s] and damping ratio (*G,) of the least damped pair of poles; nan where there is none."""
    poles = _eigenvalues(F)
    size = np.abs(poles)
    upper = np.asarray(poles.imag > 0.0)
    ratio = np.where(upper, -poles.real / np.where(upper, size, 1.0), np.inf)
    pick = np.argmin(ratio, axis=-1)[..., None]
    found = np.take_along_axis(upper, pick, axis=-1)[..., 0]
    frequency, damping = (np.take_along_axis(x, pick, axis=-1)[..., 0] for x in (size, ratio))
    return np.where(found, frequency, np.nan), np.where(found, damping, np.nan)


def _largest_zero(numerator: FloatArray) -> FloatArray:
    """Root of cubics (*G, 4) farthest from zero; nan where the first coefficient vanishes or the root is complex."""
    lead = numerator[..., :1]
    companion = np.zeros((*numerator.shape[:-1], 3, 3))
    companion[..., 0, :] = -numerator[..., 1:] / np.where(lead != 0.0, lead, np.nan)
    companion[..., 1, 0] = companion[..., 2, 1] = 1.0
    roots = _eigenvalues(companion)
    far = np.take_along_axis(roots, np.argmax(np.abs(roots), axis=-1)[..., None], axis=-1)[..., 0]
    return np.where(far.imag == 0.0, far.real, np.nan)


def _eigenvalues(matrix: FloatArray) -> ComplexArray:
    """Eigenvalues (*G, n); nan where the matrix (*G, n, n) is not finite."""
    finite = np.asarray(np.isfinite(matrix).all(axis=(-2, -1)))
    values = np.linalg.eigvals(np.where(finite[..., None, None], matrix, 0.0)).astype(complex)
    return np.where(finite[..., None], values, complex(np.nan, np.nan))


def _ratio(top: FloatArray, bottom: FloatArray) -> FloatArray:
    """``top / bottom``, nan where the bottom is zero."""
    return np.asarray(top / np.where(bottom != 0.0, bottom, np.nan))
