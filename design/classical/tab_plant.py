"""Servo-tab model, tab drive, rate filter and integrator in one state space, before any gain is closed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_drive import TabDrive
from design.classical.tab_motion import TabMotion, drive_states, tab_motion
from model.arrays import FloatArray
from model.servo_tab import ServoTab


@dataclass(frozen=True, eq=False)
class TabPlant:
    """``x' = A x + B v``, v the command of the tab's actuator after its delay, over the grid.

    States are those of the drive, ``da da_rate int_a``, ``da_filtered`` when the rate is a filtered derivative, and
    the lags of unsteady damping. With an ideal deflection those of the aileron's rate and of the lags are these less
    what the tab's rate moves them by at once, or A and B could not hold the model.

    Attributes
    ----------
    A (*G, n, n), B (*G, n, 1)
    rate_jump : (*G,) change of the aileron's rate by that of the tab, at once [1]; zero but for an ideal deflection
    sigma : (*G,) sign of the servo-tab's DC gain
    motion : the tab's, over these states
    states : names
    """

    A: FloatArray
    B: FloatArray
    rate_jump: FloatArray
    sigma: FloatArray
    motion: TabMotion
    states: tuple[str, ...]

    @classmethod
    def of(cls, servo: ServoTab, drive: TabDrive, controller: ClassicalController) -> TabPlant:
        """Plant of a controller; its gains have no part in it."""
        filtered = ("da_filtered",) if controller.filtered_rate else ()
        lags = servo.states[2:]
        states = (*drive_states(drive), "da", "da_rate", "int_a", *filtered, *lags)
        motion, at = tab_motion(drive, states), states.index
        grid, n, order = servo.F.shape[:-2], len(states), drive.order
        A, B = np.zeros((*grid, n, n)), np.zeros((*grid, n, 1))
        if order:
            A[..., np.arange(order - 1), np.arange(1, order)] = 1.0
            A[..., order - 1, :order] = -np.array(drive.denominator[:0:-1])
            B[..., order - 1, 0] = drive.numerator
        aileron = np.array([at(name) for name in servo.states])
        by_angle, by_rate = servo.G[..., 0], servo.G[..., 1]
        A[..., aileron[:, None], aileron] = servo.F
        A[..., aileron, :] += by_angle[..., None] * motion.angle.row + by_rate[..., None] * motion.rate.row
        # x' = F x + g v' is, for x - g v, a system that v alone drives.
        jump = by_rate * motion.rate.rate
        B[..., aileron, 0] = by_angle * motion.angle.now + by_rate * motion.rate.now + _times(servo.F, jump)
        A[..., at("int_a"), at("da")] = -1.0
        if controller.filtered_rate:
            filtered_at = at("da_filtered")
            A[..., filtered_at, at("da")] = controller.rate_filter
            A[..., filtered_at, filtered_at] = -np.asarray(controller.rate_filter)
        return cls(A, B, jump[..., 1], np.sign(servo.dc_gain), motion, states)

    @property
    def grid(self) -> tuple[int, ...]:
        """Shape of the grid."""
        return self.sigma.shape

    def row(self, name: str) -> FloatArray:
        """Row (n,) that picks a state."""
        row = np.zeros(len(self.states))
        row[self.states.index(name)] = 1.0
        return row


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
