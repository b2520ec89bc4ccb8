"""The thesis's rate effect: angles that the surfaces' motion induces (seed 2.2.12 and 2.2.13, verbatim).

    Delta_a = (ca/4) da' / V
    Delta_t = (cos(dt) ca da' + (ct/4) dt') / V

They are added to the deflections before the steady hinge moments are read. The tangent of the seed's
formula is taken for small rates, as it does itself; levers and the double count of the aileron's own
motion are kept as printed (README, decision 7).
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray
from model.section import Geometry


def induced_angles(geometry: Geometry, airspeed: FloatArray, state: FloatArray) -> FloatArray:
    """Induced angles (*G, 2), order [tab, aileron] [rad], at state ``[dt, dt', da, da']`` (*G, 4)."""
    dt, tab_rate, aileron_rate = state[..., 0], state[..., 1], state[..., 3]
    tab = (np.cos(dt) * geometry.aileron_chord * aileron_rate + geometry.tab_chord / 4.0 * tab_rate) / airspeed
    aileron = geometry.aileron_chord / 4.0 * aileron_rate / airspeed
    return np.stack(np.broadcast_arrays(tab, aileron), axis=-1)


def induced_angle_derivatives(geometry: Geometry, airspeed: FloatArray, state: FloatArray) -> FloatArray:
    """Derivatives of `induced_angles` by the state (*G, 2, 4): rows [tab, aileron], columns as the state."""
    dt, aileron_rate = state[..., 0], state[..., 3]
    aileron_lever = np.asarray(geometry.aileron_chord / airspeed)
    tab_lever = np.asarray(geometry.tab_chord / airspeed)
    by_tab = -aileron_rate * np.sin(dt) * aileron_lever
    by_aileron_rate = np.cos(dt) * aileron_lever
    derivatives = np.zeros((*np.broadcast(by_tab, by_aileron_rate, tab_lever).shape, 2, 4))
    derivatives[..., 0, 0] = by_tab
    derivatives[..., 0, 1] = tab_lever / 4.0
    derivatives[..., 0, 3] = by_aileron_rate
    derivatives[..., 1, 3] = aileron_lever / 4.0
    return derivatives
