"""What a non-linear simulation is asked for, and what it can be refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from model.actuators import ActuatorLimits

SURFACES = ("tab", "aileron")


def check_steps(duration: float, samples: int, tolerance: float, substeps: int | None) -> None:
    """Refuse a duration [s], samples, a tolerance or steps between two samples that no simulation has.

    Raises
    ------
    ValueError : a number out of its range
    """
    if not 0.0 < duration < float("inf"):
        raise ValueError(f"duration must be positive and finite, not {duration} s")
    if samples < 2:
        raise ValueError(f"a response needs at least two samples, not {samples}")
    if not 0.0 < tolerance < 1.0:
        raise ValueError(f"tolerance must lie between 0 and 1, not {tolerance}")
    if substeps is not None and substeps < 1:
        raise ValueError(f"there is at least one step between two samples, not {substeps}")


@dataclass(frozen=True)
class Friction:
    """Coulomb friction of a hinge with its drive (seed 7.4.4).

    Attributes
    ----------
    static : largest torque that holds the surface at rest, the break-away torque [N m]
    kinetic : torque against the motion [N m]; at most the static one

    Raises
    ------
    ValueError : a torque below zero or not finite, or a kinetic one above the static one
    """

    static: float
    kinetic: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.kinetic <= self.static < float("inf"):
            raise ValueError(f"friction needs 0 <= kinetic <= static, not {self.kinetic} and {self.static} N m")


@dataclass(frozen=True)
class Freeplay:
    """A dead band in the link between the tab's actuator and the tab, elastic beyond it (seed 7.4.4).

    Attributes
    ----------
    gap : whole width of the band in which the tab is free [rad]
    stiffness : of the link beyond the band [N m/rad]
    damping : of the link while it bears [N m s/rad]

    Raises
    ------
    ValueError : a gap or a damping below zero, a stiffness that is not positive, or one that is not finite
    """

    gap: float
    stiffness: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        infinite = float("inf")
        if not (0.0 <= self.gap < infinite and 0.0 < self.stiffness < infinite and 0.0 <= self.damping < infinite):
            raise ValueError("freeplay needs gap >= 0, stiffness > 0 and damping >= 0, all finite")


@dataclass(frozen=True)
class SimulationRequest:
    """How a loop is simulated.

    Attributes
    ----------
    duration : length of the response [s]
    samples : samples of the result, both ends included; knots of the manoeuvre add theirs
    tolerance : error of the integration that the step is chosen for, relative to the largest change (`time_grid`)
    substeps : steps between two samples; None lets each point have what the tolerance needs
    limits : of the actuators, by ``tab`` and ``aileron``; what is absent is unlimited
    friction : of the hinges, by ``tab`` and ``aileron``
    freeplay : between the tab's actuator and the tab; of loops that command deflections or rates
    anti_windup : speed at which integrals follow what the actuators can do [1/s]; 0 none, None the rule of
        `anti_windup`
    estimate_error : simulate with half the step too, return that, and how far the two are apart

    Raises
    ------
    ValueError : a number out of its range, or a surface that there is not
    """

    duration: float
    samples: int = 501
    tolerance: float = 1e-6
    substeps: int | None = None
    limits: Mapping[str, ActuatorLimits] = field(default_factory=dict)
    friction: Mapping[str, Friction] = field(default_factory=dict)
    freeplay: Freeplay | None = None
    anti_windup: float | None = None
    estimate_error: bool = False

    def __post_init__(self) -> None:
        check_steps(self.duration, self.samples, self.tolerance, self.substeps)
        if self.anti_windup is not None and not 0.0 <= self.anti_windup < float("inf"):
            raise ValueError(f"anti_windup must be at least 0 and finite, not {self.anti_windup} 1/s")
        unknown = [name for name in (*self.limits, *self.friction) if name not in SURFACES]
        if unknown:
            raise ValueError(f"no surface {unknown[0]!r}; there are {', '.join(SURFACES)}")
        for name, limits in self.limits.items():
            for what, limit in vars(limits).items():
                if limit is not None and not 0.0 < limit < float("inf"):
                    raise ValueError(f"{what} limit of the {name}: must be positive and finite, not {limit}")

    def limit(self, surface: str, what: str) -> float | None:
        """One limit; None where there is none."""
        found: float | None = getattr(self.limits.get(surface, ActuatorLimits()), what)
        return found
