"""Following the aileron reference: the integral of its error, and the feed-forward to its steady state (seed 5.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.lqr.hamiltonian import solve_or_nan
from model.arrays import BoolArray, FloatArray, GridArrays
from model.linear_model import LinearModel

TabAllocation = Literal["zero_aileron_torque"]

#: Where the integral stands among the states: behind angles and rates, before lag states.
INT_A = 4

#: Beyond this many radians of tab for a radian of aileron, the tab has no authority over the aileron.
MAX_TAB_TRAVEL = 1e3


@dataclass(frozen=True, eq=False)
class TrackingPlant(GridArrays):
    """The model with the integral of the aileron's error: ``x' = A x + B u + E r_a``, ``int_a' = r_a - da``.

    Attributes
    ----------
    A (*G, n + 1, n + 1), B (*G, n + 1, 2), E (*G, n + 1, 1)
    states : ``dt dt_rate da da_rate``, then ``int_a`` [rad s], then the model's lag states if it has any
    """

    A: FloatArray
    B: FloatArray
    E: FloatArray
    states: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class SteadyState(GridArrays):
    """Where the plant rests with the aileron on its reference: ``x = N_x r_a``, ``u = N_u r_a``, from trim.

    Attributes
    ----------
    N_x : (*G, n, 1) states of the model for a radian of aileron, lag states settled
    N_u : (*G, 2, 1) torques for a radian of aileron [N m/rad], order [tab, aileron]
    attainable : (*G,) False where the tab has no authority: N_x and N_u are nan there
    """

    N_x: FloatArray
    N_u: FloatArray
    attainable: BoolArray


def augment_with_integral(model: LinearModel) -> TrackingPlant:
    """The model's plant with ``int_a' = r_a - da`` as one more state (seed 5.3)."""
    n, aileron = len(model.states), model.states.index("da")
    grid = model.A.shape[:-2]
    A, B, E = np.zeros((*grid, n + 1, n + 1)), np.zeros((*grid, n + 1, 2)), np.zeros((*grid, n + 1, 1))
    own = [i for i in range(n + 1) if i != INT_A]
    A[..., np.ix_(own, own)[0], np.ix_(own, own)[1]], B[..., own, :] = model.A, model.B
    A[..., INT_A, aileron] = -1.0
    E[..., INT_A, 0] = 1.0
    return TrackingPlant(A, B, E, (*model.states[:INT_A], "int_a", *model.states[INT_A:]))


def steady_state(model: LinearModel, tab_allocation: TabAllocation = "zero_aileron_torque") -> SteadyState:
    """Rest at a reference, the free tab angle allocated so that the aileron's torque stays at its trim value.

    ``0 = A N_x + B N_u`` with the aileron at 1 and the torque deviation of the aileron at 0: the tab floats the
    aileron to its reference (the steady-state map of seed 2.5), and the tab's actuator holds the tab.

    Parameters
    ----------
    model : finite where a result is wanted; nan in gives `attainable` False
    tab_allocation : which steady state, of the one-parameter family
    """
    if tab_allocation != "zero_aileron_torque":
        raise ValueError(f"unknown tab allocation {tab_allocation!r}")
    n, grid = len(model.states), model.A.shape[:-2]
    system = np.zeros((*grid, n + 2, n + 2))
    system[..., :n, :n], system[..., :n, n:] = model.A, model.B
    system[..., n, model.states.index("da")] = 1.0
    system[..., n + 1, n + 1] = 1.0
    wanted = np.zeros((*grid, n + 2, 1))
    wanted[..., n, 0] = 1.0
    rest = solve_or_nan(system.reshape(-1, n + 2, n + 2), wanted.reshape(-1, n + 2, 1)).reshape(wanted.shape)
    travel = np.abs(rest[..., model.states.index("dt"), 0])
    attainable = np.isfinite(rest).all(axis=(-2, -1)) & (travel <= MAX_TAB_TRAVEL)
    rest = np.where(attainable[..., None, None], rest, np.nan)
    return SteadyState(rest[..., :n, :], rest[..., n:, :], attainable)


def feed_forward(K: FloatArray, rest: SteadyState) -> FloatArray:
    """N (*G, 2, 1) of ``u = -K [x; int_a] + N r_a``: the steady state is met with the integral at zero.

    Parameters
    ----------
    K : (*G, 2, n + 1) gain on the states and, at `INT_A` among them, on the integral of the error
    """
    return np.asarray(np.delete(K, INT_A, axis=-1) @ rest.N_x + rest.N_u)
