"""State feedback of estimates: the loop with a Kalman filter in it.

::

    u = -K_p z - K_c c + N r + M w          z estimates of the plant's states, c the controller's own states
    z' = A_p z + B_p v_z + L (y - C z)      y = [dt, da] measured, with their noise;  v_z what is known of v

The integrals are those of the measured angles, as before, and known. The commands are known to the controller, also
where the loop is opened at an actuator: margins are those against changes between the commands and the plant.

An actuator that is late gets ``v = u(t - delay)``, and so must the filter's model of it: the command reaches it through
an approximant of the delay (`design.delay.pade`), the one that the controller runs already where the gains were
designed with `delay_states`, else one of its own. Without delays the poles are those of ``A - B K`` and those of
``A_p - L C`` (separation); with delays they are so as far as the approximants go, and the loop must be judged.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.delay.characteristic import SHORTEST
from design.delay.pade import delay_chain
from design.estimation.kalman_filter import KalmanFilter
from design.estimation.readings import (
    NOISES,
    RATES,
    delay_states,
    is_controllers,
    left_disturbances,
    refuse_unless_full_state,
)
from design.loop import Loop
from design.padded import padded
from model.arrays import FloatArray

#: States of a model of a delay that the gains know nothing of: right to 1e-6 up to ``omega delay`` of 1, 4e-3 up to 3.
DELAY_STATES = 4


def with_kalman_filter(loop: Loop, estimator: KalmanFilter) -> Loop:
    """The loop whose controller reads estimates instead of the plant's states.

    New states stand behind the others: models of delays that the loop does not have, ``tab_delay_1 ..``, then the
    estimates ``est_dt est_dt_rate est_da est_da_rate ..``, one for each state of the plant. Noise enters by the two
    angles only, and no command takes it at once. References reach the filter with the commands, so that a step of them
    makes no error of the estimate.

    Parameters
    ----------
    loop : full-state feedback, over any grid
    estimator : the filter of this loop (`design.estimation.kalman_filter`); points where it has none have nan

    Raises
    ------
    ValueError : the loop is not a full-state feedback, or the filter is of another plant
    """
    refuse_unless_full_state(loop)
    plant = tuple(name for name in loop.states if not is_controllers(name))
    if plant != estimator.states or estimator.L.shape[:-2] != loop.A.shape[:-2]:
        raise ValueError(f"the filter estimates {', '.join(estimator.states)} over {estimator.L.shape[:-2]}")
    known = estimator.outcomes.ok
    if known.all():
        return _observed(loop, estimator)
    return _observed(loop.take(known), estimator.take(known)).spread(known)


def _observed(loop: Loop, estimator: KalmanFilter) -> Loop:
    """`with_kalman_filter` of a loop that is finite everywhere."""
    loop = _with_delay_models(loop)
    states, names = (*loop.states, *(f"est_{name}" for name in estimator.states)), left_disturbances(loop)
    n, size, p, q = len(loop.states), len(states), len(loop.references), len(names)
    read, noises = _readings(loop, estimator, states), [names.index(name) for name in NOISES]
    kept = [loop.disturbances.index(name) for name in names]
    A, E, G = padded(loop.A, size, size), padded(loop.E, size, p), padded(loop.G[..., kept], size, q)
    M = loop.M[..., kept]
    # Noise reaches the commands, and the models of delays that run on them, through the estimates alone.
    models = [i for actuator in loop.inputs for i in delay_states(loop, actuator)]
    A[..., models, :] = loop.A[..., models, :] @ read
    G[..., np.ix_(models, noises)[0], np.ix_(models, noises)[1]] = 0.0
    M[..., noises] = 0.0
    K = loop.K @ read
    heard = _heard(loop, np.concatenate([-K, loop.N, M], axis=-1))
    A[..., n:, :], E[..., n:, :], G[..., n:, :] = np.split(_driven(loop, estimator, heard), [size, size + p], axis=-1)
    _correct(A, G, estimator, states, noises)
    outputs, inputs = len(loop.outputs), len(loop.inputs)
    observed = replace(
        loop, A=A, B=padded(loop.B, size, inputs), E=E, G=G, K=K, M=M, C=padded(loop.C, outputs, size),
        F=padded(loop.F, outputs, size), states=states, disturbances=names,
    )  # fmt: skip
    return replace(observed, stages=tuple(observed.cut(name) for name in loop.inputs))


def _with_delay_models(loop: Loop) -> Loop:
    """The loop whose controller runs a model of each delay on its command, also where the gains do not read it."""
    for i, actuator in enumerate(loop.inputs):
        if loop.delay[i] > SHORTEST and not delay_states(loop, actuator):
            chain, n = delay_chain(DELAY_STATES), len(loop.states)
            size, drive = n + chain.order, chain.b[:, None] / loop.delay[i]
            A, E, G = (padded(matrix, size, matrix.shape[-1]) for matrix in (loop.A, loop.E, loop.G))
            A = padded(A, size, size)
            A[..., n:, n:] = chain.A / loop.delay[i]
            A[..., n:, :n] = -drive * loop.K[..., i, None, :]
            E[..., n:, :], G[..., n:, :] = drive * loop.N[..., i, None, :], drive * loop.M[..., i, None, :]
            loop = replace(
                loop, A=A, B=padded(loop.B, size, loop.B.shape[-1]), E=E, G=G,
                K=padded(loop.K, loop.K.shape[-2], size), C=padded(loop.C, loop.C.shape[-2], size),
                F=padded(loop.F, loop.F.shape[-2], size),
                states=(*loop.states, *(f"{actuator}_delay_{k + 1}" for k in range(chain.order))),
            )  # fmt: skip
    return loop


def _readings(loop: Loop, estimator: KalmanFilter, states: tuple[str, ...]) -> FloatArray:
    """What the commands read for the states of the loop, (n, n'): estimates for the plant's."""
    read = np.zeros((len(loop.states), len(states)))
    for row, name in enumerate(loop.states):
        read[row, states.index(f"est_{name}" if name in estimator.states else name)] = 1.0
    return read


def _heard(loop: Loop, command: FloatArray) -> FloatArray:
    """What the filter takes for v, from the commands u; both are rows over ``[x', r, w]``, (*G, m, n' + p + q')."""
    heard = command.copy()
    for i, actuator in enumerate(loop.inputs):
        model = delay_states(loop, actuator)
        if model:
            heard[..., i, :] = 0.0
            heard[..., i, model] = delay_chain(len(model)).c
    return heard


def _driven(loop: Loop, estimator: KalmanFilter, heard: FloatArray) -> FloatArray:
    """``A_p z + B_p v_z``, rows over ``[x', r, w]``, (*G, k, n' + p + q')."""
    plant, n = [loop.states.index(name) for name in estimator.states], len(loop.states)
    driven: FloatArray = loop.B[..., plant, :] @ heard
    driven[..., n : n + len(plant)] += loop.A[..., plant, :][..., plant]
    return driven


def _correct(A: FloatArray, G: FloatArray, estimator: KalmanFilter, states: tuple[str, ...], noises: list[int]) -> None:
    """Add ``L (y - C z)`` to the rates of the estimates, the last rows of A (*G, n', n') and G (*G, n', q')."""
    k = len(estimator.states)
    for i, angle in enumerate(RATES):
        A[..., -k:, states.index(angle)] += estimator.L[..., i]
        A[..., -k:, states.index(f"est_{angle}")] -= estimator.L[..., i]
        G[..., -k:, noises[i]] += estimator.L[..., i]
