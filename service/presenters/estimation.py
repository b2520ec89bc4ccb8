"""What it costs that not all states are measured, at one grid point, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.estimation.kalman_filter import KalmanFilter
from design.estimation.loss import EstimationLoss, LoopFigures, estimation_loss
from design.estimation.noise_model import NoiseModel
from design.loop import Loop
from design.lqr.controller import LqrController
from design.lqr.measurement import KalmanMeasurement
from design.lqr.synthesis import LqrDesign
from design.lqr.torque_loop import lqr_loop
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.state_feedback import noise_of
from service.presenters.margins import margins_document
from service.wire.signal_units import command_signals, signal_unit

#: Errors of the angles that only say that they are measured: figures of noise are not told of them.
_NO_NOISE = NoiseModel(0.0, 0.0, 1.0, 1.0)


def estimation_document(
    envelope: DesignedEnvelope, controller: DesignedController, index: tuple[int, ...]
) -> dict[str, Any] | None:
    """The filter, and the implemented loop beside the full-state feedback; None where every state is measured."""
    request, optimum, loop = controller.request, controller.optimum, controller.loop
    if not isinstance(request, LqrController) or request.measurement is None:
        return None
    assert isinstance(optimum, LqrDesign)
    assert isinstance(loop, Loop)
    noise = noise_of(request.measurement) if isinstance(request.measurement, KalmanMeasurement) else None
    full, reference = lqr_loop(envelope.plant.model.take(index), optimum.take(index)), envelope.study.reference
    step = reference.sizes(full.references)
    found = estimation_loss(full, loop.take(index), noise or _NO_NOISE, step, reference.duration)
    commands = command_signals(full.outputs, full.inputs)
    return {
        "kind": "kalman" if noise else "rate_filters",
        "filter": None if controller.observer is None else _filter(controller.observer.take(index)),
        "full_state": _figures(found, found.full, commands, noise is not None),
        "implemented": _figures(found, found.implemented, commands, noise is not None),
    }


def _filter(observer: KalmanFilter) -> dict[str, Any]:
    errors = []
    for name, rms in zip(observer.states, observer.error_rms, strict=True):
        # Lag states of the circulation are angles.
        unit, size = signal_unit("da" if name.startswith("lag_") else name, {})
        errors.append({"state": name, "unit": unit, "value": float(rms) * size})
    return {"poles": observer.poles, "residual": float(observer.residual), "error_rms": errors}


def _figures(loss: EstimationLoss, figures: LoopFigures, commands: dict[str, str], with_noise: bool) -> dict[str, Any]:
    actuators = loss.actuators
    return {
        "margins": {name: margins_document(m) for name, m in zip(actuators, figures.margins, strict=True)},
        "return_difference_min": {
            name: _number(value) for name, value in zip(actuators, figures.return_difference, strict=True)
        },
        "damping_ratio": float(figures.damping_ratio),
        "settling_time_s": _number(figures.settling_time),
        "disturbance_rms": _rms(loss, figures.disturbance_rms, commands) if with_noise else None,
        "noise_rms": _rms(loss, figures.noise_rms, commands) if with_noise else None,
    }


def _rms(loss: EstimationLoss, values: Any, commands: dict[str, str]) -> list[dict[str, Any]]:
    entries = []
    for name, value in zip(loss.signals, values, strict=True):
        unit, size = signal_unit(name, commands)
        entries.append({"signal": commands.get(name, name), "unit": unit, "value": _number(value * size)})
    return entries


def _number(value: Any) -> float | None:
    """A figure, or None where it is unlimited or does not exist."""
    return float(value) if np.isfinite(value) else None
