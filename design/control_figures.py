"""What `design.python_control` is told of a controller that is code, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass

from design.sampling import Sampling
from model.arrays import FloatArray


@dataclass(frozen=True)
class ControlMargins:
    """Margins of the loop cut at one actuator input, by `control.stability_margins`.

    Attributes
    ----------
    gain_margin_up_db, gain_margin_down_db : nearest raise and reduction that destabilise [dB]; inf, -inf where none
    phase_margin : the smallest in magnitude [rad]; inf without a gain crossover
    sensitivity_peak : ``max 1 / |1 + L|``, at least 1
    """

    gain_margin_up_db: float
    gain_margin_down_db: float
    phase_margin: float
    sensitivity_peak: float


@dataclass(frozen=True)
class ControlStep:
    """The aileron's response to the reference step, by `control.forced_response` and `control.step_info`.

    Attributes
    ----------
    rise_time, settling_time : [s], to the samples; nan where the response does not get there
    overshoot, undershoot : fractions of the change
    steady_state_value : what the aileron settles to, trim included [rad]
    resolution : time between the samples [s]
    """

    rise_time: float
    settling_time: float
    overshoot: float
    undershoot: float
    steady_state_value: float
    resolution: float


@dataclass(frozen=True, eq=False)
class Code:
    """How a controller runs on a computer.

    Attributes
    ----------
    sampling : sample time and delay of the computation
    held_gain : (m, d) gains on the commands under way, input by input the last one first; d may be 0
    waiting : commands of each input that these gains are on
    """

    sampling: Sampling
    held_gain: FloatArray
    waiting: tuple[int, ...]
