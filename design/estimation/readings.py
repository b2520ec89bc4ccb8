"""What a controller reads: measured angles, its own states, and what it must work out for itself.

A full-state feedback loop (`design.lqr.torque_loop.lqr_loop`) reads every state. Its states are the plant's (angles,
rates, torques behind a lag, lag states of the circulation) and the controller's own, which it runs and therefore knows:
integrals of measured angles, and its model of each delay, run on the commands that it gives.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from design.loop import Loop
from model.arrays import BoolArray

#: Angles that are measured, and the rate that belongs to each.
RATES: dict[str, str] = {"dt": "dt_rate", "da": "da_rate"}
NOISES = tuple(f"{angle}_noise" for angle in RATES)
#: Torques on the surfaces beside those of the actuators.
TORQUES = ("T_t_disturbance", "T_a_disturbance")

_OWN = re.compile(r"int_.+|(tab|aileron)_delay_\d+|.+_filtered|est_.+")


def is_controllers(state: str) -> bool:
    """Whether a state of this name is run by the controller: integrals, models of delays, filters, estimates."""
    return _OWN.fullmatch(state) is not None


def controller_states(states: Sequence[str]) -> tuple[str, ...]:
    """The states among these that the controller runs itself, in order."""
    return tuple(name for name in states if is_controllers(name))


def delay_states(loop: Loop, actuator: str) -> list[int]:
    """Rows of the controller's model of the delay of an actuator; none where it has no such model."""
    return [i for i, name in enumerate(loop.states) if re.fullmatch(rf"{actuator}_delay_\d+", name)]


def known_points(loop: Loop) -> BoolArray:
    """(*G,) mask of the points whose plant and gains are finite."""
    arrays = (loop.A, loop.B, loop.E, loop.G, loop.K, loop.N, loop.M)
    return np.asarray(np.all([np.isfinite(matrix).all(axis=(-2, -1)) for matrix in arrays], axis=0))


def refuse_unless_full_state(loop: Loop) -> None:
    """Raise ValueError unless the loop feeds back angles and rates that it measures, with their noise among its inputs.

    Raises
    ------
    ValueError : it has no such states or disturbances, or already has filters or estimates
    """
    missing = [name for pair in RATES.items() for name in pair if name not in loop.states]
    missing += [name for name in (*TORQUES, *NOISES) if name not in loop.disturbances]
    if missing:
        raise ValueError(f"not a full-state feedback of tab and aileron: there is no {', '.join(missing)}")
    made = [name for name in loop.states if name.startswith("est_") or name.endswith("_filtered")]
    if made:
        raise ValueError(f"the loop works out states already: {', '.join(made)}")


def left_disturbances(loop: Loop) -> tuple[str, ...]:
    """Names of the disturbances that are left when rates are not measured."""
    gone = {f"{rate}_noise" for rate in RATES.values()}
    return tuple(name for name in loop.disturbances if name not in gone)
