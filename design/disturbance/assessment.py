"""What disturbances and sensor noise do to a loop, in figures: peak gains, H2 norms, and how steps are rejected."""

from __future__ import annotations

from dataclasses import dataclass

from design.disturbance.closed_system import closed_system
from design.disturbance.h2 import H2Norm, h2_norm
from design.disturbance.h_infinity import pair_peaks
from design.disturbance.level_set import Peak
from design.disturbance.rejection import Rejection, rejection
from design.loop import Loop
from model.arrays import GridArrays

#: What is looked at besides the commands.
OUTPUTS = ("da", "dt", "dt_rate")


@dataclass(frozen=True, eq=False)
class Disturbance(GridArrays):
    """Figures of every pair of disturbance and output, (*G, o, q); nan at points without a stable design.

    Outputs are in [rad] and [rad/s], commands in the unit of their actuator; disturbances are torques [N m] or noise on
    a measured angle [rad] or rate [rad/s]. A noise that has no way in is not among the loop's disturbances.

    Attributes
    ----------
    peak : largest gain over all frequencies and where it is [rad/s] (`design.disturbance.h_infinity`)
    h2 : root mean squares under white noise (`design.disturbance.h2`); inf from noise to a command whose gain on that
        measurement is not filtered
    rejection : of steps of the torques, nan for noise (`design.disturbance.rejection`)
    disturbances, outputs : names
    """

    peak: Peak
    h2: H2Norm
    rejection: Rejection
    disturbances: tuple[str, ...]
    outputs: tuple[str, ...]


def assess_disturbances(loop: Loop, outputs: tuple[str, ...] = OUTPUTS) -> Disturbance:
    """Figures of every disturbance of a loop, for some outputs and all commands.

    Gains and norms have the transport delays exactly, rejections have approximants of them.

    Parameters
    ----------
    loop : over any grid; points that carry nan have nan
    outputs : names of ``loop.outputs``; the commands, ``loop.inputs``, follow them

    Raises
    ------
    ValueError : the loop has no such output, or a delay is negative
    """
    names = (*outputs, *loop.inputs)
    system = closed_system(loop, loop.disturbances, names)
    torques = tuple(name for name in loop.disturbances if name.endswith("_disturbance"))
    return Disturbance(
        peak=pair_peaks(system),
        h2=h2_norm(system),
        rejection=rejection(system, inputs=torques),
        disturbances=loop.disturbances,
        outputs=names,
    )
