"""The loop of a tab-only controller: servo-tab, tab drive, filter, integrator and gains (seed 4.1, 4.2)."""

from __future__ import annotations

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_drive import tab_drive
from design.classical.tab_outputs import TabOutputs, tab_disturbances
from design.classical.tab_plant import TabPlant
from design.loop import Loop, SisoLoop
from model.actuators import Actuator
from model.arrays import FloatArray
from model.linear_model import LinearModel
from model.servo_tab import ServoTab

#: Sign of the feedback by each gain: +1 negative, -1 positive (the 0-degree locus).
_SIGNS = {"K_theta": +1, "K_d": +1, "K_p": +1, "K_f": -1, "K_i": +1}


def tab_loop(
    model: LinearModel,
    servo: ServoTab,
    actuator: Actuator,
    controller: ClassicalController,
    gains: dict[str, FloatArray],
) -> Loop:
    """Assemble what is flown, over the grid.

    The aileron obeys the servo-tab model (2.3.22) and the tab its drive; the tab's torque is found by inverse
    dynamics from the coupled model's first row, lag states included. No actuator drives the aileron: its torque
    output is the trim torque, which something else must hold. The one input, ``tab``, is what the actuator is
    commanded: the tab's deflection [rad], or its rate [rad/s] when the controller commands that. With an ideal
    deflection the tab's acceleration is not finite, and there is no output ``T_t``.

    Parameters
    ----------
    model, servo : coupled and servo-tab models over the grid
    actuator : the tab's
    gains : (*G,) by name (`ClassicalController.gain_units`); nan where a point carries none

    Raises
    ------
    ValueError : an ideal deflection together with a measured rate, which a rate of the tab enters at once
    """
    drive = tab_drive(actuator, controller.tab_command)
    plant = TabPlant.of(servo, drive, controller)
    if controller.measured_rate and np.any(np.abs(plant.rate_jump) > 0.0):
        raise ValueError(
            "an ideal tab deflection and a measured aileron rate close a loop that has no dynamics: "
            "give the servo a bandwidth or the rate a filter"
        )
    stages = _stages(plant, controller, gains, drive.delay)
    outer = sum(s.sign * s.gain[..., None] * _with_integral(s.c, plant) for s in stages if s.name != "K_theta")
    command = -plant.sigma[..., None] * outer
    commands = {"dt_command": command}
    K = -command
    if controller.tab_command == "rate":
        K = gains["K_theta"][..., None] * (plant.motion.angle.row - command)
        commands["dt_rate_command"] = -K
    seen = TabOutputs.of(model, plant, commands)
    disturbances, G, M = tab_disturbances(model, controller, plant, K)
    E = np.broadcast_to(plant.row("int_a")[:, None], plant.B.shape)
    return Loop(
        A=plant.A, B=plant.B, E=E, G=G, K=K[..., None, :], N=np.zeros((*plant.grid, 1, 1)), M=M,
        C=seen.C, F=seen.F, D=seen.D, H=seen.H, offset=seen.offset,
        states=plant.states, inputs=("tab",), references=("r_a",), outputs=seen.names, disturbances=disturbances,
        stages=stages, delay=(drive.delay,),
    )  # fmt: skip


def _with_integral(c: FloatArray, plant: TabPlant) -> FloatArray:
    """Output row of an inner loop, which does not have the integrator, as a row over all states."""
    return c if c.shape[-1] == len(plant.states) else np.insert(c, plant.states.index("int_a"), 0.0, axis=-1)


def _stages(
    plant: TabPlant, controller: ClassicalController, gains: dict[str, FloatArray], delay: float
) -> tuple[SisoLoop, ...]:
    """The loops in the order of closure; the integrator joins with its own loop, the last."""
    row, n = plant.row, len(plant.states)
    rate = row("da_rate")
    if controller.rate_filter is not None and controller.filtered_rate:
        rate = controller.rate_filter * (row("da") - row("da_filtered"))
    rows = {"K_theta": plant.motion.angle.row, "K_d": rate, "K_p": row("da"), "K_f": row("da"), "K_i": -row("int_a")}
    without = [i for i in range(n) if i != plant.states.index("int_a")]
    command = plant.B[..., 0]
    A, deflection = plant.A, plant.sigma[..., None] * command
    stages = []
    for name in controller.gain_units:
        # The inner tab loop acts on the rate itself; the loops around it command deflections, through its gain.
        on = command if name == "K_theta" else deflection
        whole = SisoLoop(name, A, on, np.broadcast_to(rows[name], (*plant.grid, n)), gains[name], _SIGNS[name], delay)
        inner = slice(None) if name == "K_i" else without
        part = whole.A[..., inner, :][..., inner], whole.b[..., inner], whole.c[..., inner]
        stages.append(SisoLoop(name, *part, whole.gain, whole.sign, delay))
        A = whole.closed()
        if name == "K_theta":
            deflection = gains[name][..., None] * deflection
    return tuple(stages)
