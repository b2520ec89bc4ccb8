"""The plant at one grid point, on the wire: hinge moments, trim, linear model, poles, servo-tab."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.frequency.poles import poles
from model.hinge_moments.expansion import HingeMoments
from model.linear_model import LinearModel
from model.servo_tab import ServoTab
from model.trim import Trim
from schedules.analysis import PlantEnvelope
from service.presenters.grid import air_document, coordinates, grid_index
from service.presenters.hinge_moments import derivatives


def plant_document(plant: PlantEnvelope, point: int) -> dict[str, Any]:
    """Everything about the plant at a flat row-major point; null where the point is outside the model."""
    index = grid_index(plant.grid, point)
    document = {
        "index": point,
        "coordinates": coordinates(plant.grid, index),
        "outcome": plant.outcomes.codes[index],
        "reason": plant.outcomes.reasons[index],
        "air": air_document(plant.grid.condition.take(index)),
    }
    model = plant.model.take(index)
    if not np.all(np.isfinite(model.A)):
        return document | dict.fromkeys(("trim", "hinge_moments", "linear_model", "poles", "servo_tab"))
    return document | {
        "trim": trim_document(plant.trim.take(index)),
        "hinge_moments": hinge_moments_document(plant.hinge_moments.take(index)),
        "linear_model": model_document(model),
        "poles": poles(model.A),
        "servo_tab": servo_tab_document(plant.servo_tab.take(index)),
    }


def trim_document(trim: Trim) -> dict[str, Any]:
    """Angles held, and the torques that hold them."""
    return {
        "alpha_deg": np.rad2deg(trim.alpha),
        "aileron_deg": np.rad2deg(trim.state[2]),
        "tab_deg": np.rad2deg(trim.state[0]),
        "T_t_n_m": trim.torque[0],
        "T_a_n_m": trim.torque[1],
        "residual_n_m": trim.residual,
    }


def hinge_moments_document(moments: HingeMoments) -> dict[str, Any]:
    """Coefficients at the trim, and their derivatives there."""
    slopes = {name: value for name, value in derivatives(moments).items() if not name.endswith("_0")}
    values = {"C_Ht": float(moments.value[0]), "C_Ha": float(moments.value[1])}
    return {"values": values, "derivatives": slopes}


def model_document(model: LinearModel) -> dict[str, Any]:
    """Matrices in deviations from the trim, with the trim they deviate from and the names of rows and columns."""
    return {
        "A": model.A,
        "B": model.B,
        "C": model.C,
        "D": model.D,
        "states": list(model.states),
        "inputs": list(model.inputs),
        "outputs": list(model.outputs),
        "state_offset": model.state_offset,
        "input_offset": model.input_offset,
    }


def servo_tab_document(servo: ServoTab) -> dict[str, Any]:
    """The aileron driven by the tab alone: ``da/dt = numerator / denominator``, highest power first."""
    restoring = np.isfinite(servo.natural_frequency)
    return {
        "numerator": servo.numerator,
        "denominator": servo.denominator,
        "dc_gain": servo.dc_gain,
        "zero": servo.zero,
        "omega_n_rad_s": servo.natural_frequency,
        "damping_ratio": servo.damping_ratio,
        "reason": None if restoring else "the air does not drive the aileron back: it has no natural frequency",
    }
