"""What the engineer should know about a designed envelope."""

from __future__ import annotations

import numpy as np

from design.classical.controller import ClassicalController
from model.reduced_frequency import QUASI_STEADY_LIMIT
from schedules.analysis import EnvelopeWarning, PlantEnvelope
from schedules.designed import DesignedController
from schedules.study import Study


def envelope_warnings(
    study: Study, plant: PlantEnvelope, controllers: tuple[DesignedController, ...]
) -> tuple[EnvelopeWarning, ...]:
    """Warnings about the controllers; those about the plant are its own."""
    return _trim_warnings(study, plant) + _frequency_warnings(study, controllers)


def _trim_warnings(study: Study, plant: PlantEnvelope) -> tuple[EnvelopeWarning, ...]:
    """Tab-only controllers have no actuator for the torque that holds the aileron at its trim."""
    names = [c.name for c in study.controllers if isinstance(c, ClassicalController)]
    torque = np.abs(plant.trim.torque[..., 1])
    held = plant.outcomes.ok & (torque > 1e-9)
    if not names or not np.any(held):
        return ()
    detail = (
        f"the trim needs an aileron torque of up to {np.max(torque[held]):.4g} N m, which the tab-only controllers "
        f"({', '.join(names)}) have no actuator for; trim the tab with 'zero_aileron_torque' for a floating aileron"
    )
    return (EnvelopeWarning("aileron_torque_at_trim", detail, tuple(int(i) for i in np.flatnonzero(held))),)


def _frequency_warnings(study: Study, controllers: tuple[DesignedController, ...]) -> tuple[EnvelopeWarning, ...]:
    """Points at which a closed loop is too fast for a circulation that is taken as settled."""
    damping = study.aerodynamics.damping
    if damping == "unsteady" or not controllers:
        return ()
    largest = np.max(np.stack([np.nan_to_num(c.reduced_frequency, nan=0.0) for c in controllers]), axis=(1, 2))
    fast = np.any([c.reduced_frequency > QUASI_STEADY_LIMIT for c in controllers], axis=0)
    if not np.any(fast):
        return ()
    each = ", ".join(f"{c.request.name} {k:.3g}" for c, k in zip(controllers, largest, strict=True))
    detail = (
        f"reduced frequency k of the fastest closed-loop mode of the surfaces up to: {each}; damping '{damping}' takes "
        f"the circulation as settled, which holds below k = {QUASI_STEADY_LIMIT}; damping 'unsteady' has its lag"
    )
    return (EnvelopeWarning("reduced_frequency", detail, tuple(int(i) for i in np.flatnonzero(fast))),)
