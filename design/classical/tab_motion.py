"""The tab's angle, rate and acceleration in terms of the drive's states and of what it is commanded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.tab_drive import TabDrive
from model.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class LinearForm:
    """``row . x + now v + rate v'``, v being the command after its delay."""

    row: FloatArray
    now: float = 0.0
    rate: float = 0.0


@dataclass(frozen=True, eq=False)
class TabMotion:
    """Angle [rad], rate [rad/s] and acceleration [rad/s^2]; an ideal deflection has no finite acceleration."""

    angle: LinearForm
    rate: LinearForm
    acceleration: LinearForm | None


def drive_states(drive: TabDrive) -> tuple[str, ...]:
    """Names of the states of the drive: the tab's angle and rate, as far as they are states."""
    return ("dt", "dt_rate")[: drive.order]


def tab_motion(drive: TabDrive, states: tuple[str, ...]) -> TabMotion:
    """Motion of the tab over a loop's `states`, the first of which are those of the drive.

    Of first order, ``dt' = -a dt + b v`` and so ``dt'' = a^2 dt - a b v + b v'``.
    """
    row, b = np.zeros(len(states)), drive.numerator
    if drive.order == 0:
        return TabMotion(LinearForm(row, now=b), LinearForm(row, rate=b), None)
    angle = row.copy()
    angle[0] = 1.0
    if drive.order == 1:
        a = drive.denominator[1]
        return TabMotion(LinearForm(angle), LinearForm(-a * angle, b), LinearForm(a**2 * angle, -a * b, b))
    rate, acceleration = row.copy(), row.copy()
    rate[1] = 1.0
    acceleration[1], acceleration[0] = -drive.denominator[1], -drive.denominator[2]
    return TabMotion(LinearForm(angle), LinearForm(rate), LinearForm(acceleration, b))
