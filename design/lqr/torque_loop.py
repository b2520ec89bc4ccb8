"""The loop of concurrent actuation: both torques from all the states, the reference fed forward (seed chapter 5)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.loop import Loop
from design.lqr.synthesis import LqrDesign
from design.lqr.tracking import TrackingPlant, augment_with_integral
from model.arrays import FloatArray
from model.linear_model import LinearModel

INPUTS = ("tab", "aileron")
ANGLES_AND_RATES = ("da", "dt", "da_rate", "dt_rate")
MEASURED = ("dt", "dt_rate", "da", "da_rate")
DISTURBANCES = ("T_t_disturbance", "T_a_disturbance", *(f"{state}_noise" for state in MEASURED))
OUTPUTS = (*ANGLES_AND_RATES, "T_t", "T_a")


def lqr_loop(model: LinearModel, design: LqrDesign) -> Loop:
    """The loop that an LQR design flies, with ideal torque actuators, over the grid.

    Inputs are the torque commands of tab and aileron [N m from trim], the reference is ``r_a`` [rad from trim],
    outputs are totals: angles [rad], rates [rad/s] and torques [N m] with their trim values. The stages are the
    loops opened at one actuator input with the other one closed, for root loci of that input's gain about
    the 1 that is flown. Every array is nan at the points whose outcome is not ok.
    """
    plant = augment_with_integral(model)
    ok = design.outcomes.ok
    grid, n, m = ok.shape, len(plant.states), len(INPUTS)
    outputs = len(OUTPUTS)
    C, D = np.zeros((*grid, outputs, n)), np.zeros((*grid, outputs, m))
    offset = np.zeros((*grid, outputs))
    for row, name in enumerate(ANGLES_AND_RATES):
        C[..., row, plant.states.index(name)] = 1.0
        offset[..., row] = model.state_offset[..., model.states.index(name)]
    D[..., -m:, :] = np.eye(m)
    offset[..., -m:] = model.input_offset
    G, M = _disturbances(plant, design.K)
    hole = np.where(ok, 0.0, np.nan)
    loop = Loop(
        A=plant.A + hole[..., None, None],
        B=plant.B + hole[..., None, None],
        E=plant.E + hole[..., None, None],
        G=G + hole[..., None, None],
        K=design.K,
        N=design.N,
        M=M,
        C=C + hole[..., None, None],
        F=np.zeros((*grid, outputs, n)) + hole[..., None, None],
        D=D + hole[..., None, None],
        H=np.zeros((*grid, outputs, m)) + hole[..., None, None],
        offset=offset + hole[..., None],
        states=plant.states,
        inputs=INPUTS,
        references=("r_a",),
        outputs=OUTPUTS,
        disturbances=DISTURBANCES,
        stages=(),
        delay=(0.0, 0.0),
    )
    return replace(loop, stages=tuple(loop.cut(name) for name in INPUTS))


def _disturbances(plant: TrackingPlant, K: FloatArray) -> tuple[FloatArray, FloatArray]:
    """G (*G, n, 6) and M (*G, 2, 6) of `DISTURBANCES`: torques beside those of the actuators, noise of four sensors.

    Noise enters the torques through the gain on its state, and that of the aileron's angle also the integral.
    """
    *grid, n, m = plant.B.shape
    G, M = np.zeros((*grid, n, m + len(MEASURED))), np.zeros((*grid, m, m + len(MEASURED)))
    G[..., :m] = plant.B
    measured = [plant.states.index(name) for name in MEASURED]
    M[..., m:] = -K[..., measured]
    integral = plant.states.index("int_a")
    G[..., integral, m:] = plant.A[..., integral, measured]
    return G, M
