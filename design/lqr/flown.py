"""The loop of concurrent actuation as it is flown: both torques from all the states, references fed forward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.delay.pade import delay_chain
from design.loop import Loop
from design.lqr.structures import Structure
from design.lqr.tracking import TrackingPlant, augment_with_integral
from design.padded import padded
from model.arrays import FloatArray
from model.linear_model import LinearModel

INPUTS = ("tab", "aileron")
ANGLES_AND_RATES = ("da", "dt", "da_rate", "dt_rate")
TORQUES = ("T_t", "T_a")
MEASURED = ("dt", "dt_rate", "da", "da_rate")
DISTURBANCES = ("T_t_disturbance", "T_a_disturbance", *(f"{state}_noise" for state in MEASURED))


def flown_loop(model: LinearModel, structure: Structure, K: FloatArray, N: FloatArray) -> Loop:
    """The loop of ``u = -K x + N r`` around the model, over the grid; its delays are those of the loop, exact.

    Where the design has states for a delay (`Structure.delay_states`), the controller runs them itself, on the
    torques that it commands: they are part of what is flown, behind the states of the plant. Opening the loop at an
    input opens it at the actuator; the controller's own states still know the command.

    Parameters
    ----------
    model : (*G) plant
    structure : references and actuators
    K (*G, 2, n), N (*G, 2, p) : over the states and references of the structure
    """
    plant = augment_with_integral(model, replace(structure, delay_states=0))
    (C, D, offset), (G, M) = _outputs(model, plant), _disturbances(plant, K)
    grid, o, n, m = plant.A.shape[:-2], C.shape[-2], K.shape[-1], len(INPUTS)
    loop = Loop(
        A=padded(plant.A, n, n), B=padded(plant.B, n, m), E=padded(plant.E, n, N.shape[-1]), K=K, N=N, M=M,
        G=padded(G, n, G.shape[-1]), C=padded(C, o, n), F=np.zeros((*grid, o, n)), D=D, H=np.zeros((*grid, o, m)),
        offset=offset, states=structure.states(model.states), inputs=INPUTS, references=structure.references,
        outputs=(*ANGLES_AND_RATES, *TORQUES, *_commands(structure)), disturbances=DISTURBANCES, stages=(),
        delay=tuple(drive.delay for drive in structure.drives),
    )  # fmt: skip
    loop = _with_chains(loop, structure)
    return replace(loop, stages=tuple(loop.cut(name) for name in INPUTS))


def _commands(structure: Structure) -> tuple[str, ...]:
    """Outputs that are commands: of a torque without a lag the command is the torque."""
    lagged = zip(TORQUES, structure.drives, strict=True)
    return tuple(f"{name}_command" for name, drive in lagged if drive.torque_state is not None)


def _outputs(model: LinearModel, plant: TrackingPlant) -> tuple[FloatArray, FloatArray, FloatArray]:
    """C (*G, o, n), D (*G, o, 2) and offset (*G, o): angles, rates, torques, and commands as the actuators get them."""
    names = (*ANGLES_AND_RATES, *TORQUES, *_commands(plant.structure))
    *grid, n, m = plant.B.shape
    C, D, offset = np.zeros((*grid, len(names), n)), np.zeros((*grid, len(names), m)), np.zeros((*grid, len(names)))
    for row, name in enumerate(ANGLES_AND_RATES):
        C[..., row, plant.states.index(name)] = 1.0
        offset[..., row] = model.state_offset[..., model.states.index(name)]
    for i, (name, drive) in enumerate(zip(TORQUES, plant.structure.drives, strict=True)):
        row = names.index(name)
        offset[..., row] = model.input_offset[..., i]
        if drive.torque_state is None:
            D[..., row, i] = 1.0
        else:
            C[..., row, plant.states.index(drive.torque_state)] = 1.0
            row = names.index(f"{name}_command")
            offset[..., row], D[..., row, i] = model.input_offset[..., i], 1.0
    return C, D, offset


def _disturbances(plant: TrackingPlant, K: FloatArray) -> tuple[FloatArray, FloatArray]:
    """G (*G, n, 6) and M (*G, 2, 6) of `DISTURBANCES`: torques beside those of the actuators, noise of four sensors.

    Noise enters the torques through the gain on its state, and that of an angle also the integral of its error.
    """
    *grid, n, m = plant.B.shape
    G, M = np.zeros((*grid, n, m + len(MEASURED))), np.zeros((*grid, m, m + len(MEASURED)))
    G[..., :m] = plant.T
    measured = [plant.states.index(name) for name in MEASURED]
    M[..., m:] = -K[..., measured]
    for name in plant.structure.integrals:
        integral = plant.states.index(name)
        G[..., integral, m:] = plant.A[..., integral, measured]
    return G, M


def _with_chains(loop: Loop, structure: Structure) -> Loop:
    """The controller's own model of each delay: ``delay z' = A z + b u``, with u = -K x + N r + M w."""
    chained = [drive for drive in structure.drives if drive.chain]
    if not chained:
        return loop
    A, E, G = loop.A.copy(), loop.E.copy(), loop.G.copy()
    for drive in chained:
        chain, first = delay_chain(drive.delay_states), loop.states.index(drive.chain[0])
        held, command = slice(first, first + chain.order), INPUTS.index(drive.name)
        b = chain.b[:, None] / drive.delay
        A[..., held, held] += chain.A / drive.delay
        A[..., held, :] -= b * loop.K[..., command, None, :]
        E[..., held, :] += b * loop.N[..., command, None, :]
        G[..., held, :] += b * loop.M[..., command, None, :]
    return replace(loop, A=A, E=E, G=G)
