"""What a search of Bryson's weights is asked for: what to meet, what to keep small, and which weights may move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from design.lqr.controller import LqrController
from design.lqr.power_weights import ReferenceStep
from design.lqr.weights import BrysonWeights
from design.specs import Spec
from model.arrays import FloatArray

#: Quantity of the reference step that is made least; see `WeightSearch`.
Minimised = Literal["total_rms_power", "peak_aileron_torque", "peak_total_power", "energy_out"]

UNITS: dict[Minimised, str] = {
    "total_rms_power": "W",
    "peak_aileron_torque": "N m",
    "peak_total_power": "W",
    "energy_out": "J",
}

#: Weight of Bryson's rule -> the state or the input that it weighs.
WEIGHED: dict[str, str] = {
    "aileron": "da",
    "aileron_rate": "da_rate",
    "tab": "dt",
    "tab_rate": "dt_rate",
    "aileron_integral": "int_a",
    "tab_integral": "int_t",
    "tab_torque": "T_t",
    "aileron_torque": "T_a",
}

#: The weights that are searched unless told: all but the one that keeps the scale of Q against R.
SIX = ("aileron", "aileron_rate", "tab", "tab_rate", "aileron_integral", "aileron_torque")

_PEAKS = tuple(f"{name}_{what}" for name in ("tab", "aileron") for what in ("deflection", "rate", "torque", "power"))
#: Quantities that a search can steer by, and the only sense in which it can.
SENSES: dict[str, str] = {
    "damping_ratio": "min",
    "settling_time": "max",
    "overshoot": "max",
    **dict.fromkeys(_PEAKS, "max"),
}


@dataclass(frozen=True)
class WeightSearch:
    """Bryson weights asked for by what the loop is to do.

    A cost that is multiplied as a whole has the same optimum, so one of the largest acceptable values can be kept: the
    others are then sought relative to it. Where all are searched there is one too many, which does no harm.

    Attributes
    ----------
    controller : the structure, and Bryson weights to start from; the weights that are not searched stay at these
    specs : what is to be met at every point, of the quantities and senses of `SENSES`; limits are positive numbers, or
        vary over the grid. Limits of the actuators are specs like any other (`design.assess.limit_specs`)
    step : the reference step
    minimised : what is made least, of the reference step for its duration, trim torques included:

        ======================= =====================================================
        ``total_rms_power``     RMS power of the tab plus RMS power of the aileron [W]
        ``peak_aileron_torque`` peak of ``abs(T_a)`` [N m]
        ``peak_total_power``    peak of ``abs(T_t dt') + abs(T_a da')`` [W]
        ``energy_out``          work of both while their power is positive [J]
        ======================= =====================================================
    searched : names of the weights that are searched
    span : each is sought between its start over `span` and its start times `span`

    Raises
    ------
    ValueError : weights of another kind, a controller that follows no reference, samples or estimates, names that do
        not exist or stand there twice, a spec of a quantity or sense that no search can steer by, that stands there
        twice or has a limit that is not positive, a span not above 1
    """

    controller: LqrController
    specs: tuple[Spec, ...]
    step: ReferenceStep
    minimised: Minimised = "total_rms_power"
    searched: tuple[str, ...] = SIX
    span: float = 100.0

    def __post_init__(self) -> None:
        controller = self.controller
        if not isinstance(controller.weights, BrysonWeights):
            raise ValueError(f"a search starts from Bryson's rule, not from {type(controller.weights).__name__}")
        if controller.reference == "none":
            raise ValueError("a regulator follows no reference: there is no step to search its weights on")
        if controller.sampling is not None or controller.measurement is not None:
            raise ValueError("weights are searched in continuous time with all states measured")
        if self.minimised not in get_args(Minimised):
            raise ValueError(f"minimised must be one of {', '.join(get_args(Minimised))}, not {self.minimised!r}")
        known = self._known()
        if not self.searched or len(set(self.searched)) < len(self.searched) or not set(self.searched) <= set(known):
            raise ValueError(f"searched must be some of {', '.join(known)}, each once, not {self.searched}")
        if not 1.0 < self.span < float("inf"):
            raise ValueError(f"span must be above 1 and finite, not {self.span}")
        self._check_specs()

    def _known(self) -> list[str]:
        """Weights that the start has, of what the structure has."""
        absent = {"aileron": ("tab_integral",), "aileron_and_tab": (), "none": ()}[self.controller.reference]
        return [name for name in WEIGHED if name not in absent and getattr(self.start, name) is not None]

    def _check_specs(self) -> None:
        quantities = [spec.quantity for spec in self.specs]
        for spec in self.specs:
            if SENSES.get(spec.quantity) != spec.sense:
                raise ValueError(f"no search of weights steers by {spec.quantity} {spec.sense}")
            if quantities.count(spec.quantity) > 1:
                raise ValueError(f"{spec.quantity} is asked for more than once")
            if not np.all(np.asarray(spec.limit) > 0.0):
                raise ValueError(f"{spec.quantity} {spec.sense}: the limit must be positive, not {spec.limit}")

    @property
    def start(self) -> BrysonWeights:
        """The weights to start from."""
        weights = self.controller.weights
        assert isinstance(weights, BrysonWeights)
        return weights

    @property
    def settling(self) -> int | None:
        """Number of the spec that is a settling time; None without one."""
        quantities = [spec.quantity for spec in self.specs]
        return quantities.index("settling_time") if "settling_time" in quantities else None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all weights, those that stay included."""
        return tuple(self._known())

    def maxima(self, z: FloatArray) -> FloatArray:
        """Largest acceptable values (..., `names`), z (..., J) the logarithms of the searched ones over the start's."""
        values = np.array([getattr(self.start, name) for name in self.names])
        found = np.broadcast_to(values, (*z.shape[:-1], values.size)).copy()
        found[..., [self.names.index(name) for name in self.searched]] *= np.exp(z)
        return found
