"""A study: everything a design depends on, in SI and radians. The request of the service, without HTTP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.classical.controller import ClassicalController
from design.lqr.synthesis import LqrController
from design.manoeuvre import Manoeuvre, rate_limited_step, step
from design.specs import SPEC_PACKS, Spec
from model.actuators import Actuator
from model.aerodynamics import Aerodynamics
from model.arrays import FloatArray
from model.flight import SpeedAxis
from model.section import Geometry, Inertia
from model.trim import TrimRequest

Controller = ClassicalController | LqrController


@dataclass(frozen=True)
class GridRequest:
    """Breakpoints: altitude [m] by `speed_axis` (``dynamic_pressure`` [Pa], ``airspeed`` [m/s], ``mach``)."""

    altitude: tuple[float, ...]
    speed_axis: SpeedAxis
    speed: tuple[float, ...]
    temperature_offset: float = 0.0


@dataclass(frozen=True)
class Reference:
    """The manoeuvre that actuators are judged on: a step from trim, at once or at a limited rate (seed Fig 5.20).

    What is said of the step itself (settling, overshoot, bandwidth) is said of one at once.

    Attributes
    ----------
    aileron : size of the aileron's step [rad]
    duration : how long the response is followed [s]
    tab : size of the tab's step [rad], where the tab has a reference of its own
    rate_limit : rate at which the references go there [rad/s]; None: at once
    """

    aileron: float
    duration: float
    tab: float = 0.0
    rate_limit: float | None = None
    kind: Literal["step"] = "step"

    def sizes(self, references: tuple[str, ...]) -> FloatArray:
        """Step of each of a loop's references (p,) [rad]."""
        of = {"r_a": self.aileron, "r_t": self.tab}
        return np.array([of[name] for name in references])

    def manoeuvre(self, references: tuple[str, ...]) -> Manoeuvre:
        """The courses of a loop's references."""
        sizes = self.sizes(references)
        return step(sizes) if self.rate_limit is None else rate_limited_step(sizes, self.rate_limit)


@dataclass(frozen=True)
class PlantStudy:
    """What the linear models depend on: geometry, inertia, air, trim and grid."""

    geometry: Geometry
    inertia: Inertia
    aerodynamics: Aerodynamics
    trim: TrimRequest
    grid: GridRequest


@dataclass(frozen=True)
class Study(PlantStudy):
    """The plant, its actuators, the reference they are judged on and the controllers to design.

    The specs of `spec_pack` are judged and reported for every controller; they steer none.
    """

    name: str
    tab_actuator: Actuator
    aileron_actuator: Actuator
    reference: Reference
    controllers: tuple[Controller, ...]
    spec_pack: tuple[Spec, ...] = SPEC_PACKS["default"]
