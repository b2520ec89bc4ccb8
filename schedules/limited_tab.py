"""What the aileron's actuator must give when the tab may not go as far as it likes (seed Fig 5.19)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.simulation.request import SimulationRequest
from design.simulation.response import SimulationOutcome
from model.actuators import ActuatorLimits
from model.arrays import FloatArray, ObjectArray
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.requirements import simulated
from schedules.study import Reference

#: Of the integration: a curve is read off a plot.
TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class LimitedTab:
    """Figures of the design's reference, simulated with the tab's deflection limited, each (*G, L) over L limits.

    nan where there is no design, or the simulation did not reach its end.

    Attributes
    ----------
    limits : (L,) of the tab's total deflection [rad]
    aileron_peak_torque, aileron_rms_torque : trim included [N m]; of a tab-only controller the trim's
    tab_peak_deflection : of the total deflection [rad]
    tab_time_at_limit : how long the tab is at its limit [s]
    final_error : how far the aileron is from its reference in the end [rad]
    codes, reasons : what became of the simulation
    """

    limits: FloatArray
    aileron_peak_torque: FloatArray
    aileron_rms_torque: FloatArray
    tab_peak_deflection: FloatArray
    tab_time_at_limit: FloatArray
    final_error: FloatArray
    codes: ObjectArray
    reasons: ObjectArray


def limited_tab_request(reference: Reference, limit: float) -> SimulationRequest:
    """The simulation of one limit [rad] of the tab's deflection, and no other."""
    return SimulationRequest(reference.duration, tolerance=TOLERANCE, limits={"tab": ActuatorLimits(deflection=limit)})


def limited_tab(
    plant: PlantEnvelope, designed: DesignedController, reference: Reference, limits: FloatArray
) -> LimitedTab:
    """Simulate the reference with each limit of the tab's deflection (L,) [rad].

    Raises
    ------
    ValueError : a sampled state feedback, a controller that follows no reference, or what the simulation refuses
    """
    references = designed.loop.references
    if "r_a" not in references:
        raise ValueError(f"controller {designed.request.name} follows no reference of the aileron")
    manoeuvre, grid = reference.manoeuvre(references), designed.outcomes.ok.shape
    figures = np.full((5, *grid, len(limits)), np.nan)
    codes, reasons = np.full((2, *grid, len(limits)), None, dtype=object)
    for k, limit in enumerate(limits.tolist()):
        found = simulated(plant, designed, manoeuvre, limited_tab_request(reference, limit))
        completed = np.asarray(found.codes == SimulationOutcome.COMPLETED)
        demand = dict(zip(designed.loop.inputs, found.demand, strict=True))
        trim, aileron = np.abs(plant.model.input_offset[..., 1]), demand.get("aileron")
        peak, rms = (trim, trim) if aileron is None else (aileron.peak_torque, aileron.rms_torque)
        change = found.output("da")[..., -1] - plant.model.state_offset[..., 2]
        error = found.reference[..., -1, references.index("r_a")] - change
        values = (peak, rms, demand["tab"].peak_deflection, found.time_at_limit[..., 0, 0], error)
        for row, value in enumerate(values):
            figures[row, ..., k] = np.where(completed, value, np.nan)
        codes[..., k], reasons[..., k] = found.codes, found.reasons
    peaks, means, deflections, times, errors = figures
    return LimitedTab(limits, peaks, means, deflections, times, errors, codes, reasons)
