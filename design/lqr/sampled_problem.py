"""The tracking problem as the code meets it: plant and cost from sample to sample, commands under way, coded integrals.

The cost is the integral over each sample of the same weights as in continuous time (`design.lqr.sampled_cost`). The
code cannot integrate the error, it only sees samples of it, so in the plant from sample to sample the integrals are
those of the code, by the trapezoidal rule ::

    int_(k+1) = int_k + T/2 (e_k + e_(k+1)),    e = r - angle

Within a sample the cost takes the integral to go on from the coded one exactly; the difference is of the order T^3 a
sample. Where the code settles its error is zero, whatever the plant is, which holds for no integral that the code
predicts by a model.

The rectangular rule, ``w_(k+1) = w_k + T e_k``, is the same thing in other states: ``int = w + T/2 e``. In w the same
law has the gains ``K_int`` on w, ``K_angle - T/2 K_int`` on the angle, and the feed-forward ``N - T/2 K_int``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.lqr.coded_loop import command_delays
from design.lqr.cost import Cost
from design.lqr.sampled_cost import SampledRegulator, sampled_regulator
from design.lqr.structures import FOLLOWED, INTEGRALS, Structure
from design.lqr.tracking import SteadyState, TrackingPlant
from design.sampling import Sampling
from model.arrays import FloatArray, GridArrays
from model.linear_model import INPUTS


@dataclass(frozen=True, eq=False)
class SampledProblem(GridArrays):
    """Minimise ``sum( x'Qx + u'Ru + 2x'Nu )`` for ``x+ = A x + B u``.

    Attributes
    ----------
    A (*G, n, n), B (*G, n, 2), Q (*G, n, n), R (*G, 2, 2), N (*G, n, 2) : over `states`; nan where they are not finite
    states : those of the plant, then the commands of samples ago, ``T_t_1 T_t_2 .. T_a_1 ..`` [N m from trim]
    held : input and age in samples of each of these commands
    """

    A: FloatArray
    B: FloatArray
    Q: FloatArray
    R: FloatArray
    N: FloatArray
    states: tuple[str, ...]
    held: tuple[tuple[int, int], ...]


def held_names(held: tuple[tuple[int, int], ...]) -> tuple[str, ...]:
    """Names of commands by input and age in samples: ``T_t_1`` is the tab's torque that was commanded last."""
    return tuple(f"{INPUTS[i]}_{age}" for i, age in held)


def sampled_problem(plant: TrackingPlant, cost: Cost, sampling: Sampling) -> SampledProblem:
    """The problem over the grid of the plant.

    Parameters
    ----------
    plant : of a structure without states for delays: they are exact here, fractions of a sample included
    cost : of that plant in continuous time, R > 0 and Q - N R^-1 N' >= 0
    sampling : sample time, and the delay of the computation, which adds to those of the actuators

    Raises
    ------
    ValueError : sample time or delay are out of range
    """
    delay = command_delays(tuple(drive.delay for drive in plant.structure.drives), sampling)
    sampled = sampled_regulator(plant.A, plant.B, cost.Q, cost.R, cost.N, sampling.time, delay)
    n = len(plant.states)
    order = sorted(range(len(sampled.held)), key=lambda k: sampled.held[k])
    states = [*range(n), *(n + k for k in order)]
    held = tuple(sampled.held[k] for k in order)
    A, B = _with_coded_integrals(sampled, plant, sampling.time)
    return SampledProblem(
        A=A[..., states, :][..., states],
        B=B[..., states, :],
        Q=sampled.Q[..., states, :][..., states],
        R=sampled.R,
        N=sampled.N[..., states, :],
        states=(*plant.states, *held_names(held)),
        held=held,
    )


def _with_coded_integrals(
    sampled: SampledRegulator, plant: TrackingPlant, sample_time: float
) -> tuple[FloatArray, FloatArray]:
    A, B = sampled.A.copy(), sampled.B.copy()
    for reference in plant.structure.references:
        integral, angle = plant.states.index(INTEGRALS[reference]), plant.states.index(FOLLOWED[reference])
        A[..., integral, :] = -0.5 * sample_time * A[..., angle, :]
        A[..., integral, angle] -= 0.5 * sample_time
        A[..., integral, integral] = 1.0
        B[..., integral, :] = -0.5 * sample_time * B[..., angle, :]
    return A, B


def held_at_rest(rest: SteadyState, held: tuple[tuple[int, int], ...]) -> SteadyState:
    """The rest with the commands under way as states: each is the torque that holds."""
    N_x = np.concatenate([rest.N_x, rest.N_u[..., [i for i, _ in held], :]], axis=-2)
    return replace(rest, N_x=N_x)


def without_delay_states(structure: Structure) -> Structure:
    """The structure without approximants of delays."""
    return replace(structure, delay_states=0)
