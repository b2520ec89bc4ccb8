"""How much aileron torque the tab saves: the loop as it flies, beside the same motion with the tab held (seed 5.7)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.actuator_sizing.tab_held import TAB_HELD, with_tab_held
from design.loop import Loop
from design.manoeuvre import Manoeuvre
from design.response.manoeuvre_response import manoeuvre_response
from model.arrays import FloatArray, GridArrays
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController


@dataclass(frozen=True, eq=False)
class TabSaving(GridArrays):
    """Peaks of the aileron's torque over a manoeuvre, trim included, each (*G,) [N m]; nan where there is no design.

    Attributes
    ----------
    peak_torque : as the loop flies: what the aileron's actuator gives. A tab-only controller leaves the trim torque
    tab_held : what it would have to give for the same motion of the aileron, the tab held at its trim angle
    """

    peak_torque: FloatArray
    tab_held: FloatArray

    @property
    def saved(self) -> FloatArray:
        """(*G,) part of the torque that the tab saves [-]; negative where it costs more than it gives."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.tab_held > 0.0, 1.0 - self.peak_torque / self.tab_held, np.nan)

    @property
    def saved_of_the_envelope(self) -> float | None:
        """Part that the actuator may be smaller by: of the largest torque over the grid [-]; None without a design."""
        held = self.tab_held[np.isfinite(self.tab_held)]
        if held.size == 0 or not held.max() > 0.0:
            return None
        return float(1.0 - np.nanmax(self.peak_torque) / held.max())


def tab_saving(plant: PlantEnvelope, designed: DesignedController, manoeuvre: Manoeuvre, duration: float) -> TabSaving:
    """Aileron torque of a manoeuvre, as flown and with the tab held.

    Parameters
    ----------
    plant : of which the controller is one
    designed : a controller with a loop in continuous time
    manoeuvre : of its references
    duration : how long it is followed [s]

    Raises
    ------
    ValueError : a sampled state feedback
    """
    if not isinstance(designed.loop, Loop):
        raise ValueError(
            f"controller {designed.request.name} runs as code: its torques are not known in continuous time"
        )
    ok = designed.outcomes.ok
    model = plant.model.take(ok)
    loop = with_tab_held(designed.loop.take(ok), model)
    response = manoeuvre_response(loop, manoeuvre, duration)
    own = np.abs(model.input_offset[..., 1])
    if "T_a" in loop.outputs:
        own = response.peaks[..., response.index("T_a")]
    return TabSaving(own, response.peaks[..., response.index(TAB_HELD)]).spread(ok)
