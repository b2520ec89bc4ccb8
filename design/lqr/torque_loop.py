"""The loop that an LQR design flies, and its gains by name (seed chapter 5)."""

from __future__ import annotations

import numpy as np

from design.gains import Gain
from design.loop import Loop
from design.lqr.flown import flown_loop
from design.lqr.synthesis import LqrDesign
from model.linear_model import INPUTS, LinearModel

_UNITS = {
    "dt": "N m/rad",
    "da": "N m/rad",
    "dt_rate": "N m s/rad",
    "da_rate": "N m s/rad",
    "int_a": "N m/(rad s)",
    "int_t": "N m/(rad s)",
    "lag_1": "N m/rad",
    "lag_2": "N m/rad",
}


def lqr_loop(model: LinearModel, design: LqrDesign) -> Loop:
    """The loop that an LQR design flies, over the grid.

    Inputs are the torque commands of tab and aileron [N m from trim], references the wanted angles [rad from trim],
    outputs are totals: angles [rad], rates [rad/s], torques on the surfaces [N m] with their trim values, and the
    commands of torques that lag them, as they reach the actuators. The stages are the
    loops opened at one actuator input with the other one closed, for root loci of that input's gain about
    the 1 that is flown. Every array is nan at the points whose outcome is not ok.
    """
    loop = flown_loop(model, design.structure, design.K, design.N)
    ok = design.outcomes.ok
    return loop if np.all(ok) else loop.take(ok).spread(ok)


def gains(design: LqrDesign) -> tuple[Gain, ...]:
    """``K_<input>_<state>`` and ``N_<input>_<reference>``, row by row; a gain on a torque has the unit 1."""
    feedback = [
        Gain(f"K_{u}_{x}", _UNITS.get(x, "1"), design.K[..., i, j])
        for i, u in enumerate(INPUTS)
        for j, x in enumerate(design.states)
    ]
    forward = [
        Gain(f"N_{u}_{r}", "N m/rad", design.N[..., i, j])
        for i, u in enumerate(INPUTS)
        for j, r in enumerate(design.structure.references)
    ]
    return (*feedback, *forward)
