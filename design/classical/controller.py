"""What a tab-only classical controller is asked for: structure, command, specs, and the gains that are given.

With ``sigma`` the sign of the servo-tab's DC gain (negative: tab up drives the aileron down), every gain is
at least zero. The tab's commanded deflection is

- ``negative_feedback`` (4.1.2, 4.2.1): ``dt_cmd = sigma [K_i int(r_a - da) - K_p da - K_d da']``
- ``positive_feedback`` (4.1.3, 4.2.2): ``dt_cmd = sigma [K_i int(r_a - da) + K_f da]``

A tab actuator that takes deflections is given ``dt_cmd``; one that takes rates is given
``dt_rate_cmd = K_theta (dt_cmd - dt)``, the inner tab loop (4.1.1).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from design.sampling import Sampling
from design.specs import Spec
from model.arrays import Floats

Structure = Literal["negative_feedback", "positive_feedback"]
TabCommand = Literal["deflection", "rate"]

_OUTER_UNITS: dict[Structure, dict[str, str]] = {
    "negative_feedback": {"K_d": "s", "K_p": "1", "K_i": "1/s"},
    "positive_feedback": {"K_f": "1", "K_i": "1/s"},
}
_INNER_UNITS: dict[TabCommand, dict[str, str]] = {"deflection": {}, "rate": {"K_theta": "1/s"}}

_LAWS: dict[Structure, str] = {
    "negative_feedback": "dt_cmd = sigma (K_i int(r_a - da) - K_p da - K_d da_rate), sigma = -1",
    "positive_feedback": "dt_cmd = sigma (K_i int(r_a - da) + K_f da), sigma = -1",
}


@dataclass(frozen=True)
class ClassicalController:
    """A tab-only controller asked for by its specs, by its gains, or by some of both.

    Attributes
    ----------
    name : unique in its study
    kind : ``negative_feedback`` or ``positive_feedback``
    specs : what the design must meet; quantities of `design.classical.steering.STEERABLE`
    rate_filter : cut-off w of the filtered derivative ``w s / (s + w)`` that supplies da' [rad/s];
        None when the rate is measured. Unused by positive feedback, which needs no rate.
    tab_command : what the tab's actuator is given, a deflection or a rate
    gains : gains that are given, by name (`gain_units`), each a number or (*G,); the others are chosen. When all
        are given the specs are judged only.
    sampling : how the controller runs on a computer; None is a continuous one
    smoothness : largest part of the bandwidth, 0 to 1, that may be given up at any point so that gains vary
        smoothly over the grid; 0 leaves every point its fastest design
    """

    name: str
    kind: Structure
    specs: tuple[Spec, ...] = ()
    rate_filter: float | None = None
    tab_command: TabCommand = "deflection"
    gains: Mapping[str, Floats] = field(default_factory=dict)
    sampling: Sampling | None = None
    smoothness: float = 0.0

    @property
    def gain_units(self) -> dict[str, str]:
        """Unit of each gain, in the order in which the loops are closed."""
        return {**_INNER_UNITS[self.tab_command], **_OUTER_UNITS[self.kind]}

    @property
    def law(self) -> str:
        """The control law in one line, with the gains by name."""
        inner = "; dt_rate_cmd = K_theta (dt_cmd - dt)" if self.tab_command == "rate" else ""
        return _LAWS[self.kind] + inner

    @property
    def all_gains_given(self) -> bool:
        """Whether nothing is left to choose."""
        return set(self.gains) == set(self.gain_units)

    @property
    def filtered_rate(self) -> bool:
        """Whether the law feeds back a rate that is a filtered derivative of the measured angle."""
        return self.kind == "negative_feedback" and self.rate_filter is not None

    @property
    def measured_rate(self) -> bool:
        """Whether the law feeds back a rate that a sensor supplies."""
        return self.kind == "negative_feedback" and self.rate_filter is None
