"""What it costs that only the angles are measured: the implemented loop beside the full-state feedback.

Kalman's inequality holds for an optimal full-state feedback: each of its loops, opened at one actuator, keeps
``|1 + L| >= 1`` at every frequency (with weights that do not mix the torques). No loop that works out its states from
the angles is bound by it (Doyle 1978): `LoopFigures.return_difference` shows how far it falls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.damping import least_damping_ratio_delayed
from design.delay.step_response import delayed_step_response
from design.delay.with_pade import without_delay
from design.disturbance.closed_system import closed_system
from design.disturbance.h2 import h2_norm
from design.estimation.cut_margins import margins_of_cuts
from design.estimation.noise_model import NoiseModel
from design.estimation.readings import NOISES, RATES, TORQUES, known_points
from design.frequency.margins import Margins
from design.loop import Loop
from design.response.step_metrics import step_metrics
from model.arrays import BoolArray, FloatArray, Floats, GridArrays


@dataclass(frozen=True, eq=False)
class LoopFigures(GridArrays):
    """Figures of one loop over the grid.

    Attributes
    ----------
    margins : of each cut at an actuator input, order as `EstimationLoss.actuators`; nan where the loop is not stable
    return_difference : (*G, m) smallest ``|1 + L|`` over frequency of each cut, at most 1; nan likewise
    damping_ratio : (*G,) smallest of the closed-loop poles; negative where the loop is not stable
    settling_time : (*G,) of the aileron after the reference step [s]; nan where it does not settle, or has no reference
    disturbance_rms : (*G, o) root mean square of each of `EstimationLoss.signals` under the torques of the noise model
    noise_rms : (*G, o) the same under its errors of the measured angles; inf where a signal takes them at once, as the
        commands do unless a filter of estimates lies between. Rate sensors of a full-state feedback make no noise here
    """

    margins: tuple[Margins, ...]
    return_difference: FloatArray
    damping_ratio: FloatArray
    settling_time: FloatArray
    disturbance_rms: FloatArray
    noise_rms: FloatArray


@dataclass(frozen=True, eq=False)
class EstimationLoss(GridArrays):
    """The same figures of the full-state feedback and of what is implemented, at the points that carry both.

    Attributes
    ----------
    full, implemented : (*G) figures; nan where either loop is not finite
    actuators : names of the cuts
    signals : of the root mean squares: angles [rad] ``dt da``, then the commands by the name of the actuator
    """

    full: LoopFigures
    implemented: LoopFigures
    actuators: tuple[str, ...]
    signals: tuple[str, ...]


def estimation_loss(
    full: Loop, implemented: Loop, noise: NoiseModel, reference: FloatArray, duration: float
) -> EstimationLoss:
    """Figures of both loops, judged by the same means.

    Parameters
    ----------
    full, implemented : over the same grid; points where one of them carries nan have nan
    noise : intensities of the torques and of the errors of the measured angles; the rest of it is what a filter
        believes, and does not count here
    reference : (p,) sizes of the step in each reference [rad]
    duration : how long the step is followed [s]

    Raises
    ------
    ValueError : different grids or actuators
    """
    if full.A.shape[:-2] != implemented.A.shape[:-2] or full.inputs != implemented.inputs:
        raise ValueError("the two loops must have the same grid and the same actuators")
    known = known_points(full) & known_points(implemented)
    signals = (*RATES, *full.inputs)
    found = [_figures(loop.take(known), noise, known, reference, duration) for loop in (full, implemented)]
    return EstimationLoss(found[0].spread(known), found[1].spread(known), full.inputs, signals)


def _figures(loop: Loop, noise: NoiseModel, known: BoolArray, reference: FloatArray, duration: float) -> LoopFigures:
    """Figures of a loop that is finite everywhere, over the points of the mask `known` (*G,)."""
    margins = margins_of_cuts(loop)
    response = delayed_step_response(loop, reference, duration)
    norm = h2_norm(closed_system(loop, loop.disturbances, (*RATES, *loop.inputs)))
    torques = dict(zip(TORQUES, noise.torques, strict=True))
    angles = dict(zip(NOISES, noise.angles, strict=True))
    return LoopFigures(
        margins=margins,
        return_difference=1.0 / np.stack([cut.sensitivity_peak for cut in margins], axis=-1),
        damping_ratio=least_damping_ratio_delayed(loop),
        settling_time=step_metrics(without_delay(loop), response, "da", reference).settling_time,
        disturbance_rms=norm.rms(_intensities(loop, torques, known)),
        noise_rms=norm.rms(_intensities(loop, angles, known)),
    )


def _intensities(loop: Loop, given: dict[str, Floats], known: BoolArray) -> FloatArray:
    """(N, q) intensities of the loop's disturbances at the points of the mask; 0 of those that are not given."""
    columns = [np.broadcast_to(np.asarray(given.get(name, 0.0)), known.shape)[known] for name in loop.disturbances]
    return np.stack(columns, axis=-1)
