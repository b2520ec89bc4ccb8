"""Following references: the integrals of their errors, and the feed-forward to their steady state (seed 5.3, 5.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.pade import delay_chain
from design.lqr.allocation import MAX_TAB_TRAVEL, TabAllocation, TabRatio, no_rest, tab_travel
from design.lqr.hamiltonian import solve_or_nan
from design.lqr.regulator import finite
from design.lqr.structures import FOLLOWED, INTEGRALS, Structure
from model.arrays import BoolArray, FloatArray, GridArrays, ObjectArray
from model.linear_model import STATES, LinearModel


@dataclass(frozen=True, eq=False)
class TrackingPlant(GridArrays):
    """The model with all that is built around it: ``x' = A x + B u + E r + T w``.

    Attributes
    ----------
    A (*G, n, n)
    B : (*G, n, 2) of the commanded torques u [N m from trim], order [tab, aileron]
    E : (*G, n, p) of the references [rad from trim]
    T : (*G, n, 2) of torques w on the surfaces beside those of the actuators [N m]
    states : `Structure.states`: ``dt dt_rate da da_rate``, then integrals [rad s], torques [N m], lags, delays
    structure : what was built
    """

    A: FloatArray
    B: FloatArray
    E: FloatArray
    T: FloatArray
    states: tuple[str, ...]
    structure: Structure


@dataclass(frozen=True, eq=False)
class SteadyState(GridArrays):
    """Where the plant rests with the surfaces on their references: ``x = N_x r``, ``u = N_u r``, from trim.

    Attributes
    ----------
    N_x : (*G, n, p) states of the plant for a radian of each reference, integrals at zero, lags settled
    N_u : (*G, 2, p) torques [N m/rad], order [tab, aileron]
    attainable : (*G,) False where there is no such rest: N_x and N_u are nan there
    reasons : (*G,) object array of str, None where it is attainable
    """

    N_x: FloatArray
    N_u: FloatArray
    attainable: BoolArray
    reasons: ObjectArray


#: The plainest structure that follows: the aileron's angle, with torques that are what is commanded.
AILERON = Structure()


def augment_with_integral(model: LinearModel, structure: Structure = AILERON) -> TrackingPlant:
    """The model's plant with the integrals, torque lags and delay chains of a structure as more states."""
    states = structure.states(model.states)
    at = {name: i for i, name in enumerate(states)}
    own = [at[name] for name in model.states]
    grid, n, m = model.A.shape[:-2], len(states), model.B.shape[-1]
    A, B, T = np.zeros((*grid, n, n)), np.zeros((*grid, n, m)), np.zeros((*grid, n, m))
    E = np.zeros((*grid, n, len(structure.references)))
    A[..., np.ix_(own, own)[0], np.ix_(own, own)[1]], T[..., own, :] = model.A, model.B
    for column, name in enumerate(structure.references):
        A[..., at[INTEGRALS[name]], at[FOLLOWED[name]]] = -1.0
        E[..., at[INTEGRALS[name]], column] = 1.0
    for i, drive in enumerate(structure.drives):
        # From the surface back to the command: what drives the next thing is `into`.
        into = T[..., :, i].copy()
        if drive.torque_state is not None and drive.bandwidth is not None:
            lag = at[drive.torque_state]
            A[..., :, lag] += into
            A[..., lag, lag] -= drive.bandwidth
            into = np.where(np.arange(n) == lag, drive.bandwidth, np.zeros((*grid, n)))
        if drive.chain:
            chain, first = delay_chain(drive.delay_states), at[drive.chain[0]]
            held = slice(first, first + chain.order)
            A[..., :, held] += into[..., :, None] * chain.c
            A[..., held, held] += chain.A / drive.delay
            into = np.zeros((*grid, n))
            into[..., held] = chain.b / drive.delay
        B[..., :, i] = into
    return TrackingPlant(A, B, E, T, states, structure)


def holding_torques(model: LinearModel) -> tuple[FloatArray, FloatArray]:
    """States (*G, n, 2) and torques (*G, 2, 2) that rest at a radian of tab, of aileron; nan where nothing does.

    From ``0 = A x + B u`` with the angles given and the rates zero; the lag states settle.
    """
    angles, rates = ([model.states.index(name) for name in names] for names in (("dt", "da"), ("dt_rate", "da_rate")))
    lags = list(range(len(STATES), len(model.states)))
    rows, size = [*rates, *lags], len(rates) + len(lags)
    system = np.concatenate([model.A[..., rows, :][..., lags], model.B[..., rows, :]], axis=-1)
    by_angle = model.A[..., rows, :][..., angles]
    unknown = solve_or_nan(system.reshape(-1, size, size), -by_angle.reshape(-1, size, 2)).reshape(by_angle.shape)
    states = np.zeros((*model.A.shape[:-1], 2))
    states[..., angles, :], states[..., lags, :] = np.eye(2), unknown[..., : len(lags), :]
    return states, unknown[..., len(lags) :, :]


def steady_state(
    model: LinearModel, tab_allocation: TabAllocation = "zero_aileron_torque", structure: Structure = AILERON
) -> SteadyState:
    """Rest at the references; a tab without a reference of its own is allocated by a rule (`design.lqr.allocation`).

    Parameters
    ----------
    model : finite where a result is wanted; nan in gives `attainable` False
    tab_allocation : which steady state, of the one-parameter family; without effect where no or both angles are given
    structure : references, and what is between commands and torques

    Raises
    ------
    ValueError : an unknown rule
    """
    by_angle, holding = holding_torques(model)
    angles = _resting_angles(holding, tab_allocation, structure)
    with np.errstate(invalid="ignore"):
        N_u = holding @ angles
        by_reference = by_angle @ angles
    states = structure.states(model.states)
    N_x = np.zeros((*model.A.shape[:-2], len(states), angles.shape[-1]))
    N_x[..., [states.index(name) for name in model.states], :] = by_reference
    for i, drive in enumerate(structure.drives):
        if drive.torque_state is not None:
            N_x[..., states.index(drive.torque_state), :] = N_u[..., i, :]
        if drive.chain:  # of a signal at rest a chain holds the mean, and nothing else
            N_x[..., states.index(drive.chain[0]), :] = N_u[..., i, :]
    known = finite(N_u) & finite(N_x)
    attainable = np.asarray(known & (np.abs(angles) <= MAX_TAB_TRAVEL).all(axis=(-2, -1)))
    found, reasons = attainable[..., None, None], np.full(attainable.shape, None, dtype=object)
    reasons[~attainable] = no_rest(tab_allocation if structure.reference == "aileron" else TabRatio(0.0))
    return SteadyState(np.where(found, N_x, np.nan), np.where(found, N_u, np.nan), attainable, reasons)


def _resting_angles(holding: FloatArray, tab_allocation: TabAllocation, structure: Structure) -> FloatArray:
    """Angles (*G, 2, p) for a radian of each reference, order [tab, aileron]."""
    angles = np.zeros((*holding.shape[:-2], 2, len(structure.references)))
    for column, name in enumerate(structure.references):
        angles[..., ("dt", "da").index(FOLLOWED[name]), column] = 1.0
    if structure.reference == "aileron":
        angles[..., 0, 0] = tab_travel(holding, tab_allocation, structure.tab, structure.aileron)
    return angles


def feed_forward(K: FloatArray, rest: SteadyState) -> FloatArray:
    """N (*G, 2, p) of ``u = -K x + N r``: the steady state is met with the integrals at zero.

    Parameters
    ----------
    K : (*G, 2, n) gain on the states of the plant
    rest : of the same structure
    """
    return np.asarray(K @ rest.N_x + rest.N_u)
