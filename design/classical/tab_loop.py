"""The loop of a tab-only controller commanded by deflection: servo-tab, servo, filter, integrator (seed 4.2)."""

from __future__ import annotations

import numpy as np

from design.classical.synthesis import ClassicalController
from design.loop import Loop, SisoLoop
from model.actuators import Actuator
from model.arrays import FloatArray
from model.linear_model import LinearModel
from model.servo_tab import ServoTab

OUTPUTS = ("da", "dt", "da_rate", "dt_rate", "T_t", "T_a", "dt_command")
#: State indices; ``da_filtered`` follows when the rate is a filtered derivative, lag states come last.
DT, DT_RATE, DA, DA_RATE, INT_A, DA_FILTERED = range(6)


def tab_loop(
    model: LinearModel,
    servo: ServoTab,
    actuator: Actuator,
    controller: ClassicalController,
    gains: dict[str, FloatArray],
) -> Loop:
    """Assemble what is flown, over the grid.

    The aileron obeys the servo-tab model (2.3.22) and the tab its servo; the tab's torque is found by inverse
    dynamics from the coupled model's first row, lag states included. No actuator drives the aileron: its torque
    output is the trim torque, which something else must hold.

    Parameters
    ----------
    model, servo : coupled and servo-tab models over the grid
    actuator : the tab's; deflection servo of second order
    gains : (*G,) by name (`design.classical.synthesis.GAIN_UNITS`); nan where a point carries none

    Raises
    ------
    ValueError : the actuator has no second-order servo
    """
    w, z = actuator.servo_bandwidth, actuator.servo_damping_ratio
    if w is None or z is None:
        raise ValueError("a deflection command needs a servo with a bandwidth and a damping ratio")
    cutoff = controller.rate_filter if controller.kind == "negative_feedback" else None
    states = ("dt", "dt_rate", "da", "da_rate", "int_a", "da_filtered")[: 5 if cutoff is None else 6]
    grid, m = model.A.shape[:-2], len(states)
    lags = servo.states[2:]
    n = m + len(lags)
    aileron = np.array([DA, DA_RATE, *range(m, n)])
    A = np.zeros((*grid, n, n))
    A[..., DT, DT_RATE] = 1.0
    A[..., DT_RATE, DT], A[..., DT_RATE, DT_RATE] = -(w**2), -2.0 * z * w
    A[..., aileron[:, None], aileron] = servo.F
    A[..., aileron, DT : DT_RATE + 1] = servo.G
    A[..., INT_A, DA] = -1.0
    if cutoff is not None:
        A[..., DA_FILTERED, DA], A[..., DA_FILTERED, DA_FILTERED] = cutoff, -cutoff
    B = np.zeros((*grid, n, 1))
    B[..., DT_RATE, 0] = w**2
    E = np.zeros((*grid, n, 1))
    E[..., INT_A, 0] = 1.0
    sigma = np.sign(servo.dc_gain)
    stages = _stages(A, sigma[..., None] * B[..., 0], controller, gains, actuator.delay)
    K = (sigma[..., None] * sum(s.sign * s.gain[..., None] * _full(s.c, n) for s in stages))[..., None, :]
    return Loop(
        A, B, E, K, np.zeros((*grid, 1, 1)), *_outputs(model, n),
        states=(*states, *lags),
        inputs=("tab",), references=("r_a",), outputs=OUTPUTS, stages=stages, delay=(actuator.delay,),
    )  # fmt: skip


def _full(c: FloatArray, n: int) -> FloatArray:
    """Output row of an inner loop, which does not have the integrator, as a row over all n states."""
    if c.shape[-1] == n:
        return c
    return np.insert(c, INT_A, 0.0, axis=-1)


def _rate_row(controller: ClassicalController, n: int) -> FloatArray:
    """Row that yields da' as the controller knows it: measured, or ``w (da - da_filtered)``."""
    row = np.zeros(n)
    if controller.rate_filter is None:
        row[DA_RATE] = 1.0
    else:
        row[DA], row[DA_FILTERED] = controller.rate_filter, -controller.rate_filter
    return row


def _stages(
    A: FloatArray, b: FloatArray, controller: ClassicalController, gains: dict[str, FloatArray], delay: float
) -> tuple[SisoLoop, ...]:
    """The loops in the order of closure; the integrator joins with its own loop, the last."""
    grid, n = A.shape[:-2], A.shape[-1]
    position, integral = np.zeros(n), np.zeros(n)
    position[DA], integral[INT_A] = 1.0, -1.0
    order: tuple[tuple[str, FloatArray, int], ...]
    if controller.kind == "negative_feedback":
        order = (("K_d", _rate_row(controller, n), +1), ("K_p", position, +1))
    else:
        order = (("K_f", position, -1),)
    inner = [i for i in range(n) if i != INT_A]
    stages, A_now = [], A
    for name, row, sign in order:
        c = np.broadcast_to(row, (*grid, n))
        stages.append(
            SisoLoop(name, A_now[..., inner, :][..., inner], b[..., inner], c[..., inner], gains[name], sign, delay)
        )
        A_now = SisoLoop(name, A_now, b, c, gains[name], sign).closed()
    stages.append(SisoLoop("K_i", A_now, b, np.broadcast_to(integral, (*grid, n)), gains["K_i"], +1, delay))
    return tuple(stages)


def _outputs(model: LinearModel, n: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """C, F, D and offset of `OUTPUTS`: angles and rates, the tab's torque by inverse dynamics, the command."""
    grid = model.A.shape[:-2]
    o = len(OUTPUTS)
    C, F, D = np.zeros((*grid, o, n)), np.zeros((*grid, o, n)), np.zeros((*grid, o, 1))
    for row, state in enumerate((DA, DT, DA_RATE, DT_RATE)):
        C[..., row, state] = 1.0
    F[..., 4, DT_RATE], F[..., 4, DA_RATE] = model.inertia[..., 0, 0], model.inertia[..., 0, 1]
    C[..., 4, [DT, DT_RATE, DA, DA_RATE, *range(n - model.lag_torque.shape[-1], n)]] = -model.air_torque[..., 0, :]
    D[..., 6, 0] = 1.0
    dt0, dt_rate0, da0, da_rate0 = np.moveaxis(model.state_offset, -1, 0)[:4]
    torque_t, torque_a = np.moveaxis(model.input_offset, -1, 0)
    offset = np.stack([da0, dt0, da_rate0, dt_rate0, torque_t, torque_a, dt0], axis=-1)
    return C, F, D, offset
