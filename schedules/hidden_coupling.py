r"""Hidden coupling: what a schedule does to its own loop while the scheduling variable moves.

Every design is judged with its gains at rest. In flight the law is read at q^, the signal of the scheduling variable q
(an axis of the grid), which may lag, ``lag q^' = q - q^``. With totals X and U, and the trim X0(q), U0(q) that holds
them, the law is

    U = U0(q^) - K(q^) (X - X0(q^)) + N(q^) r - K_i(q^) int,    int' = r - (X_a - X0_a(q^))       before the gain
                                     ... - v,                   v' = K_i(q^) [r - (X_a - X0_a(q^))]   after it

In deviations from the trim of now, ``x = X - X0(q)`` with the integrators among them, around a flight point where it
rests at a constant reference, ``x_s = -Acl^-1 (E + B N) r``, this is to first order in all but x_s

    x' = Acl x + p dq + g dq^ + m (dq^ - dq) - X0_q q'

    p = (dAcl/dq) x_s + (d(E + B N)/dq) r    at constant gains: the plant changes beneath the law
    g = the same, at a constant plant: the terms dK/dq (x - x_trim) and dN/dq r of the law
    m = B (U0_q + K X0_q) + X0_q's part in the errors integrated: the law's trim is late. Without a lag it is right
    X0_q q' : the trim itself moves, K dx_trim/dq being the law's own share

g depends on where the integrators stand. Before its gain an integrator has stored int_s, which K_i(q^) multiplies:
``-B (dK_i/dq) int_s`` is one of its terms. After its gain it has stored the command itself, and that term is not
there. Stored commands v are measured by ``dv = K_i d iota``, K_i of the flight point, so that Acl is the same in both
cases. Where one error is integrated for two torques, K_i is a column, and an integrator after it holds one command a
torque: while K_i turns, the two leave its line little by little, which no integral action takes back.

From this

- in totals, ``dX = dx + X0_q dq``, q^ being a state where it lags, ``z' = A z + B dq`` (`PlacedCoupling.A`, ``B``);
- in a ramp of q, the deviation from the equilibrium of now ``y = x - x_s(q)``, ``x_s' = -Acl^-1 (p + g)``, obeys
  ``y' = Acl y - (X0_q + x_s') q' + (g + m) (q^ - q)``: how far the aileron gets away per unit of q';
- a mode of the loop grows at the rate ``lambda + q' sigma``, as seen in the aileron's angle. With right eigenvectors
  v_i whose aileron is 1, and left ones w_i, ``w_i v_j = delta_ij``, the solution ``c(t) v_i(q(t)) + ...`` of
  ``x' = Acl(q(t)) x`` has ``c'/c = lambda_i - q' w_i dv_i/dq``, and from the derivative of an eigenvector

      sigma_i = sum over j /= i of  w_j (dAcl/dq) v_i / (lambda_i - lambda_j)

  The shift of a moving loop's eigenvalues alone would depend on the coordinates; this does not. It is the first order
  of slow motion, q' sigma small beside the distances of the eigenvalues. An integrator before its gain obeys, in the
  coordinate ``v = K_i int``, the law of the one after it and ``+ q' (dK_i/dq) int``: its sigma is larger by
  ``w_i P v_i / lambda_i``, P being ``-B dK_i/dq`` in the integrators' columns.

Gains change along the axis as `schedules.interpolate.node_slopes` says, below and above each grid point. Plant and trim
have derivatives, five-point differences of the product's own linearisation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.lqr.hamiltonian import solve_or_nan
from model.arrays import ComplexArray, FloatArray, GridArrays
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.moving_loop import MovingLoop, moving_loop, why_no_coupling
from schedules.schedule import GainSchedule
from schedules.slow_ramp import ramp_deviation
from schedules.study import Study


@dataclass(frozen=True, eq=False)
class PlacedCoupling(GridArrays):
    """One placement of the integrators; the third axis is the side of the grid point, below and above.

    Attributes
    ----------
    A (*G, 2, n', n'), B (*G, 2, n') : the linearised loop with the scheduling variable as its input, in total states;
        n' is n, or n + 1 with the lagging signal behind the loop's states
    rate_shift : (*G, 2, n) sigma: of each eigenvalue, growth as seen in the aileron per unit of q' [1/(unit of q)]
    settled : (*G, 2) the aileron's deviation in a ramp that has lasted, per unit of q' [rad/(unit of q/s)]
    peak : (*G, 2) its largest size since the ramp began
    """

    A: FloatArray
    B: FloatArray
    rate_shift: ComplexArray
    settled: FloatArray
    peak: FloatArray

    def _sides(self, which: slice) -> PlacedCoupling:
        """The same of some of its sides, grid points in one row."""
        fields = (self.A, self.B, self.settled, self.peak)
        A, B, settled, peak = (each[:, which] for each in fields)
        return PlacedCoupling(A, B, self.rate_shift[:, which], settled, peak)


@dataclass(frozen=True, eq=False)
class HiddenCoupling(GridArrays):
    """What a moving scheduling variable does to the loop at each grid point; nan where there is no design.

    Attributes
    ----------
    eigenvalues : (*G, n) of the loop at rest [1/s], as numpy orders them
    rest : (*G, n) x_s, the deviations from trim at the reference
    trim_slope : (*G, n) X0_q [per unit of q]
    before_gain, after_gain : both placements of the integrators; the same where there are none
    states : names (n)
    signal_lag : of q^ [s]
    """

    eigenvalues: ComplexArray
    rest: FloatArray
    trim_slope: FloatArray
    before_gain: PlacedCoupling
    after_gain: PlacedCoupling
    states: tuple[str, ...]
    signal_lag: float

    @property
    def placed(self) -> dict[str, PlacedCoupling]:
        """By the name of the placement (`schedules.rules.IntegratorPlacement`)."""
        return {"before_gain": self.before_gain, "after_gain": self.after_gain}


def hidden_coupling(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    schedule: GainSchedule,
    signal_lag: float = 0.0,
) -> HiddenCoupling:
    """The loops of a schedule with their scheduling variable, the grid's speed axis, in motion.

    The loop rests at the study's reference. The trim is taken to be scheduled without error. Whichever placement the
    schedule's rules name, both are worked out.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : the controller
    schedule : its gains with their rules
    signal_lag : time constant of the scheduling signal [s], 0: measured at once

    Raises
    ------
    ValueError : `why_no_coupling` has a reason, or the lag is not a number of at least 0
    """
    reason = why_no_coupling(study, plant, designed)
    if reason is not None:
        raise ValueError(f"controller {designed.request.name}: {reason}")
    if not 0.0 <= signal_lag < np.inf:
        raise ValueError(f"the lag of the scheduling signal must be at least 0 s and finite, not {signal_lag}")
    loop, ok = moving_loop(study, plant, designed, schedule), designed.outcomes.ok
    values, vectors = np.linalg.eig(loop.closed)
    stored = _by_modes(vectors, loop.by_stored)
    with np.errstate(divide="ignore", invalid="ignore"):
        kept = np.einsum("nsii->nsi", stored) / values[:, None, :]
    seen = vectors[:, loop.states.index("da")]
    growth = _growth(values, _by_modes(vectors, loop.by_plant[:, None] + loop.by_gains), seen)
    # Both placements at once: sides (N, 4, n), first those of integrators before the gain.
    p = _times(loop.by_plant[:, None], loop.rest) + loop.reference_by_plant[:, None]
    g = np.tile(_times(loop.by_gains, loop.rest) + loop.reference_by_gains, (1, 2, 1))
    g[:, 2:] -= _times(loop.by_stored, loop.rest)
    both = _moving(loop, p, g, np.concatenate([growth, growth - kept], axis=1), signal_lag)
    before, after = both._sides(slice(0, 2)), both._sides(slice(2, 4))
    return HiddenCoupling(
        values, loop.rest, loop.trim_slope, before, after, loop.states, signal_lag
    ).spread(ok)  # fmt: skip


def _moving(loop: MovingLoop, p: FloatArray, g: FloatArray, growth: ComplexArray, lag: float) -> PlacedCoupling:
    """Of four sides, (N, 4, ..), from p (N, 1, n) of the plant and g (N, 4, n) of the gains."""
    follow = np.swapaxes(solve_or_nan(loop.closed, np.swapaxes(p + g, -1, -2)), -1, -2)
    late = g + loop.late_trim[:, None]
    settled, peak = ramp_deviation(
        loop.closed, follow - loop.trim_slope[:, None], -lag * late, lag, loop.states.index("da")
    )
    # In totals dx = dX - X0_q dq.
    still = p - loop.late_trim[:, None] - _times(loop.closed[:, None], loop.trim_slope)
    if lag == 0.0:
        A = np.broadcast_to(loop.closed[:, None], (*g.shape, g.shape[-1]))
        return PlacedCoupling(A, still + late, growth, settled, peak)
    count, sides, n = g.shape
    A, B = np.zeros((count, sides, n + 1, n + 1)), np.full((count, sides, n + 1), 1.0 / lag)
    A[..., :n, :n], A[..., :n, n], A[..., n, n] = loop.closed[:, None], late, -1.0 / lag
    B[..., :n] = still
    return PlacedCoupling(A, B, growth, settled, peak)


def _growth(values: ComplexArray, slope: ComplexArray, seen: ComplexArray) -> ComplexArray:
    """Growth sigma (N, 2, n) from ``w_j (dAcl/dq) v_i`` (N, 2, n, n), j first, v of any length.

    `seen` (N, n) is the aileron in each v. Nan where eigenvalues coincide, and of a mode that leaves the aileron alone.
    """
    apart = values[:, None, :] - values[:, :, None]  # lambda_i - lambda_j at [j, i]
    with np.errstate(divide="ignore", invalid="ignore"):
        each = slope * (seen[:, :, None] / seen[:, None, :] / apart)[:, None]
    own = np.arange(values.shape[-1])
    each[..., own, own] = 0.0
    growth = np.sum(each, axis=-2)
    known = np.isfinite(growth) & (seen != 0.0)[:, None]
    return np.where(known, growth, complex(np.nan, np.nan))


def _by_modes(vectors: ComplexArray, matrices: FloatArray) -> ComplexArray:
    """``w_j M v_i`` (N, 2, n, n) of matrices (N, 2, n, n)."""
    count, sides, n, _ = matrices.shape
    right = np.moveaxis(matrices @ vectors[:, None], 1, 2).reshape(count, n, sides * n)
    return np.moveaxis(solve_or_nan(vectors, right).reshape(count, n, sides, n), 2, 1)


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """``M x`` (N, 2, n) of matrices (N, 2 or 1, n, n) and vectors (N, n)."""
    return np.asarray((matrices @ vectors[:, None, :, None])[..., 0])
