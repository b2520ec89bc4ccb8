"""From the wire to manoeuvres and simulations of them: SI and radians."""

from __future__ import annotations

from math import radians, tau

import numpy as np

from design import manoeuvre as flown
from design.manoeuvre import Manoeuvre
from design.simulation.request import Freeplay, Friction, SimulationRequest
from model.arrays import FloatArray
from schedules.requirements import limits_by_name
from schedules.study import Study
from service.schemas import manoeuvres
from service.schemas.requirement_requests import Nonlinear

#: Reference of a loop -> the surface whose fields on the wire it takes.
_SURFACES = {"r_a": "aileron", "r_t": "tab"}


def manoeuvre_of(wire: manoeuvres.Manoeuvre, references: tuple[str, ...]) -> Manoeuvre:
    """The manoeuvre of a loop's references, in their order; of a regulator, which has none, nothing moves."""
    if isinstance(wire, manoeuvres.Recorded):
        series = [_series(wire, name) for name in references]
        return flown.recorded(np.array(wire.times_s), np.stack(series, axis=-1) if series else _nothing(wire))
    if isinstance(wire, manoeuvres.Ramp):
        return flown.ramp(_sizes(wire, references, "deg_s"))
    size = _sizes(wire, references, "deg")
    if isinstance(wire, manoeuvres.Sine):
        return flown.sine(size, tau * wire.frequency_hz)
    if isinstance(wire, manoeuvres.Doublet):
        return flown.doublet(size, wire.length_s)
    if wire.rate_limit_deg_s is None:
        return flown.step(size)
    return flown.rate_limited_step(size, radians(wire.rate_limit_deg_s))


def simulation_of(wire: Nonlinear, study: Study, duration: float, samples: int) -> SimulationRequest:
    """A simulation, with the limits of the study's actuators unless it is to be without."""
    hinges = {"tab": wire.friction.tab, "aileron": wire.friction.aileron}
    friction = {
        name: Friction(hinge.static_n_m, hinge.kinetic_n_m) for name, hinge in hinges.items() if hinge is not None
    }
    link = wire.freeplay
    freeplay = None if link is None else Freeplay(radians(link.gap_deg), link.stiffness, link.damping)
    limits = limits_by_name(study) if wire.limits else {}
    return SimulationRequest(
        duration, samples, wire.tolerance, limits=limits, friction=friction, freeplay=freeplay,
        anti_windup=wire.anti_windup_1_s,
    )  # fmt: skip


def _sizes(wire: manoeuvres.Manoeuvre, references: tuple[str, ...], unit: str) -> FloatArray:
    return np.array([radians(getattr(wire, f"{_SURFACES[name]}_{unit}")) for name in references])


def _series(wire: manoeuvres.Recorded, reference: str) -> FloatArray:
    series = wire.aileron_deg if reference == "r_a" else wire.tab_deg
    return np.zeros(len(wire.times_s)) if series is None else np.deg2rad(series)


def _nothing(wire: manoeuvres.Recorded) -> FloatArray:
    return np.zeros((len(wire.times_s), 0))
