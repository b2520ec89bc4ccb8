"""The circulation's lag in time: two states that both hinges share, behind damping ``unsteady``.

With ``w = T10/pi d + T11/(4 pi) c d'/V`` summed over tab and aileron, the incidence [rad] that the deflections are
worth to the circulation,

    lag_i' = (2 V/c) b_i (w - lag_i),    C_H gets  -G_alpha sum over i of a_i (w - lag_i)

beside the quasi-steady terms: ``C_H`` of the circulation is ``G_alpha C(p) w``. The lags are angles, trailing edge up
positive like the deflections, and equal w in steady state. The incidence of the whole section is steady and has no lag.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from model.arrays import FloatArray
from model.flight import FlightCondition
from model.hinge_moments.unsteady import JONES_RATES, JONES_WEIGHTS
from model.system import TabAileron

LAG_STATES: Final = ("lag_1", "lag_2")


def lag_rows(system: TabAileron, condition: FlightCondition) -> FloatArray:
    """Rows of ``[lag_1', lag_2']`` over ``[dt, dt', da, da', lag_1, lag_2]`` (*G, 2, 6) [1/s]."""
    pace = lag_pace(system, condition)
    worth = incidence_row(system, condition)
    rows = np.zeros((*np.broadcast_shapes(pace.shape[:-1], worth.shape[:-1]), 2, 6))
    rows[..., :4] = pace[..., :, None] * worth[..., None, :]
    rows[..., 0, 4], rows[..., 1, 5] = -pace[..., 0], -pace[..., 1]
    return rows


def lag_columns(system: TabAileron) -> FloatArray:
    """``dC_H / d[lag_1, lag_2]`` (*H, 2, 2), rows [tab, aileron], incompressible [1/rad]."""
    return np.asarray(system.incidence_derivatives[..., :, None] * np.array(JONES_WEIGHTS))


def lag_pace(system: TabAileron, condition: FlightCondition) -> FloatArray:
    """``(2 V/c) b_i`` (*G, 2) [1/s]."""
    pace = np.asarray(2.0 * condition.airspeed / system.geometry.chord)
    return np.asarray(pace[..., None] * np.array(JONES_RATES))


def incidence_row(system: TabAileron, condition: FlightCondition) -> FloatArray:
    """``dw / d[dt, dt', da, da']`` (*G, 4): rad per rad, and s."""
    time = np.asarray(system.geometry.chord / condition.airspeed)[..., None]
    rates = time * system.circulatory_rates
    row = np.zeros((*rates.shape[:-1], 4))
    row[..., 0::2], row[..., 1::2] = system.circulatory_angles, rates
    return row


def circulatory_incidence(system: TabAileron, condition: FlightCondition, state: FloatArray) -> FloatArray:
    """The incidence w (*G,) [rad] at a state (*G, 4 or more) that begins ``[dt, dt', da, da']``."""
    return np.asarray(np.sum(incidence_row(system, condition) * np.asarray(state, float)[..., :4], axis=-1))


def lag_rates(system: TabAileron, condition: FlightCondition, state: FloatArray) -> FloatArray:
    """``[lag_1', lag_2']`` (*G, 2) [rad/s] at states ``[dt, dt', da, da', lag_1, lag_2]`` (*G, 6)."""
    behind = circulatory_incidence(system, condition, state)[..., None] - state[..., 4:]
    return np.asarray(lag_pace(system, condition) * behind)


def with_settled_lags(system: TabAileron, condition: FlightCondition, state: FloatArray) -> FloatArray:
    """States (*G, 6) from ``[dt, dt', da, da']`` (*G, 4), both lags at what they tend to: C(k) = 1."""
    w = circulatory_incidence(system, condition, state)[..., None]
    state = np.broadcast_to(state, (*w.shape[:-1], 4))
    return np.concatenate([state, w, w], axis=-1)


def lag_coefficients(system: TabAileron, condition: FlightCondition, state: FloatArray) -> FloatArray:
    """What is added to the quasi-steady ``C_H`` (*G, 2), order [tab, aileron], at states (*G, 6); incompressible."""
    behind = circulatory_incidence(system, condition, state)[..., None] - np.asarray(state, float)[..., 4:]
    missing = np.sum(np.array(JONES_WEIGHTS) * behind, axis=-1, keepdims=True)
    return np.asarray(-system.incidence_derivatives * missing)
