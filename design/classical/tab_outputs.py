"""What is seen of a tab-only loop: its outputs, the tab's torque by inverse dynamics, and what disturbs it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_motion import LinearForm
from design.classical.tab_plant import TabPlant
from model.arrays import FloatArray, Floats
from model.linear_model import LinearModel


@dataclass(frozen=True, eq=False)
class TabOutputs:
    """``y = C x + F x' + D v + H v' + offset``, totals with their trim values, over the grid."""

    C: FloatArray
    F: FloatArray
    D: FloatArray
    H: FloatArray
    offset: FloatArray
    names: tuple[str, ...]

    @classmethod
    def of(cls, model: LinearModel, plant: TabPlant, commands: dict[str, FloatArray]) -> TabOutputs:
        """Angles and rates, the torques, and the `commands`, rows (*G, n) over the states, by name."""
        names = ("da", "dt", "da_rate", "dt_rate", *(("T_t",) if plant.motion.acceleration else ()), "T_a", *commands)
        grid, n, o = plant.grid, len(plant.states), len(names)
        made = cls(
            np.zeros((*grid, o, n)), np.zeros((*grid, o, n)), np.zeros((*grid, o, 1)), np.zeros((*grid, o, 1)),
            np.zeros((*grid, o)), names,
        )  # fmt: skip
        trim = dict(zip(model.states, np.moveaxis(model.state_offset, -1, 0), strict=True))
        made._add("da", LinearForm(plant.row("da")), trim["da"])
        made._add("dt", plant.motion.angle, trim["dt"])
        made._add("da_rate", LinearForm(plant.row("da_rate")), trim["da_rate"])
        made.D[..., names.index("da_rate"), 0] = plant.rate_jump
        made._add("dt_rate", plant.motion.rate, trim["dt_rate"])
        if plant.motion.acceleration:
            made._add_torque(model, plant, plant.motion.acceleration)
        made.offset[..., names.index("T_a")] = model.input_offset[..., 1]
        for name, row in commands.items():
            made._add(name, LinearForm(row), trim["dt"] if name == "dt_command" else 0.0)
        return made

    def _add(self, name: str, form: LinearForm, trim: Floats, factor: Floats = 1.0) -> None:
        """Add a multiple of a form to an output."""
        at, size = self.names.index(name), np.asarray(factor)
        self.C[..., at, :] += size[..., None] * form.row
        self.D[..., at, 0] += size * form.now
        self.H[..., at, 0] += size * form.rate
        self.offset[..., at] += trim

    def _add_torque(self, model: LinearModel, plant: TabPlant, acceleration: LinearForm) -> None:
        """Torque of the tab's actuator: ``J_tt dt'' + J_ta da''`` less that of the air (2.3.7)."""
        self._add("T_t", acceleration, model.input_offset[..., 0], model.inertia[..., 0, 0])
        self.F[..., self.names.index("T_t"), plant.states.index("da_rate")] = model.inertia[..., 0, 1]
        air = model.air_torque[..., 0, :]
        for i, name in enumerate(model.states):
            of_tab = {"dt": plant.motion.angle, "dt_rate": plant.motion.rate}
            form = of_tab[name] if name in of_tab else LinearForm(plant.row(name))
            self._add("T_t", form, 0.0, -air[..., i])


def tab_disturbances(
    model: LinearModel, controller: ClassicalController, plant: TabPlant, K: FloatArray
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Names of what disturbs the loop, and G (*G, n, q) and M (*G, 1, q) by which it enters.

    A torque on the aileron, and noise on each angle or rate that is measured. A row of gains K (*G, n) stands on
    measured states only, so noise enters the command as the state itself does.
    """
    measured = ("da", *(("da_rate",) if controller.measured_rate else ()))
    if controller.tab_command == "rate":
        measured = (*measured, "dt")
    names = ("T_a_disturbance", *(f"{state}_noise" for state in measured))
    at = plant.states.index
    G, M = (np.zeros((*plant.grid, rows, len(names))) for rows in (len(plant.states), 1))
    G[..., at("da_rate"), 0] = 1.0 / model.inertia[..., 1, 1]
    for column, state in enumerate(measured, start=1):
        M[..., 0, column] = -K[..., at(state)]
    for reader in {"int_a", "da_filtered"} & set(plant.states):
        G[..., at(reader), 1] = plant.A[..., at(reader), at("da")]
    return names, G, M
